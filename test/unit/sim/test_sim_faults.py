"""Satellites that mislead or fail, and the autopilots' own fences, as measured on SITL and SIH."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.sim.estimator import Wander
from advise_ros.sim.modes import Mode, Px4Mode
from advise_ros.sim.satellites import ArduPilotFilter, Px4Filter
from support.sim_companion import ACCEPTED, ARM, EKF, FAILED, GPS, INTERVAL, POSITION_ONLY, REQUEST, RTL, Companion, of
from support.sim_px4_companion import STILL, UP, Px4Companion

ESTIMATOR_STATUS, ODOMETRY = 230, 331
STEP_S = 0.05
# Degrees of latitude.
SHIFTS_DEG = {5.5: 0.00005, 11.0: 0.0001, 33.0: 0.0003}


def set_parameter(companion: Companion, name: str, value: float) -> None:
    (told,) = companion.say(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, mavlink.MAV_PARAM_TYPE_REAL32))
    assert told.param_value == pytest.approx(value)


def report(companion: Companion, message_id: int) -> Any:
    assert companion.command(REQUEST, message_id) == ACCEPTED
    return next(message for message in reversed(companion.heard) if message.get_msgId() == message_id)


def true_north(companion: Companion) -> float:
    return float(companion.vehicle.state.position_enu_m[1])


@pytest.mark.parametrize('name', ['SIM_GPS1_GLTCH_X', 'SIM_GPS_GLITCH_X'])
@pytest.mark.parametrize('shift_m', SHIFTS_DEG)
def test_a_shift_of_the_satellites_shows_at_once_in_variance_and_fix_and_after_10_s_in_the_position(name, shift_m):
    companion = Companion().flying()
    before = report(companion, GPS).lat
    set_parameter(companion, name, SHIFTS_DEG[shift_m])
    companion.run(0.1, *STILL)
    assert (report(companion, GPS).lat - before) / 1e7 == pytest.approx(SHIFTS_DEG[shift_m], rel=0.01)
    assert report(companion, EKF).pos_horiz_variance == pytest.approx(0.27 * shift_m, rel=0.1)
    assert report(companion, EKF).flags == 0x33F
    companion.run(1.3, *STILL)
    assert report(companion, EKF).flags & 0x8000
    assert companion.texts()[-1] == 'GPS Glitch or Compass error'
    companion.run(8.4, *STILL)
    assert companion.ned[0] == pytest.approx(0.0, abs=0.05)
    companion.run(0.3, *STILL)
    assert companion.ned[0] == pytest.approx(shift_m, rel=0.03)
    assert companion.vehicle.mode is Mode.GUIDED
    companion.run(9.0, *STILL)
    assert report(companion, EKF).flags & 0x8000
    companion.run(2.0, *STILL)
    assert report(companion, EKF).flags == 0x33F
    assert true_north(companion) == pytest.approx(0.0, abs=0.05)


def test_after_the_jump_a_position_truly_flies_the_shift_away():
    companion = Companion().flying()
    companion.setpoint(mask=POSITION_ONLY, z=-5.0)
    set_parameter(companion, 'SIM_GPS1_GLTCH_X', 0.0001)
    companion.run(9.8)
    assert true_north(companion) == pytest.approx(0.0, abs=0.1)
    companion.run(9.0)
    assert true_north(companion) == pytest.approx(-11.1, abs=0.5)


def test_a_glitch_of_three_seconds_never_reaches_the_position():
    companion = Companion().flying()
    set_parameter(companion, 'SIM_GPS1_GLTCH_Y', 0.0002)
    companion.run(3.0, *STILL)
    set_parameter(companion, 'SIM_GPS1_GLTCH_Y', 0.0)
    companion.run(15.0, *STILL)
    assert companion.ned[:2] == pytest.approx((0.0, 0.0), abs=0.05)
    assert report(companion, EKF).flags == 0x33F


def test_the_flags_fall_before_most_jumps():
    fell = 0
    for seed in range(40):
        filter_, seen = ArduPilotFilter(np.random.default_rng(seed), STEP_S), set()
        while filter_.jump_m is None:
            filter_.step((0.0, 11.0), satellites=True)
            seen.add(filter_.flags)
        fell += 0x8027 in seen
    assert 15 <= fell <= 33  # 8 of 13


@pytest.mark.parametrize(('name', 'value'), [('SIM_GPS1_ENABLE', 0.0), ('SIM_GPS_DISABLE', 1.0)])
def test_without_satellites_it_lands_and_positions_end(name, value):
    companion = Companion().flying()
    assert companion.command(INTERVAL, 32, 100_000) == ACCEPTED
    set_parameter(companion, name, value)
    companion.run(0.1, *STILL)
    assert report(companion, GPS).fix_type < 3
    companion.run(6.4, *STILL)
    assert report(companion, EKF).flags == 0x33F
    companion.run(0.4, *STILL)
    assert report(companion, EKF).flags == 0x025
    assert companion.vehicle.mode is Mode.GUIDED
    companion.run(0.9, *STILL)
    assert companion.vehicle.mode is Mode.LAND
    assert of(companion.run(6.5), 'LOCAL_POSITION_NED')
    companion.run(1.0)
    assert not of(companion.run(3.0), 'LOCAL_POSITION_NED')
    assert 3.0 < math.hypot(*companion.vehicle.state.position_enu_m[:2]) < 10.0
    companion.run(10.0)
    assert not companion.vehicle.armed
    companion.command(176, 1, 4)
    assert companion.command(ARM, 1) == FAILED
    set_parameter(companion, name, 1.0 - value)
    companion.run(3.0)
    assert companion.command(ARM, 1) == ACCEPTED


# -- PX4 ---------------------------------------------------------------------------------------
def blind(seconds: float = 14.0, drift_m_s: float = 0.0, seed: int = 0) -> Px4Companion:
    companion = Px4Companion(drift_m_s=drift_m_s, seed=seed).lift()
    companion.run(5.0, *UP)
    companion.set('SIM_GPS_USED', 0)
    companion.run(seconds, *STILL)
    return companion


def test_px4_says_that_it_stands_still_on_the_ground_and_no_longer_in_the_air():
    companion = Px4Companion()
    companion.run(5.0)
    assert report(companion, ESTIMATOR_STATUS).flags == 0x3FF
    companion.lift()
    assert report(companion, ESTIMATOR_STATUS).flags == 0x37F


def test_px4_without_satellites_lands_after_five_seconds():
    companion = blind(5.0)
    assert report(companion, GPS).fix_type < 3
    assert (report(companion, ESTIMATOR_STATUS).flags, companion.mode) == (0x37F, Px4Mode.OFFBOARD)
    companion.run(0.3, *STILL)
    assert (report(companion, ESTIMATOR_STATUS).flags, companion.mode) == (0x365, Px4Mode.LAND)
    assert companion.vehicle.intended is Px4Mode.OFFBOARD


def test_with_the_stream_on_px4_comes_back_to_offboard_and_takes_off_again_from_the_ground():
    companion = blind(5.5)
    while not companion.vehicle.state.touches_ground:
        companion.run(0.2, *UP)
    companion.set('SIM_GPS_USED', 10)
    companion.run(1.6, *UP)
    assert companion.mode is Px4Mode.LAND
    companion.run(5.0, *UP)
    assert companion.mode is Px4Mode.OFFBOARD
    assert companion.altitude > 1.0


def test_on_return_the_position_jumps_with_a_count_or_slides_without_one():
    jumps, slides, counts = [], [], set()
    for seed in range(20):
        rng = np.random.default_rng(seed)
        filter_ = Px4Filter(Wander(0.0, rng, STEP_S), rng, STEP_S)
        for _ in range(round(14.0 / STEP_S)):
            filter_.step(satellites=False)
        off_m, slid_m = float(np.hypot(*filter_.position_m[:2])), 0.0
        for _ in range(round(2.0 / STEP_S)):
            before = filter_.position_m
            filter_.step(satellites=True)
            if filter_.jump_m is None:
                slid_m += float(np.hypot(*(filter_.position_m - before)[:2]))
            else:
                jumps.append(float(np.hypot(*filter_.jump_m[:2])))
                assert filter_.resets == 1
        slides.append(slid_m)
        counts.add(filter_.resets)
        assert 9.0 < off_m < 30.0
        assert np.hypot(*filter_.position_m[:2]) < 0.01
    assert max(jumps) > 9.0
    assert sum(slid_m > 5.0 for slid_m in slides) > 4
    assert sum(slid_m < 2.0 for slid_m in slides) > 4


def test_odometry_counts_the_jump_in_the_message_that_has_it():
    companion = blind()
    assert companion.command(INTERVAL, ODOMETRY, 25_000) == ACCEPTED
    companion.set('SIM_GPS_USED', 10)
    told = of(companion.run(3.0, *STILL), 'ODOMETRY')
    steps = [(math.hypot(b.x - a.x, b.y - a.y), b.reset_counter - a.reset_counter) for a, b in itertools.pairwise(told)]
    assert sum(count for _, count in steps) == 1
    assert max(steps)[1] == 1


# -- fences and returns --------------------------------------------------------------------------
def highest(companion: Companion, seconds: float) -> float:
    top = 0.0
    for _ in range(round(seconds)):
        companion.run(1.0)
        top = max(top, companion.altitude)
    return top


@pytest.mark.parametrize(('fenced', 'height_m'), [(0.0, 15.0), (1.0, 8.0)])
def test_arducopters_return_climbs_no_higher_than_its_fence(fenced, height_m):
    companion = Companion().flying()
    companion.run(8.0, 2, 0, 0)
    set_parameter(companion, 'FENCE_ALT_MAX', 10.0)
    set_parameter(companion, 'FENCE_ENABLE', fenced)
    assert companion.command(RTL) == ACCEPTED
    assert highest(companion, 25.0) == pytest.approx(height_m, abs=0.9)


def test_close_to_home_a_return_climbs_by_the_slope():
    companion = Companion().flying()
    companion.setpoint(mask=POSITION_ONLY, x=3.0, z=-5.0)
    companion.run(8.0)
    assert companion.command(RTL) == ACCEPTED
    assert highest(companion, 15.0) == pytest.approx(9.3, abs=0.6)


def test_arducopter_returns_at_its_fence_and_ignores_positions_beyond_it():
    companion = Companion().flying()
    set_parameter(companion, 'FENCE_ALT_MAX', 10.0)
    set_parameter(companion, 'FENCE_ENABLE', 1.0)
    companion.setpoint(mask=POSITION_ONLY, z=-12.0)
    companion.run(5.0)
    assert companion.altitude == pytest.approx(5.0, abs=0.2)
    companion.run(8.0, 0, 0, -1)
    assert companion.vehicle.mode is Mode.RTL
    assert 'Fence Breached' in companion.texts()


def test_px4s_return_climbs_thirty_metres_and_a_lower_fence_keeps_it_from_coming_home():
    free, fenced = Px4Companion(), Px4Companion()
    fenced.set_real('GF_MAX_VER_DIST', 8.0)
    for companion in (free, fenced):
        companion.lift()
        companion.run(2.0, 1.0, 0.0, 0.0)
        assert companion.ask_mode((4, 5)) == ACCEPTED
    assert highest(free, 20.0) == pytest.approx(30.0, abs=0.8)
    assert 8.0 < highest(fenced, 20.0) < 12.0
    companion = fenced
    assert companion.mode is Px4Mode.LOITER
    companion.run(20.0)
    assert companion.vehicle.armed


def test_px4_holds_at_its_fence_under_a_running_stream_and_takes_offboard_outside_of_it():
    companion = Px4Companion()
    companion.set_real('GF_MAX_HOR_DIST', 4.0)
    companion.lift()
    companion.run(12.0, 1.0, 0.0, 0.0)
    assert companion.mode is Px4Mode.LOITER
    assert companion.ned[0] < 6.0
    assert companion.ask_mode((6, 0)) == ACCEPTED
    companion.run(1.0, -1.0, 0.0, 0.0)
    assert companion.mode is Px4Mode.OFFBOARD
