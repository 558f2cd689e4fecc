"""The guard's verdict, case by case."""

from __future__ import annotations

import math

import pytest

from advise_ros.core import guard
from advise_ros.core.grid import Grid
from advise_ros.core.guard import Command, Fence, Limits, Position, check

LIMITS = Limits(max_speed_m_s=3.0, max_climb_m_s=1.5, fence=Fence((-2.0, -2.0, 2.0), (12.0, 12.0, 8.0)))
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
    assert check(command, position, LIMITS) == (guard.ZERO, 0.0, words)


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
    assert back.reason == 'outside the fence (east): only motion back inward is flown'


def test_the_fence_stands_around_the_grid() -> None:
    grid = Grid(2.0, 6, 4, (-1.0, -3.0), 5.0, (0, 5))
    assert guard.fence_around(grid, 1.0, 3.0) == ((-2.0, -4.0, 2.0), (12.0, 6.0, 8.0))


@pytest.mark.parametrize(('stamp_s', 'newest_s', 'words'), [
    (0.0, 50.0, ''), (100.0, 100.4, ''), (103.0, 0.0, ''),
    (110.0, 0.0, 'its stamp is 10.0 s in the future; is use_sim_time the same everywhere?'),
    (90.0, 100.0, 'its stamp is 10.0 s before that of another command; let one node fly at a time'),
])
def test_stamps_from_the_future_or_the_past(stamp_s: float, newest_s: float, words: str) -> None:
    assert guard.stamp_doubt(int(stamp_s * 1e9), int(newest_s * 1e9), 100 * 10**9) == words


def test_a_clock_that_has_not_begun_refuses_nothing() -> None:
    assert guard.stamp_doubt(10**18, 0, 0) == ''
