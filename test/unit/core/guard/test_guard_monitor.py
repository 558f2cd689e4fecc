"""The guard over time: jumps, growing velocity, the latched stop, polygons."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from advise_ros.core.errors import InputError
from advise_ros.core.guard.fence import Fence, box, corners_from_text, outside_m
from advise_ros.core.guard.monitor import GuardMonitor, MonitorSettings
from advise_ros.core.guard.rules import Command, Limits, Position, check
from advise_ros.core.units import ZERO, Vector

LIMITS = Limits(fence=box((-50.0, -50.0, 0.0), (50.0, 50.0, 20.0)))
HERE: Vector = (0.0, 0.0, 5.0)
# An L: the north-east quarter is missing.
L_SHAPE = Fence(((0.0, 0.0), (10.0, 0.0), (10.0, 5.0), (5.0, 5.0), (5.0, 10.0), (0.0, 10.0)), 0.0, 20.0)


def monitor(**settings: object) -> GuardMonitor:
    return GuardMonitor(LIMITS, MonitorSettings(**settings))  # type: ignore[arg-type]


def ask(guarding: GuardMonitor, now_s: float, velocity: Vector = (1.0, 0.0, 0.0), at: Vector | None = HERE) -> tuple[Vector, str]:
    """One tick with a pose and a command; what is flown and why."""
    if at is not None:
        guarding.pose(at, 'map', now_s)
    guarding.command(Command(velocity, 'map', 0.0), now_s)
    verdict = guarding.verdict(now_s)
    assert verdict is not None
    return verdict.velocity_enu_m_s, verdict.reason


def test_nothing_before_the_first_command() -> None:
    guarding = monitor()
    guarding.pose(HERE, 'map', 0.0)
    assert guarding.verdict(0.0) is None


def test_velocity_grows_at_the_acceleration_and_falls_at_once() -> None:
    guarding = monitor(max_acceleration_m_s2=2.0)
    speeds = [ask(guarding, tick * 0.05)[0][0] for tick in range(12)]
    assert speeds[:3] == pytest.approx([0.2, 0.3, 0.4])
    assert speeds[-1] == 1.0
    assert ask(guarding, 0.6, (0.2, 0.0, 0.0))[0] == (0.2, 0.0, 0.0)
    turned, why = ask(guarding, 0.65, (-1.0, 0.0, 0.0))
    assert turned == pytest.approx((-0.1, 0.0, 0.0))
    assert why == 'acceleration limited to 2 m/s2'


def test_a_pause_is_no_licence_to_accelerate() -> None:
    guarding = monitor(max_acceleration_m_s2=2.0)
    ask(guarding, 0.0, ZERO)
    assert ask(guarding, 30.0)[0] == pytest.approx((0.2, 0.0, 0.0))


def test_a_position_that_jumps_is_doubted_until_it_is_steady() -> None:
    guarding = monitor()
    assert ask(guarding, 0.0)[0] == (1.0, 0.0, 0.0)
    flown, why = ask(guarding, 0.05, at=(7.0, 0.0, 5.0))
    assert flown == ZERO
    assert why == 'pose refused: it jumped 7.0 m in 0.05 s'
    assert ask(guarding, 0.9, at=(7.0, 0.0, 5.0))[0] == ZERO
    assert ask(guarding, 1.2, at=(7.0, 0.0, 5.0))[0] == (1.0, 0.0, 0.0)


def test_fast_flight_in_fast_simulation_is_no_jump() -> None:
    guarding = monitor()
    for tick in range(40):  # 3 m/s, twenty times faster than steady time.
        guarding.pose((3.0 * tick, 0.0, 5.0), 'map', tick * 0.05, stamp_ns=tick * 10**9)
    assert guarding._jump == ''


@pytest.mark.parametrize(('frame', 'at', 'words'), [
    ('odom', HERE, "its frame is 'odom'"), ('map', (math.nan, 0.0, 0.0), 'not finite'),
])
def test_a_doubt_latches_when_configured_and_only_release_ends_it(frame: str, at: Vector, words: str) -> None:
    guarding = monitor(latch=True)
    assert ask(guarding, 0.0)[0] == (1.0, 0.0, 0.0)
    guarding.pose(at, frame, 0.05)
    assert words in ask(guarding, 0.05, at=None)[1]
    for tick in range(100):
        flown, why = ask(guarding, 2.0 + tick * 0.05)
        assert flown == ZERO
        assert why.startswith('stopped until released: pose refused: ')
    assert words in guarding.release()
    assert ask(guarding, 10.0)[0] == (1.0, 0.0, 0.0)
    assert guarding.release() == ''


def test_a_pilot_who_falls_silent_needs_no_release_but_a_silent_pose_does() -> None:
    guarding = monitor(latch=True)
    ask(guarding, 0.0)
    verdict = guarding.verdict(1.0)
    assert verdict is not None
    assert (verdict.velocity_enu_m_s, verdict.reason) == (ZERO, 'command older than 0.5 s')
    assert guarding.latched == ''
    assert ask(guarding, 2.0, at=None)[0] == ZERO
    assert guarding.latched == 'pose older than 0.5 s'


def test_stop_is_for_all_commands_until_release() -> None:
    guarding = monitor()
    guarding.stop('somebody asked for it')
    assert ask(guarding, 0.0) == (ZERO, 'stopped until released: somebody asked for it')
    guarding.clear()
    assert ask(guarding, 1.0)[0] == ZERO
    guarding.release()
    assert ask(guarding, 2.0)[0] == (1.0, 0.0, 0.0)


def test_poses_from_the_future_are_refused() -> None:
    guarding = monitor()
    guarding.pose(HERE, 'map', 0.0, stamp_ns=200 * 10**9, now_ns=100 * 10**9)
    assert 'pose refused: its stamp is 100.0 s in the future' in ask(guarding, 0.0, at=None)[1]


# -- polygons ----------------------------------------------------------------------------------
def allowed(at: Vector, velocity: Vector) -> Vector:
    return check(Command(velocity, 'map', 0.0), Position(at, 'map', 0.0), Limits(fence=L_SHAPE)).velocity_enu_m_s


def test_a_corner_that_points_inward_is_kept_off_and_the_arms_are_free() -> None:
    assert allowed((2.0, 2.0, 5.0), (0.3, 0.3, 0.0)) == (0.3, 0.3, 0.0)
    near = allowed((4.5, 4.5, 5.0), (2.0, 2.0, 0.0))
    assert 0.0 < near[0] < 0.5
    assert near[0] == pytest.approx(near[1])
    along = allowed((4.0, 7.0, 5.0), (0.0, 1.0, 0.0))
    assert along == (0.0, 1.0, 0.0)


def test_outside_a_polygon_only_the_way_back_is_flown() -> None:
    assert outside_m(L_SHAPE, (7.0, 7.0)) == pytest.approx(2.0)
    assert allowed((6.0, 7.0, 5.0), (-1.0, 1.0, 0.5)) == pytest.approx((-1.0, 0.0, 0.0))
    assert allowed((6.0, 7.0, 5.0), (1.0, 1.0, 0.0)) == pytest.approx(ZERO)
    assert allowed((2.0, 2.0, 25.0), (1.0, 0.0, -1.0)) == (0.0, 0.0, -1.0)


def test_on_the_border_one_may_leave_it_inward_only() -> None:
    assert allowed((0.0, 5.0, 5.0), (-1.0, 0.0, 0.0)) == pytest.approx(ZERO)
    assert allowed((0.0, 5.0, 5.0), (1.0, 0.0, 0.0)) == pytest.approx((1.0, 0.0, 0.0))


def test_corners_are_read_in_either_order() -> None:
    square = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
    assert corners_from_text('0,0 4,0 4,4 0,4') == square
    assert set(corners_from_text('0,4 4,4 4,0 0,0')) == set(square)
    assert outside_m(Fence(corners_from_text('0,4 4,4 4,0 0,0'), 0.0, 1.0), (2.0, 2.0)) == 0.0


@pytest.mark.parametrize('text', ['0,0 1,1', '0,0 1,1 2', 'a,b c,d e,f', '0,0 1,0 nan,1', '0,0 1,1 2,2', '0,0 4,4 4,0 0,4'])
def test_what_is_no_polygon_is_refused_in_a_sentence(text: str) -> None:
    with pytest.raises(InputError, match=r'^fence_polygon .*corners in metres east and north, e\.g\.'):
        corners_from_text(text)


@pytest.mark.parametrize('period_s', [0.5, 1.5, 4.0])
def test_who_weaves_along_the_fence_does_not_pass_it(period_s: float) -> None:
    """What turns a vehicle does not slow it: without looking at how it moves it went out by 0.56 m."""
    guarding = GuardMonitor(replace(LIMITS, max_speed_m_s=4.0, reaction_s=1.8), MonitorSettings())
    at, moving, obeyed, furthest = np.array([0.0, 40.0]), np.zeros(2), [np.zeros(2)] * 4, 0.0
    reasons = set()
    for tick in range(600):
        now_s = 0.05 * tick
        side = 1.0 if (now_s + 0.7) // period_s % 2 == 0 else -1.0
        asked, seen = (4.0 * side, 4.0, 0.0), (float(at[0]), float(at[1]), 5.0)
        flown, why = ask(guarding, now_s, asked, at=seen if tick % 4 == 0 else None)
        reasons.add(why)
        obeyed = [*obeyed[1:], np.array(flown[:2])]
        for _ in range(5):
            change = obeyed[0] - moving
            change *= min(1.0, LIMITS.braking_m_s2 * 0.01 / max(math.hypot(*change), 1e-9))
            at = at + (moving + change / 2.0) * 0.01
            moving = moving + change
            furthest = max(furthest, at[1])
    assert 49.0 < furthest < 50.001
    assert 'fence ahead: it brakes before it turns' in reasons
