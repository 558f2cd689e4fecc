"""PX4 on SIH wanders where only velocity is commanded, and keeps near a position; ArduCopter stands."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from advise_ros.sim.estimator import Wander
from support.sim_companion import ACCEPTED, ARM, LAND, POSITION_ONLY, Companion
from support.sim_px4_companion import LOITER_MODE, STILL, Px4Companion

NO_POSITION = 0x0DC7
POSITION_AND_YAW_RATE, POSITION_AND_YAW, WITH_VELOCITY, ALTITUDE_AND_VELOCITY = 0x05F8, 0x09F8, 0x0DC0, 0x0DE3


def estimated(companion: Companion) -> np.ndarray:
    return companion.vehicle.state.estimated_position_enu_m.copy()


def hovering(seed: int = 1, drift_m_s: float = 0.3) -> Px4Companion:
    companion = Px4Companion(seed=seed, drift_m_s=drift_m_s).lift()
    companion.run(3.0, *STILL)
    return companion


def farthest(companion: Companion, seconds: float, true: bool = False, **setpoint: Any) -> float:
    """Metres in plan from where it is now; zero velocity is streamed, or what is given."""
    start, most = true_or_estimated(companion, true), 0.0
    for _ in range(round(seconds / 0.5)):
        companion.run(0.5, *(() if setpoint.get('silent') else STILL), **{k: v for k, v in setpoint.items() if k != 'silent'})
        most = max(most, math.hypot(*(true_or_estimated(companion, true) - start)[:2]))
    return most


def true_or_estimated(companion: Companion, true: bool) -> np.ndarray:
    return companion.vehicle.state.position_enu_m.copy() if true else estimated(companion)


def at(position_enu_m: np.ndarray, mask: int = POSITION_ONLY, **parts: float) -> dict[str, Any]:
    east, north, up = (float(part) for part in position_enu_m)
    return {'mask': mask, 'x': north, 'y': east, 'z': -up, **parts}


def test_zero_velocity_wanders_off_by_metres_within_a_minute_and_the_telemetry_says_it_stands():
    companion = hovering()
    assert 3.0 < farthest(companion, 60.0, mask=NO_POSITION) < 14.0
    assert np.linalg.norm(companion.vehicle.state.estimated_velocity_enu_m_s[:2]) < 0.4


@pytest.mark.parametrize('mask', [POSITION_ONLY, WITH_VELOCITY])
def test_a_position_is_held_within_a_metre_by_its_own_estimate_and_two_in_truth(mask):
    companion = hovering()
    companion.run(4.0, **at(start := estimated(companion), mask))
    assert 0.2 < farthest(companion, 60.0, **at(start, mask)) < 1.3
    assert abs(companion.vehicle.state.position_enu_m - start)[:2].max() < 2.2


def test_loiter_holds_its_place():
    companion = hovering()
    assert companion.ask_mode(LOITER_MODE) == ACCEPTED
    companion.run(4.0)
    assert 0.2 < farthest(companion, 60.0, silent=True) < 1.6


def test_an_altitude_beside_a_velocity_holds_the_height_alone():
    companion = hovering()
    start = estimated(companion)
    assert farthest(companion, 60.0, mask=ALTITUDE_AND_VELOCITY, z=-start[2]) > 2.5
    assert estimated(companion)[2] == pytest.approx(start[2], abs=0.8)


def test_the_estimate_moves_on_the_ground_too():
    companion = Px4Companion(drift_m_s=0.3)
    seen = []
    for _ in range(60):
        companion.run(1.0)
        seen.append(companion.ned)
    assert np.ptp(seen, axis=0).min() > 0.3
    assert companion.vehicle.state.position_enu_m.tolist() == [0.0, 0.0, 0.0]


def test_it_stands_beside_its_place_after_a_climb_by_velocity():
    off = []
    for seed in range(4):
        companion = hovering(seed)
        off.append(float(np.hypot(*estimated(companion)[:2])))
    assert max(off) > 0.7


def test_without_drift_it_stands():
    companion = hovering(drift_m_s=0.0)
    assert farthest(companion, 30.0) < 0.01


def test_the_errors_are_those_seen_on_sih():
    wander, seen = Wander(0.3, np.random.default_rng(3), 0.05), []
    for _ in range(40_000):
        wander.step()
        seen.append([*wander.velocity_m_s, *wander.position_m])
    std = np.std(seen, axis=0)
    assert math.hypot(*std[:2]) == pytest.approx(0.3, rel=0.15)
    assert math.hypot(*std[3:5]) == pytest.approx(0.27, rel=0.2)
    assert std[5] > 0.5  # The barometer


def test_arducopter_stands_within_five_centimetres():
    companion = Companion().flying()
    companion.run(2.0, *STILL)
    start = companion.ned
    companion.run(60.0, *STILL)
    assert companion.ned == pytest.approx(start, abs=0.05)


def test_a_few_landings_are_not_noticed_for_half_a_minute_where_the_height_drifts():
    vehicle = Px4Companion(drift_m_s=0.3).vehicle
    missed = sum(vehicle.landing_takes_s() > 25.0 for _ in range(2000))
    assert 20 < missed < 100  # 2 of 69
    companion = Px4Companion(drift_m_s=0.3).lift()
    companion.vehicle.landing_takes_s = lambda: 30.0
    assert companion.command(LAND, *[math.nan] * 7) == ACCEPTED
    while not companion.vehicle.state.touches_ground:
        companion.run(0.5)
    companion.run(25.0)
    assert companion.vehicle.armed
    companion.run(10.0)
    assert not companion.vehicle.armed
    assert not any(Px4Companion(drift_m_s=0.0).vehicle.landing_takes_s() > 25.0 for _ in range(50))


# -- position setpoints ------------------------------------------------------------------------
def flown_to(companion: Px4Companion, distance_m: float, mask: int = POSITION_ONLY, **parts: float) -> tuple[float, float]:
    """Fly north; gives the fastest speed and how far past the target it went, m/s and m."""
    start = estimated(companion)
    fastest = furthest = 0.0
    for _ in range(60):
        companion.run(0.2, **at(start + np.array([0.0, distance_m, 0.0]), mask, **parts))
        fastest, furthest = max(fastest, companion.speed), max(furthest, float((estimated(companion) - start)[1]))
    return fastest, furthest - distance_m


@pytest.mark.parametrize('mask', [POSITION_ONLY, POSITION_AND_YAW_RATE, POSITION_AND_YAW, WITH_VELOCITY])
def test_a_position_is_flown_to_in_every_mask_that_names_one(mask):
    companion = hovering(drift_m_s=0.0)
    target = estimated(companion) + np.array([1.0, 2.0, 1.0])
    companion.run(10.0, **at(target, mask))
    assert companion.vehicle.state.position_enu_m == pytest.approx(target, abs=0.1)


@pytest.mark.parametrize(('distance_m', 'slow', 'fast'), [(3.0, 1.4, 2.1), (8.0, 3.9, 5.0)])
def test_a_position_step_is_flown_as_fast_as_the_loops_will(distance_m, slow, fast):
    fastest, over_m = flown_to(hovering(drift_m_s=0.0), distance_m)
    assert slow < fastest < fast
    assert 0.05 < over_m < 0.9


def test_only_mpc_xy_vel_max_bounds_a_position_step_and_it_drags_others_down_for_good():
    companion = hovering(drift_m_s=0.0)
    companion.set_real('MPC_XY_CRUISE', 0.5)
    assert flown_to(companion, 3.0)[0] > 1.4
    companion.set_real('MPC_XY_CRUISE', 5.0)
    companion.set_real('MPC_XY_VEL_MAX', 1.0)
    assert companion.real('MPC_XY_CRUISE') == companion.real('MPC_VEL_MANUAL') == 1.0
    assert flown_to(companion, 3.0)[0] <= 1.1
    companion.set_real('MPC_XY_VEL_MAX', 12.0)
    assert companion.real('MPC_XY_CRUISE') == companion.real('MPC_VEL_MANUAL') == 1.0


def test_a_velocity_beside_a_position_is_added():
    companion = hovering(drift_m_s=0.0)
    fastest, over_m = flown_to(companion, 3.0, WITH_VELOCITY, vx=0.5)
    assert fastest > 1.8
    assert 0.4 < over_m < 1.6
    _, over_m = flown_to(companion, 3.0, WITH_VELOCITY, vx=-1.0)
    assert -1.7 < over_m < -0.8


def test_zero_velocity_coasts_before_it_stands():
    companion = hovering(drift_m_s=0.0)
    companion.run(5.0, 1.235, 0.0, 0.0)
    assert companion.speed == pytest.approx(1.0, abs=0.1)
    start = estimated(companion)
    companion.run(6.0, *STILL)
    assert 0.5 < float((estimated(companion) - start)[1]) < 1.8


def test_any_setpoint_even_a_far_one_lets_it_arm_and_one_above_it_takes_off():
    companion = Px4Companion()
    companion.run(1.0, mask=POSITION_ONLY, x=50.0, y=50.0, z=-50.0)
    assert companion.ask_mode((6, 0)) == ACCEPTED
    assert companion.command(ARM, 1) == ACCEPTED
    companion.run(8.0, mask=POSITION_ONLY, z=-2.5)
    assert companion.altitude == pytest.approx(2.5, abs=0.3)


# -- ArduCopter --------------------------------------------------------------------------------
@pytest.mark.parametrize(('speed_m_s', 'on_m'), [(1.0, 0.73), (2.0, 1.70)])
def test_arducopter_stops_as_far_on_as_seen(speed_m_s, on_m):
    companion = Companion().flying()
    companion.run(6.0, speed_m_s, 0.0, 0.0)
    start = companion.ned[0]
    companion.run(4.0, *STILL)
    assert companion.ned[0] - start == pytest.approx(on_m, abs=0.15)


@pytest.mark.parametrize(('distance_m', 'fastest_m_s', 'there_s'), [(3.0, 1.8, 3.7), (10.0, 3.8, 7.5), (40.0, 7.7, 12.7)])
def test_arducopter_flies_to_a_position_as_fast_as_seen(distance_m, fastest_m_s, there_s):
    companion = Companion().flying()
    begun, fastest, there = companion.vehicle.now_s, 0.0, 0.0
    companion.setpoint(mask=POSITION_ONLY, x=distance_m, z=-5.0)
    while companion.vehicle.now_s < begun + 20.0:
        companion.run(0.1)
        fastest = max(fastest, companion.speed)
        if companion.speed > 0.15:
            there = companion.vehicle.now_s - begun
    assert fastest == pytest.approx(fastest_m_s, rel=0.15)
    assert there == pytest.approx(there_s, abs=1.5)
    assert companion.ned[0] == pytest.approx(distance_m, abs=0.3)
