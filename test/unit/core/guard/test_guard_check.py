"""The guard's verdict, case by case."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from advise_ros.core.grid.grid import Grid
from advise_ros.core.guard.fence import Fence, box, fence_around
from advise_ros.core.guard.rules import Command, Limits, Position, check
from advise_ros.core.guard.stamp_watch import StampWatch
from advise_ros.core.units import ZERO

LIMITS = Limits(max_speed_m_s=3.0, max_climb_m_s=1.5, fence=box((-2.0, -2.0, 2.0), (12.0, 12.0, 8.0)))
HERE = Position((5.0, 5.0, 5.0), 'map', 0.01)


def asked(east: float = 1.0, north: float = 0.0, up: float = 0.0, **fields: object) -> Command:
    return Command((east, north, up), 'map', 0.01)._replace(**fields)  # type: ignore[arg-type]


def test_a_harmless_command_passes_as_it_is() -> None:
    assert check(asked(1.0, 0.5, -0.3, yaw_rate_rad_s=0.4), HERE, LIMITS) == ((1.0, 0.5, -0.3), 0.4, '')


@pytest.mark.parametrize(('command', 'position', 'words'), [
    (None, HERE, 'no command yet'),
    (asked(), None, 'no pose yet'),
    (asked(age_s=0.6), HERE, 'command older than 0.5 s'),
    (asked(age_s=-0.1), HERE, 'command older than 0.5 s'),
    (asked(), HERE._replace(age_s=0.6), 'pose older than 0.5 s'),
    (asked(frame_id='base_link'), HERE, "command refused: its frame is 'base_link'; it must be 'map' (ENU)"),
    (asked(frame_id=''), HERE, "command refused: its frame is ''; it must be 'map' (ENU)"),
    (asked(), HERE._replace(frame_id='odom'), "pose refused: its frame is 'odom'; it must be 'map' (ENU)"),
    (asked(math.nan), HERE, 'command refused: it is not finite'),
    (asked(yaw_rate_rad_s=math.inf), HERE, 'command refused: it is not finite'),
    (asked(age_s=math.nan), HERE, 'command older than 0.5 s'),
    (asked(), HERE._replace(position_enu_m=(math.nan, 0.0, 5.0)), 'pose refused: it is not finite'),
    (asked(doubt='its stamp is 9.0 s in the future'), HERE, 'command refused: its stamp is 9.0 s in the future'),
])
def test_doubt_means_zero_in_words(command: Command | None, position: Position | None, words: str) -> None:
    assert check(command, position, LIMITS) == (ZERO, 0.0, words)


def test_speed_and_climb_are_scaled_down_in_their_direction() -> None:
    fast = check(asked(30.0, 40.0), HERE, Limits())
    assert fast.velocity_enu_m_s == pytest.approx((1.8, 2.4, 0.0))
    assert fast.reason == 'speed limited to 3 m/s'
    steep = check(asked(2.0, 0.0, 3.0), HERE, Limits())
    assert steep.velocity_enu_m_s == pytest.approx((1.0, 0.0, 1.5))
    assert steep.reason == 'climb limited to 1.5 m/s'


def test_the_largest_numbers_stay_finite() -> None:
    verdict = check(asked(1e308, 1e308, -1e308), HERE, LIMITS)
    assert all(math.isfinite(value) for value in verdict.velocity_enu_m_s)


def test_yaw_rate_is_clamped() -> None:
    assert check(asked(yaw_rate_rad_s=-9.0), HERE, LIMITS).yaw_rate_rad_s == -1.0


def test_slower_toward_the_fence_and_free_along_it() -> None:
    near = Position((11.5, 5.0, 5.0), 'map', 0.0)
    verdict = check(asked(2.0, 1.0), near, LIMITS)
    east, north, _ = verdict.velocity_enu_m_s
    assert 0.0 < east < 1.0
    assert north == 1.0
    assert verdict.reason == 'fence ahead: east limited'
    assert check(asked(-2.0, 1.0), near, LIMITS).reason == ''


def test_outside_only_inward() -> None:
    outside = Position((13.0, 5.0, 5.0), 'map', 0.0)
    assert check(asked(1.0, 1.0), outside, LIMITS).velocity_enu_m_s == (0.0, 0.0, 0.0)
    back = check(asked(-1.0, 1.0), outside, LIMITS)
    assert back.velocity_enu_m_s == (-1.0, 0.0, 0.0)
    assert back.reason == 'outside the fence (1.0 m in plan): only motion back inward is flown'


def test_back_in_no_faster_than_it_can_stop_before_the_other_side() -> None:
    # The corner at the origin is as sharp as 27 degrees: 0.1 m from it the fence is 5 cm deep.
    sharp = replace(LIMITS, fence=Fence(((0.0, 0.0), (10.0, 0.0), (10.0, 5.0)), 4.0, 5.0))
    beside = check(asked(0.0, 3.0), Position((0.1, -0.5, 4.5), 'map', 0.0), sharp).velocity_enu_m_s
    assert 0.0 < beside[1] < 0.05
    assert check(asked(0.0, 3.0), Position((8.0, -0.5, 4.5), 'map', 0.0), sharp).velocity_enu_m_s[1] > 1.0
    too_low = check(Command((0.0, 0.0, 1.5), 'map', 0.0), Position((8.0, 1.0, 3.0), 'map', 0.0), sharp).velocity_enu_m_s
    assert 0.0 < too_low[2] < 0.8


def test_beside_a_corner_back_in_is_along_its_bisector() -> None:
    sharp = replace(LIMITS, fence=Fence(((0.0, 0.0), (10.0, 0.0), (10.0, 5.0)), 4.0, 5.0))
    # Straight to the corner and on would lead out of the other edge.
    east, north, _ = check(asked(1.0, 0.0), Position((-0.1, 0.15, 4.5), 'map', 0.0), sharp).velocity_enu_m_s
    assert math.atan2(north, east) == pytest.approx(math.atan2(5.0, 10.0) / 2.0)


def test_the_fence_stands_around_the_grid() -> None:
    grid = Grid(2.0, 6, 4, (-1.0, -3.0), 5.0, (0, 5))
    assert fence_around(grid, 1.0, 3.0) == box((-2.0, -4.0, 2.0), (12.0, 6.0, 8.0))


@pytest.mark.parametrize(('stamp_s', 'newest_s', 'words'), [
    (0.0, 99.0, ''), (100.0, 100.4, ''), (103.0, 0.0, ''),
    (110.0, 0.0, 'its stamp is 10.0 s in the future; is use_sim_time the same everywhere?'),
    (90.0, 100.0, 'its stamp is 10.0 s before that of another command; let one node fly at a time'),
])
def test_stamps_from_the_future_or_the_past(stamp_s: float, newest_s: float, words: str) -> None:
    watch = StampWatch('command', 0.5)
    if newest_s:
        assert watch.doubt(int(newest_s * 1e9), 100 * 10**9, 1.0) == ''
    assert watch.doubt(int(stamp_s * 1e9), 100 * 10**9, 1.1) == words


def test_a_clock_that_has_not_begun_refuses_nothing() -> None:
    assert StampWatch('command', 0.5).doubt(10**18, 0, 0.0) == ''


@pytest.mark.parametrize('set_by_s', [60.0, -60.0])
def test_a_clock_that_is_set_in_flight_makes_no_doubt(set_by_s: float) -> None:
    """Stamps by the old clock go on for a while, as poses do until their stamper has noticed."""
    watch = StampWatch('command', 0.5)
    for tick in range(400):
        now_s = tick * 0.05
        ours = 1000.0 + now_s + (set_by_s if tick >= 100 else 0.0)
        stamped = ours - (set_by_s if 100 <= tick < 110 else 0.0)
        assert watch.doubt(int(stamped * 1e9), int(ours * 1e9), now_s) == ''


def test_a_command_of_an_hour_ago_is_refused() -> None:
    watch = StampWatch('command', 0.5)
    assert watch.doubt(400 * 10**9, 4000 * 10**9, 0.0).startswith('its stamp is 3600.0 s in the past; is use_sim_time')
