"""PX4's manners in OFFBOARD, fact by fact, in simulated time and without a socket."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.sim.geography import ORIGIN_ALTITUDE_M
from advise_ros.sim.modes import Px4Mode
from support.sim_companion import (
    ACCEPTED,
    ARM,
    DENIED,
    EKF,
    FAILED,
    INTERVAL,
    LAND,
    LOCAL_POSITION,
    REJECTED,
    REQUEST,
    SET_MODE,
    SYS_STATUS,
    TAKEOFF,
    VELOCITY_ONLY,
    WITH_YAW_RATE,
    of,
)
from support.sim_px4_companion import LAND_MODE, LOITER_MODE, NORTH, OFFBOARD, POSCTL, RTL_MODE, STILL, UP, Px4Companion

NAN, INF = math.nan, math.inf


# -- link and readiness ----------------------------------------------------------------------
def test_its_heartbeat_is_px4s_at_one_hertz_whatever_is_asked():
    companion = Px4Companion()
    assert companion.command(INTERVAL, 0, 50_000) == FAILED
    beats = of(companion.run(5.0), 'HEARTBEAT')
    assert len(beats) == 5
    assert (beats[0].autopilot, beats[0].type, beats[0].custom_mode) == (12, 2, 0x03040000)


def test_a_new_mode_is_told_by_the_next_heartbeat_and_no_sooner():
    companion = Px4Companion()
    companion.run(0.3)
    assert companion.ask_mode(RTL_MODE) == ACCEPTED
    assert not of(companion.run(0.5), 'HEARTBEAT')
    assert [m.custom_mode for m in of(companion.run(0.5), 'HEARTBEAT')] == [int(Px4Mode.RTL)]


def test_messages_of_ardupilot_alone_are_unknown():
    assert Px4Companion().command(INTERVAL, EKF, 100_000) == FAILED
    assert Px4Companion().command(INTERVAL, LOCAL_POSITION, 100_000) == ACCEPTED


def test_before_readiness_arming_is_temporarily_rejected():
    companion = Px4Companion(ready_after_s=10.0)
    assert companion.command(INTERVAL, SYS_STATUS, 100_000) == ACCEPTED
    assert companion.command(ARM, 1) == REJECTED
    assert not of(companion.run(1.0), 'SYS_STATUS')[-1].onboard_control_sensors_health & 0x10000000
    assert of(companion.run(8.0), 'SYS_STATUS')[-1].onboard_control_sensors_health & 0x10000000
    assert companion.command(ARM, 1) == ACCEPTED


def test_texts_go_to_ground_stations_only_and_in_chunks():
    companion = Px4Companion(ready_after_s=100.0)
    assert companion.command(ARM, 1) == REJECTED
    companion.say(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
    assert companion.command(ARM, 1) == REJECTED
    assert not companion.texts()
    companion.call_ground_station()
    assert companion.command(ARM, 1) == REJECTED
    assert companion.texts() == ['Arming denied: Resolve system health failures firs', 't']
    parts = of(companion.heard, 'STATUSTEXT')
    assert len({part.id for part in parts}) == 1
    assert [part.chunk_seq for part in parts] == [0, 1]


@pytest.mark.parametrize(('number', 'params'), [
    (SET_MODE, (1, 6, 0, 1)), (ARM, (1, 0, 1)), (TAKEOFF, (0, 1, 0, NAN, NAN, NAN, NAN)),
])
def test_unused_parameters_that_are_not_zero_are_denied(number, params):
    assert Px4Companion().command(number, *params) == DENIED


def test_a_wrong_target_gets_no_answer_and_its_setpoints_no_ear():
    companion = Px4Companion()
    assert companion.command(ARM, 1, to=9) is None
    fields = (0, 9, 1, 1, WITH_YAW_RATE, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0)
    for _ in range(20):
        companion.say(mavlink.MAVLink_set_position_target_local_ned_message(*fields))
    assert not companion.vehicle.streaming


# -- OFFBOARD --------------------------------------------------------------------------------
def test_the_sequence_that_works_lifts_off_after_two_seconds():
    companion = Px4Companion()
    companion.run(1.0, *STILL)
    assert companion.ask_mode(OFFBOARD) == ACCEPTED
    assert companion.command(ARM, 1) == ACCEPTED
    companion.run(1.5, *UP)
    assert companion.altitude == pytest.approx(0.0, abs=0.01)
    companion.run(3.0, *UP)
    assert companion.altitude > 0.3
    assert companion.mode is Px4Mode.OFFBOARD


def test_offboard_without_a_stream_is_accepted_while_disarmed_and_then_it_does_not_arm():
    companion = Px4Companion()
    assert companion.ask_mode(OFFBOARD) == ACCEPTED
    assert companion.command(ARM, 1) == REJECTED
    assert not companion.vehicle.armed


def test_offboard_without_a_stream_is_rejected_in_flight():
    companion = Px4Companion().lift()
    assert companion.ask_mode(LOITER_MODE) == ACCEPTED
    companion.run(3.0)
    assert companion.ask_mode(OFFBOARD) == REJECTED
    assert companion.mode is Px4Mode.LOITER


@pytest.mark.parametrize(('action', 'mode'), [(0, Px4Mode.RTL), (4, Px4Mode.LAND), (5, Px4Mode.LOITER)])
def test_when_the_stream_stops_offboard_is_left_after_a_second_and_comes_back_by_itself(action, mode):
    companion = Px4Companion()
    companion.set('COM_OBL_RC_ACT', action)
    companion.lift()
    companion.run(0.9)
    assert companion.mode is Px4Mode.OFFBOARD
    companion.run(0.3)
    assert companion.mode is mode
    companion.run(0.2, *STILL)
    assert companion.mode is Px4Mode.OFFBOARD


def test_of_a_failsafe_it_says_that_there_is_one_and_no_reason():
    companion = Px4Companion().lift()
    companion.call_ground_station()
    companion.run(1.5)
    assert companion.mode is Px4Mode.RTL
    assert companion.texts() == ['Failsafe activated']


def test_the_last_velocity_is_flown_until_offboard_is_left():
    companion = Px4Companion(drift_m_s=0.0).lift()
    companion.run(4.0, *NORTH)
    north = companion.ned[0]
    companion.run(0.9)
    assert companion.ned[0] - north > 0.6


def test_a_mode_that_somebody_commanded_is_kept_under_a_running_stream():
    companion = Px4Companion(drift_m_s=0.0).lift()
    assert companion.ask_mode(LOITER_MODE) == ACCEPTED
    companion.run(5.0, *NORTH)
    assert companion.mode is Px4Mode.LOITER
    assert companion.speed < 0.1


@pytest.mark.parametrize(('rate_hz', 'stays'), [(2.0, True), (3.0, True), (0.5, False)])
def test_two_hertz_keep_it_alive(rate_hz, stays):
    companion = Px4Companion().lift()
    seen = set()
    for _ in range(round(6.0 * rate_hz)):
        companion.setpoint(*STILL)
        companion.run(1.0 / rate_hz)
        seen.add(companion.mode)
    assert (seen == {Px4Mode.OFFBOARD}) is stays


# -- setpoints -------------------------------------------------------------------------------
def test_one_metre_a_second_asked_gives_less():
    companion = Px4Companion(drift_m_s=0.0).lift()
    companion.run(6.0, *NORTH)
    assert companion.vehicle.state.velocity_enu_m_s[1] == pytest.approx(0.81, abs=0.05)


@pytest.mark.parametrize(('mask', 'parts', 'turned'), [
    (VELOCITY_ONLY, {}, 0.0), (WITH_YAW_RATE, {'yaw_rate': 0.2}, 0.8), (0x09C7, {'yaw': 0.5}, 0.5),
])
def test_yaw_is_held_turned_or_pointed(mask, parts, turned):
    companion = Px4Companion().lift()
    before = companion.vehicle.state.roll_pitch_yaw_rad[2]
    companion.run(4.0, 0.0, 1.0, 0.0, mask=mask, **parts)
    assert before - companion.vehicle.state.roll_pitch_yaw_rad[2] == pytest.approx(turned, abs=0.1)


def test_all_nan_is_rejected_in_words_and_is_no_proof_of_life():
    companion = Px4Companion().lift()
    companion.call_ground_station()
    companion.run(1.5, NAN, NAN, NAN)
    assert companion.mode is Px4Mode.RTL
    assert any('NaN' in text for text in companion.texts())


def test_one_nan_brakes_and_infinity_changes_nothing():
    companion = Px4Companion(drift_m_s=0.0).lift()
    companion.run(3.0, *NORTH)
    companion.run(0.8, INF, 0.0, 0.0)
    assert companion.speed > 0.6
    companion.run(3.0, NAN, 0.0, 0.0)
    assert companion.speed < 0.1
    assert companion.mode is Px4Mode.OFFBOARD


@pytest.mark.parametrize('frame', [2, 7, 9])
def test_other_frames_count_for_nothing(frame):
    companion = Px4Companion()
    companion.run(1.0, *STILL, frame=frame)
    assert not companion.vehicle.streaming


# -- take-off, landing, disarming --------------------------------------------------------------
def test_take_off_with_nans_climbs_and_loiters():
    companion = Px4Companion()
    assert companion.command(TAKEOFF, 0, 0, 0, NAN, NAN, NAN, NAN) == ACCEPTED
    assert companion.command(ARM, 1) == ACCEPTED
    companion.run(10.0)
    assert companion.altitude == pytest.approx(2.5, abs=0.3)
    assert companion.mode is Px4Mode.LOITER


def test_the_take_off_altitude_is_above_sea_level():
    companion = Px4Companion()
    assert companion.command(TAKEOFF, 0, 0, 0, NAN, NAN, NAN, ORIGIN_ALTITUDE_M + 6.0) == ACCEPTED
    assert companion.command(ARM, 1) == ACCEPTED
    companion.run(15.0)
    assert companion.altitude == pytest.approx(6.0, abs=0.3)


def test_armed_and_idle_it_disarms_after_ten_seconds():
    companion = Px4Companion()
    assert companion.command(ARM, 1) == ACCEPTED
    companion.run(9.0)
    assert companion.vehicle.armed
    companion.run(2.0)
    assert not companion.vehicle.armed


def healthy(companion: Px4Companion) -> bool:
    """The pre-arm bit of SYS_STATUS."""
    assert companion.command(REQUEST, SYS_STATUS) == ACCEPTED
    return bool(of(companion.heard, 'SYS_STATUS')[-1].onboard_control_sensors_health & 0x10000000)


def land(companion: Px4Companion) -> int | None:
    return companion.command(LAND, NAN, NAN, NAN, NAN, NAN, NAN, NAN)


@pytest.mark.parametrize('velocity', [STILL, ()])
@pytest.mark.parametrize('ask', [lambda c: c.ask_mode(LAND_MODE), land])
def test_after_a_landing_out_of_offboard_it_is_disarmed_and_in_offboard_stream_or_no_stream(ask, velocity):
    companion = Px4Companion().lift()
    assert ask(companion) == ACCEPTED
    assert companion.mode is Px4Mode.LAND
    companion.run(20.0, *velocity)
    assert not companion.vehicle.armed
    assert companion.mode is Px4Mode.OFFBOARD


@pytest.mark.parametrize('action', [0, 4])
def test_a_landing_by_a_failsafe_ends_in_offboard_too(action):
    companion = Px4Companion()
    companion.set('COM_OBL_RC_ACT', action)
    companion.lift()
    companion.run(120.0)
    assert not companion.vehicle.armed
    assert companion.mode is Px4Mode.OFFBOARD


def test_a_landing_out_of_another_mode_ends_in_that_mode():
    companion = Px4Companion().lift()
    assert companion.ask_mode(LOITER_MODE) == ACCEPTED
    assert land(companion) == ACCEPTED
    companion.run(20.0)
    assert not companion.vehicle.armed
    assert companion.mode is Px4Mode.LOITER


def test_disarmed_in_offboard_the_checks_before_arming_ask_for_a_stream():
    companion = Px4Companion().lift()
    land(companion)
    companion.run(20.0)
    assert not healthy(companion)
    companion.setpoint(*STILL)
    assert healthy(companion)
    companion.run(0.9)
    assert healthy(companion)
    companion.run(0.2)
    assert not healthy(companion)
    assert companion.ask_mode(LOITER_MODE) == ACCEPTED
    assert healthy(companion)


def test_arming_straight_after_the_first_setpoint_is_refused_and_a_moment_later_taken():
    companion = Px4Companion().lift()
    land(companion)
    companion.run(20.0)
    companion.setpoint(*STILL)
    assert companion.command(ARM, 1) == REJECTED
    companion.run(0.1, *STILL)
    assert companion.command(ARM, 1) == ACCEPTED
    companion.run(6.0, *UP)
    assert companion.altitude > 1.0


def test_a_stream_that_resumes_takes_it_off_again_from_the_ground_after_a_failsafe():
    """Touched down and not yet disarmed: the failsafe ends, OFFBOARD comes back and climbs."""
    companion = Px4Companion()
    companion.set('COM_OBL_RC_ACT', 4)
    companion.lift()
    while not companion.vehicle.state.touches_ground:
        companion.run(0.1)
    assert (companion.mode, companion.vehicle.intended) == (Px4Mode.LAND, Px4Mode.OFFBOARD)
    companion.run(5.0, *UP)
    assert companion.mode is Px4Mode.OFFBOARD
    assert companion.altitude > 1.0


def test_a_landing_that_was_commanded_is_not_ended_by_the_stream():
    companion = Px4Companion().lift()
    land(companion)
    assert companion.vehicle.intended is Px4Mode.LAND
    companion.run(3.0, *UP)
    assert companion.mode is Px4Mode.LAND


def test_disarming_in_the_air_is_refused():
    companion = Px4Companion().lift()
    assert companion.command(ARM, 0) == REJECTED
    assert companion.vehicle.armed


# -- ground station and sticks -----------------------------------------------------------------
def test_with_nav_dll_act_a_missing_ground_station_refuses_arming_and_holds_in_flight():
    companion = Px4Companion()
    companion.set('NAV_DLL_ACT', 2)
    assert companion.command(ARM, 1) == REJECTED
    companion.call_ground_station()
    companion.lift()
    companion.run(5.0, *STILL)
    assert companion.mode is Px4Mode.LOITER


@pytest.mark.parametrize(('excepted', 'mode'), [(0, Px4Mode.LOITER), (4, Px4Mode.OFFBOARD)])
def test_sticks_that_were_seen_once_and_are_lost_drop_offboard_unless_excepted(excepted, mode):
    companion = Px4Companion()
    companion.set('COM_RCL_EXCEPT', excepted)
    companion.lift()
    companion.say(mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0))
    companion.run(0.5, *STILL)
    assert companion.mode is Px4Mode.OFFBOARD
    companion.run(0.5, *STILL)
    assert companion.mode is mode


def test_position_control_without_sticks_is_refused():
    assert Px4Companion().lift().ask_mode(POSCTL) == REJECTED
    assert Px4Companion().ask_mode((9, 9)) == REJECTED
