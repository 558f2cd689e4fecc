"""Physics and motion control: flies like an ArduCopter, the same every time, and close to a fine integration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from rotorpy.vehicles.multirotor import Multirotor

from advise_ros.sim import airframe, control
from advise_ros.sim.airframe import CORRELATION_S, Wind
from advise_ros.sim.control import Target
from advise_ros.sim.quadcopter import Quadcopter, State, euler

STEP_S = 0.025
CALM = np.zeros(2)


def hovering(altitude_m: float = 5.0) -> State:
    body = airframe.at_rest((0.0, 0.0, altitude_m), airframe.HOVER_ROTOR_RAD_S)
    return State(body, control.at_rest(body['x'], euler(body['q'])[2]), np.zeros(2))


def fly(
    craft: Quadcopter, state: State, target: Target | None, seconds: float, rng: np.random.Generator | None = None,
) -> list[State]:
    states = []
    for _ in range(round(seconds / craft.step_s)):
        state = craft.step(state, target, CALM if rng is None else rng.standard_normal(2))
        states.append(state)
    return states


def speeds(states: list[State]) -> np.ndarray:
    return np.array([np.hypot(*state.velocity_enu_m_s[:2]) for state in states])


class FineAirframe(Multirotor):
    """RotorPy's own step with a tight tolerance."""

    def __init__(self) -> None:
        super().__init__(
            airframe.PARAMETERS, control_abstraction='cmd_ctatt', enable_ground=True,
            integrator_kwargs={'method': 'RK45', 'rtol': 1e-9, 'atol': 1e-10},
        )


def test_a_hovering_craft_stays_where_it_is():
    end = fly(Quadcopter(), hovering(), Target(), 5.0)[-1]
    np.testing.assert_allclose(end.position_enu_m, [0, 0, 5], atol=1e-6)
    np.testing.assert_allclose(end.roll_pitch_yaw_rad, [0, 0, math.pi / 2], atol=1e-6)


def test_a_velocity_is_reached_without_a_jump_and_without_swinging_over():
    states = fly(Quadcopter(), hovering(), Target((1.2, 0.0, 0.0)), 4.0)
    east = np.array([state.velocity_enu_m_s[0] for state in states])
    assert np.diff(east).max() < 3.5 * STEP_S  # acceleration stays near the limit of 3 m/s2
    assert 0.5 < (np.argmax(east > 1.08) + 1) * STEP_S < 1.2
    assert east.max() < 1.25
    assert east[-1] == pytest.approx(1.2, abs=0.02)
    assert abs(states[-1].altitude_m - 5.0) < 0.05


def test_a_stop_takes_time_and_way():
    cruising = fly(Quadcopter(), hovering(), Target((1.2, 0.0, 0.0)), 4.0)[-1]
    after = fly(Quadcopter(), cruising, Target(), 4.0)
    coast = after[-1].position_enu_m[0] - cruising.position_enu_m[0]
    assert 0.5 < coast < 1.0
    assert speeds(after)[-1] < 0.02


def test_speed_saturates():
    states = fly(Quadcopter(), hovering(), Target((100.0, 0.0, 0.0)), 12.0)
    assert speeds(states).max() < 10.8
    assert speeds(states)[-1] == pytest.approx(10.0, abs=0.3)


def test_it_leans_into_the_acceleration():
    """Accelerating east with the nose to the north is a roll to the right, which is positive about forward."""
    roll, pitch, _ = fly(Quadcopter(), hovering(), Target((3.0, 0.0, 0.0)), 0.6)[-1].roll_pitch_yaw_rad
    assert roll > 0.1
    assert abs(pitch) < 0.01


def test_yaw_turns_to_the_wanted_heading_no_faster_than_allowed():
    states = fly(Quadcopter(), hovering(), Target(yaw_enu_rad=-math.pi / 2), 6.0)
    yaws = np.unwrap([state.roll_pitch_yaw_rad[2] for state in states])
    assert np.abs(np.diff(yaws)).max() < 1.3 * control.YAW_RATE_LIMIT_RAD_S * STEP_S
    assert math.cos(yaws[-1] + math.pi / 2) > 0.9999


def test_steady_wind_does_not_carry_it_away():
    craft = Quadcopter(wind=Wind((5.0, -3.0)))
    end = fly(craft, hovering(), Target(), 30.0)[-1]
    assert np.linalg.norm(end.position_enu_m - [0, 0, 5]) < 0.2
    assert np.linalg.norm(end.velocity_enu_m_s) < 0.02


def test_without_motors_it_falls_and_stays_down():
    states = fly(Quadcopter(), hovering(2.0), None, 3.0)
    assert states[-1].altitude_m == 0.0
    assert not states[-1].velocity_enu_m_s.any()


def test_standing_costs_no_physics_but_the_gusts_go_on():
    craft = Quadcopter(wind=Wind((3.0, 0.0), gust_m_s=2.0))
    parked = craft.parked(4.0, -2.0)
    after = craft.step(parked, None, np.ones(2))
    assert after.body is parked.body
    assert after.gust_m_s.all()


def test_the_same_noise_gives_the_same_flight_and_nobody_elses_random_numbers_are_touched():
    craft = Quadcopter(wind=Wind((2.0, 0.0), gust_m_s=1.0))
    before = np.random.get_state()[1].copy()  # noqa: NPY002  the global state is what must not be drawn from
    first, second = (fly(craft, hovering(), Target((1.0, 0.0, 0.0)), 3.0, np.random.default_rng(7))[-1] for _ in range(2))
    other = fly(craft, hovering(), Target((1.0, 0.0, 0.0)), 3.0, np.random.default_rng(8))[-1]
    assert all(np.array_equal(first.body[key], second.body[key]) for key in first.body)
    assert not np.array_equal(first.position_enu_m, other.position_enu_m)
    assert np.array_equal(before, np.random.get_state()[1])  # noqa: NPY002


def test_one_cheap_step_is_close_to_a_fine_integration():
    """Starts, turns and stops over 6 s: a millimetre apart at most."""
    legs = [((1.2, 0.0, 0.0), 2.0), ((0.0, 1.2, 0.3), 2.0), ((0.0, 0.0, 0.0), 2.0)]
    ends = []
    for frame in (airframe.Airframe(), FineAirframe()):
        state = hovering()
        track = []
        for velocity, seconds in legs:
            states = fly(Quadcopter(airframe=frame), state, Target(velocity), seconds)
            state = states[-1]
            track += [s.position_enu_m for s in states]
        ends.append(np.array(track))
    assert np.abs(ends[0] - ends[1]).max() < 0.001


def test_gusts_have_the_asked_deviation_and_memory():
    wind, rng = Wind((0.0, 0.0), gust_m_s=1.5), np.random.default_rng(3)
    gusts = [np.zeros(2)]
    for _ in range(100_000):
        gusts.append(wind.next_gust(gusts[-1], rng.standard_normal(2), STEP_S))
    settled = np.array(gusts[1000:])
    lag = round(CORRELATION_S / STEP_S)
    kept = np.mean(settled[lag:] * settled[:-lag], axis=0) / settled.var(axis=0)
    np.testing.assert_allclose(settled.std(axis=0), 1.5, rtol=0.1)
    np.testing.assert_allclose(kept, math.exp(-1), atol=0.08)
