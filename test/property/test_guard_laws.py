"""Laws of the guard: never faster, never infinite, never past the fence, never on stale news."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from advise_ros.core.guard.fence import Fence, box, stopping_speed_m_s
from advise_ros.core.guard.rules import Command, Limits, Position, check
from advise_ros.core.units import ZERO
from support.guarded_flight import BOUND_M, episode

LOW, HIGH = (-2.0, -3.0, 1.0), (10.0, 9.0, 9.0)
FENCE = box(LOW, HIGH)
LIMITS = Limits(max_speed_m_s=4.0, max_climb_m_s=2.0, braking_m_s2=2.0, command_timeout_s=0.5, pose_timeout_s=0.5,
                reaction_s=1.1, fence=FENCE)
any_float = st.floats()
any_vector = st.tuples(any_float, any_float, any_float)
frame = st.sampled_from(['map', 'map', 'map', 'base_link', ''])
age = st.one_of(st.floats(0.0, 0.5), st.floats())
commands = st.none() | st.builds(Command, any_vector, frame, age, any_float, st.sampled_from(['', '', 'doubt']))
positions = st.none() | st.builds(Position, any_vector, frame, age)
fences = st.sampled_from([FENCE, None])


@given(commands, positions, fences)
def test_finite_within_the_limits_and_never_without_a_word(
    command: Command | None, position: Position | None, fence: Fence | None
) -> None:
    limits = Limits(fence=fence)
    verdict = check(command, position, limits)
    east, north, up = verdict.velocity_enu_m_s
    assert all(map(math.isfinite, (east, north, up, verdict.yaw_rate_rad_s)))
    assert math.hypot(east, north) <= limits.max_speed_m_s * (1 + 1e-9)
    assert abs(up) <= limits.max_climb_m_s * (1 + 1e-9)
    assert abs(verdict.yaw_rate_rad_s) <= limits.max_yaw_rate_rad_s
    if command is not None and command.velocity_enu_m_s != verdict.velocity_enu_m_s:
        assert verdict.reason


@given(commands, positions)
def test_stale_or_foreign_or_infinite_is_zero(command: Command | None, position: Position | None) -> None:
    sound = (
        command is not None and position is not None
        and 0 <= command.age_s <= 0.5 and 0 <= position.age_s <= 0.5
        and command.frame_id == position.frame_id == 'map' and not command.doubt
        and all(map(math.isfinite, (*command.velocity_enu_m_s, command.yaw_rate_rad_s, *position.position_enu_m)))
    )
    verdict = check(command, position, LIMITS)
    if not sound:
        assert verdict.velocity_enu_m_s == ZERO
        assert verdict.reason


@given(st.tuples(*[st.floats(-50.0, 50.0)] * 3), st.tuples(*[st.floats(-50.0, 50.0)] * 3))
def test_outside_the_fence_the_distance_never_grows(
    velocity: tuple[float, float, float], position: tuple[float, float, float]
) -> None:
    out = check(Command(velocity, 'map', 0.0), Position(position, 'map', 0.0), LIMITS).velocity_enu_m_s
    for axis in range(3):
        if position[axis] > HIGH[axis]:
            assert out[axis] <= 0.0
        if position[axis] < LOW[axis]:
            assert out[axis] >= 0.0


@given(st.floats(0.0, 1e4), st.floats(0.1, 50.0), st.floats(0.01, 5.0))
def test_stopping_speed_uses_the_distance_and_no_more(distance: float, braking: float, reaction: float) -> None:
    speed = stopping_speed_m_s(distance, braking, reaction)
    assert math.isclose(speed * reaction + speed**2 / (2 * braking), distance, rel_tol=1e-9, abs_tol=1e-12)


def worst_flight(pushes: list[float], pose_gap_s: float, lost_after_s: float, start: float) -> float:
    """Furthest east of a double integrator that is pushed by commands, poses coming late and at last no more.

    The vehicle changes its velocity by at most `braking_m_s2`, also when it should brake; commands are
    checked every tick of 50 ms against a pose that is up to `pose_gap_s` old.
    """
    tick_s, step_s = 0.05, 0.005
    east, speed, wanted, furthest = start, 0.0, 0.0, start
    seen, seen_s = start, 0.0
    for i in range(len(pushes) * 20):
        now_s = i * tick_s
        if now_s - seen_s >= pose_gap_s and now_s < lost_after_s:
            seen, seen_s = east, now_s
        push = pushes[i // 20]
        position = Position((seen, 3.0, 5.0), 'map', now_s - seen_s)
        wanted = check(Command((push, 0.0, 0.0), 'map', 0.0), position, LIMITS).velocity_enu_m_s[0]
        for _ in range(round(tick_s / step_s)):
            change = max(-LIMITS.braking_m_s2 * step_s, min(LIMITS.braking_m_s2 * step_s, wanted - speed))
            east += (speed + change / 2) * step_s
            speed += change
            furthest = max(furthest, east)
    return furthest


@settings(deadline=None, max_examples=200)
@given(
    st.lists(st.sampled_from([100.0, 4.0, 1.0, -4.0, 0.0]), min_size=4, max_size=12),
    st.sampled_from([0.0, 0.1, 0.25, 0.45]), st.floats(0.5, 12.0), st.floats(-2.0, 10.0),
)


def test_a_vehicle_that_brakes_as_promised_never_leaves_the_fence(
    pushes: list[float], pose_gap_s: float, lost_after_s: float, start: float
) -> None:
    assert worst_flight([*pushes, *[100.0] * 3], pose_gap_s, lost_after_s, start) <= HIGH[0] + 1e-6


@pytest.mark.parametrize('number', range(48))
def test_who_means_to_leave_in_gusts_and_over_failing_links_stays_within_the_documented_bound(number: int) -> None:
    """The short form of benchmarks/guard_episodes.py."""
    assert episode(1, number).fly(20.0) <= BOUND_M


@pytest.mark.parametrize('number', range(48))
def test_with_drift_jumps_and_links_that_are_late_by_up_to_ten_seconds_the_bound_holds_too(number: int) -> None:
    """The short form of benchmarks/guard_episodes.py --troubled."""
    flight = episode(1, number, troubled=True)
    assert flight.fly(40.0) <= flight.bound_m
