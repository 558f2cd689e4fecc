"""ArduCopter's manners in GUIDED, message by message, in simulated time and without a socket."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.sim.modes import Mode
from support.sim_companion import (
    ACCEPTED,
    ARM,
    ATTITUDE,
    BATTERY,
    DENIED,
    EKF,
    EXTENDED,
    FAILED,
    GLOBAL,
    GPS,
    INTERVAL,
    LAND,
    LOCAL_POSITION,
    POSITION_ONLY,
    REQUEST,
    RTL,
    SET_MODE,
    SYS_STATUS,
    TAKEOFF,
    UNSUPPORTED,
    VELOCITY_ONLY,
    VERSION,
    WITH_YAW_RATE,
    Companion,
    of,
)

NAN = math.nan


# -- before flight ---------------------------------------------------------------------------
def test_by_default_it_sends_heartbeats_and_nothing_else():
    sent = Companion().run(10.0)
    assert {message.get_type() for message in sent} == {'HEARTBEAT'}
    assert len(sent) == 11  # one at boot, then every second
    assert (sent[0].autopilot, sent[0].type, sent[0].custom_mode) == (3, 2, 0)


def test_readiness_takes_its_time_and_position_comes_before_it():
    companion = Companion(ready_after_s=10.0)
    for message_id in (LOCAL_POSITION, EKF, SYS_STATUS):
        assert companion.command(INTERVAL, message_id, 100_000) == ACCEPTED
    early, middle, late = companion.run(5.0), companion.run(3.9), companion.run(2.0)
    assert not of(early, 'LOCAL_POSITION_NED')
    assert of(middle, 'LOCAL_POSITION_NED')
    assert all(report.flags & 0x80 for report in of(early + middle, 'EKF_STATUS_REPORT'))
    assert of(late, 'EKF_STATUS_REPORT')[-1].flags == 0x33F
    last = [of(sent, 'SYS_STATUS')[-1].onboard_control_sensors_health for sent in (middle, late)]
    assert [bool(health & 0x10000000) for health in last] == [False, True]


def test_arming_and_takeoff_before_readiness_are_refused_in_words():
    companion = Companion(ready_after_s=42.0)
    assert companion.command(SET_MODE, 1, 4) == ACCEPTED
    assert companion.command(ARM, 1) == FAILED
    assert companion.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 5) == FAILED
    assert [text.split(':')[0] for text in companion.texts()] == ['Arm', 'Takeoff']
    assert not companion.vehicle.armed


@pytest.mark.parametrize('message_id', [LOCAL_POSITION, ATTITUDE, EKF, EXTENDED, SYS_STATUS, BATTERY, GPS, GLOBAL])
def test_messages_come_at_the_interval_that_was_asked_and_stop(message_id):
    companion = Companion()
    companion.run(3.0)
    assert companion.command(INTERVAL, message_id, 100_000) == ACCEPTED
    sent = [message for message in companion.run(2.0) if message.get_msgId() == message_id]
    assert len(sent) == 20
    stamps = [message.time_boot_ms for message in sent if hasattr(message, 'time_boot_ms')]
    assert set(np.diff(stamps)) <= set(range(98, 103))
    assert companion.command(INTERVAL, message_id, -1) == ACCEPTED
    assert {message.get_type() for message in companion.run(2.0)} == {'HEARTBEAT'}


def test_unknown_messages_and_commands_are_refused():
    companion = Companion()
    assert companion.command(INTERVAL, 9999, 100_000) == FAILED
    assert companion.command(REQUEST, 9999) == FAILED
    assert companion.command(INTERVAL, LOCAL_POSITION, NAN) == DENIED
    assert companion.command(INTERVAL, NAN, 1e5) == FAILED
    assert companion.command(31_000) == UNSUPPORTED
    assert companion.command(ARM, 0.5) == DENIED


def test_another_system_or_component_gets_no_answer_at_all():
    companion = Companion(system_id=7)
    assert companion.command(ARM, 1, to=1) is None
    assert companion.command(ARM, 1, to=7, component=42) is None
    assert companion.command(ARM, 1, to=7) == FAILED


def test_every_mode_that_is_simulated_is_taken_and_others_are_refused():
    companion = Companion()
    for mode in Mode:
        assert companion.command(SET_MODE, 1, mode) == ACCEPTED
        assert companion.vehicle.mode is mode
    assert [companion.command(SET_MODE, 1, number) for number in (3, 99)] == [FAILED, FAILED]
    for flags, number in ((0, 4), (NAN, 4), (1, NAN), (1, math.inf)):
        assert companion.command(SET_MODE, flags, number) == DENIED
    assert companion.vehicle.mode is Mode.BRAKE


def test_set_mode_message_is_acknowledged_and_seen_in_a_heartbeat_a_moment_later():
    companion = Companion()
    replies = companion.say(mavlink.MAVLink_set_mode_message(1, 1, 4))
    assert [(ack.command, ack.result) for ack in of(replies, 'COMMAND_ACK')] == [(11, ACCEPTED)]
    assert of(companion.run(0.1), 'HEARTBEAT')[0].custom_mode == 4


def test_command_int_works_like_command_long():
    companion = Companion().guided()
    message = mavlink.MAVLink_command_int_message(1, 1, 0, ARM, 0, 0, 1.0, 0.0, 0.0, 0.0, 0, 0, 0.0)
    assert of(companion.say(message), 'COMMAND_ACK')[0].result == ACCEPTED
    assert companion.vehicle.armed


def test_the_armed_bit_follows_the_ack_within_a_second():
    companion = Companion().guided()
    companion.run(1.0)
    replies_before = len(companion.heard)
    assert companion.command(ARM, 1) == ACCEPTED
    assert not of(companion.heard[replies_before:], 'HEARTBEAT')
    assert of(companion.run(1.0), 'HEARTBEAT')[-1].base_mode & 128


@pytest.mark.parametrize('mode', [Mode.LAND, Mode.RTL, Mode.BRAKE])
def test_some_modes_cannot_be_armed_in(mode):
    companion = Companion().guided()
    companion.command(SET_MODE, 1, mode)
    assert companion.command(ARM, 1) == FAILED
    assert mode.name in companion.texts()[-1]


def test_armed_and_idle_it_disarms_itself_after_ten_seconds():
    companion = Companion().guided()
    companion.command(ARM, 1)
    companion.run(9.8)
    assert companion.vehicle.armed
    assert companion.command(ARM, 1) == ACCEPTED  # again is fine, and does not start the ten seconds anew
    companion.run(0.4)
    assert not companion.vehicle.armed


# -- take-off and landing --------------------------------------------------------------------
def test_takeoff_to_five_metres_and_landing_take_as_long_as_seen_on_sitl():
    companion = Companion().guided()
    companion.command(ARM, 1)
    companion.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 5)
    start = companion.vehicle.now_s
    while companion.altitude < 4.9:
        companion.run(0.025)
    assert companion.vehicle.now_s - start == pytest.approx(7.3, abs=0.3)
    companion.run(5.0)
    assert companion.command(LAND) == ACCEPTED
    start = companion.vehicle.now_s
    while companion.vehicle.armed:
        companion.run(0.025)
    assert companion.vehicle.now_s - start == pytest.approx(12.6, abs=0.5)
    assert companion.altitude == 0.0
    assert companion.texts()[-1] == 'Disarming motors'


def test_takeoff_needs_guided_arming_ground_and_an_altitude():
    companion = Companion()
    companion.run(2.5)
    takeoff = (TAKEOFF, 0, 0, 0, 0, 0, 0, 5)
    assert companion.command(*takeoff) == FAILED
    companion.command(SET_MODE, 1, 4)
    assert companion.command(*takeoff) == FAILED
    companion.command(ARM, 1)
    assert [companion.command(TAKEOFF, 0, 0, 0, 0, 0, 0, altitude) for altitude in (NAN, 0, -3, math.inf)] == [FAILED] * 4
    assert companion.command(*takeoff) == ACCEPTED
    companion.run(10.0)
    assert companion.command(*takeoff) == FAILED
    assert companion.command(ARM, 1) == ACCEPTED
    assert companion.command(ARM, 0) == FAILED


def test_landed_state_tells_the_phase():
    companion = Companion().guided()
    companion.command(INTERVAL, EXTENDED, 100_000)
    companion.command(ARM, 1)
    companion.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 5)
    sent = companion.run(10.0)
    companion.command(LAND)
    phases = [message.landed_state for message in of(sent + companion.run(14.0), 'EXTENDED_SYS_STATE')]
    assert [phase for i, phase in enumerate(phases) if i == 0 or phase != phases[i - 1]] == [1, 3, 2, 4, 1]


def test_setpoints_during_takeoff_cancel_it_and_it_disarms():
    companion = Companion().guided()
    companion.command(ARM, 1)
    companion.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 5)
    companion.run(9.5, 0, 0, 0)
    assert companion.altitude == 0.0
    companion.run(1.0, 0, 0, 0)
    assert not companion.vehicle.armed


@pytest.mark.parametrize('state', ['disarmed', 'on the ground', 'other mode'])
def test_setpoints_are_ignored_without_a_word(state):
    companion = Companion().guided()
    if state == 'on the ground':
        companion.command(ARM, 1)
    if state == 'other mode':
        companion = Companion().flying()
        companion.command(SET_MODE, 1, Mode.LOITER)
    start = companion.ned
    heard = len(companion.heard)
    companion.run(3.0, 1, 0, -1)
    assert companion.ned == pytest.approx(start, abs=0.05)
    assert not of(companion.heard[heard:], 'STATUSTEXT')


def test_velocity_down_to_the_ground_lands_and_disarms():
    companion = Companion().flying()
    companion.run(30.0, 0, 0, 0.5)
    assert companion.altitude == 0.0
    assert not companion.vehicle.armed


def test_return_climbs_comes_home_and_lands():
    companion = Companion(start_east_m=3.0, start_north_m=-2.0).flying()
    companion.run(10.0, 2, 0, 0)
    assert companion.command(RTL) == ACCEPTED
    heights = []
    for _ in range(160):
        companion.run(0.5)
        heights.append(companion.altitude)
    assert max(heights) == pytest.approx(15.0, abs=0.6)
    assert companion.ned == pytest.approx((-2.0, 3.0, 0.0), abs=0.5)
    assert not companion.vehicle.armed


def test_forced_disarming_in_the_air_lets_it_fall():
    companion = Companion().flying()
    assert companion.command(ARM, 0, 21196) == ACCEPTED
    companion.run(4.0)
    assert companion.altitude == 0.0
    assert not companion.vehicle.airborne


# -- setpoints -------------------------------------------------------------------------------
def test_a_velocity_in_ned_goes_north_and_east():
    companion = Companion().flying()
    companion.run(5.0, 1.0, 0.5, 0.0)
    north, east, down = companion.ned
    assert (north, east) == pytest.approx((4.6, 2.3), abs=0.4)
    assert down == pytest.approx(-5.0, abs=0.1)


def test_without_setpoints_it_brakes_after_three_seconds_and_stays_guided_and_armed():
    companion = Companion().flying()
    companion.run(6.0, 2.0, 0.0, 0.0)
    north = companion.ned[0]
    companion.run(2.9)
    assert companion.speed == pytest.approx(2.0, abs=0.05)
    companion.run(2.5)
    assert companion.speed < 0.1
    assert companion.ned[0] - north == pytest.approx(7.6, abs=0.3)
    assert (companion.vehicle.armed, companion.vehicle.mode) == (True, Mode.GUIDED)


@pytest.mark.parametrize('bad', [
    {'vx': NAN}, {'vz': math.inf}, {'mask': 0xFFF}, {'frame': 3}, {'frame': 250}, {'yaw_rate': NAN},
    {'mask': 0x0038 | 0x05C7}, {'mask': POSITION_ONLY, 'x': NAN},
])
def test_what_it_does_not_understand_makes_it_stop_without_a_word(bad):
    companion = Companion().flying()
    companion.run(4.0, 2.0, 0.0, 0.0)
    heard = len(companion.heard)
    companion.run(2.5, 2.0, 0.0, 0.0, **bad)
    assert companion.speed < 0.1
    assert not of(companion.heard[heard:], 'STATUSTEXT')


def heading_ned(companion: Companion) -> float:
    companion.command(REQUEST, ATTITUDE)
    return of(companion.heard, 'ATTITUDE')[-1].yaw


def test_the_nose_turns_to_the_travel_direction_only_when_yaw_is_left_open():
    free, fixed = Companion().flying(), Companion().flying()
    free.run(4.0, 0.0, 1.0, 0.0, mask=VELOCITY_ONLY)
    fixed.run(4.0, 0.0, 1.0, 0.0, mask=WITH_YAW_RATE)
    assert heading_ned(free) == pytest.approx(math.pi / 2, abs=0.05)
    assert heading_ned(fixed) == pytest.approx(0.0, abs=0.05)


def test_yaw_rate_turns_clockwise_from_above_and_yaw_points_the_nose():
    companion = Companion().flying()
    companion.run(2.0, 0.0, 0.0, 0.0, yaw_rate=0.5)
    assert heading_ned(companion) == pytest.approx(1.0, abs=0.15)
    companion.run(4.0, 0.0, 0.0, 0.0, mask=0x09C7, yaw=-1.0)
    assert heading_ned(companion) == pytest.approx(-1.0, abs=0.03)


def test_a_position_is_flown_to_and_does_not_time_out():
    companion = Companion().flying()
    companion.setpoint(mask=POSITION_ONLY, x=6.0, y=-4.0, z=-8.0)
    companion.run(20.0)
    assert companion.ned == pytest.approx((6.0, -4.0, -8.0), abs=0.15)


def test_body_frame_velocity_goes_where_the_nose_points():
    companion = Companion().flying()
    companion.run(4.0, 0.0, 0.0, 0.0, mask=0x09C7, yaw=math.pi / 2)
    companion.run(4.0, 1.0, 0.0, 0.0, frame=8)
    north, east, _ = companion.ned
    assert east > 3.0
    assert abs(north) < 0.2


def test_speed_saturates_at_the_parameter():
    companion = Companion(max_speed_m_s=4.0).flying()
    companion.run(6.0, 100.0, 0.0, 0.0)
    assert companion.speed == pytest.approx(4.0, abs=0.2)


def test_another_mode_stops_and_holds():
    companion = Companion().flying()
    companion.run(4.0, 2.0, 0.0, 0.0)
    companion.command(SET_MODE, 1, Mode.BRAKE)
    companion.run(3.0, 2.0, 0.0, 0.0)
    assert companion.speed < 0.05
    assert companion.altitude == pytest.approx(5.0, abs=0.15)


# -- the rest --------------------------------------------------------------------------------
def test_a_battery_runs_down_in_the_air_and_then_it_lands():
    companion = Companion(battery_s=20.0)
    companion.command(INTERVAL, SYS_STATUS, 100_000)
    companion.command(INTERVAL, BATTERY, 100_000)
    companion.flying()
    sent = companion.run(30.0, 0, 0, 0)
    status = of(sent, 'SYS_STATUS')
    remaining = [message.battery_remaining for message in status]
    assert remaining == sorted(remaining, reverse=True)
    assert remaining[-1] == 0
    assert status[0].voltage_battery > status[-1].voltage_battery > 9000
    assert of(sent, 'BATTERY_STATUS')[-1].battery_remaining == 0
    assert (companion.vehicle.mode, companion.vehicle.armed) == (Mode.LAND, False)
    assert any('Battery' in text for text in companion.texts())
    companion.command(SET_MODE, 1, 4)
    assert companion.command(ARM, 1) == FAILED


def test_parameters_are_read_listed_and_set_within_their_range():
    companion = Companion(guided_timeout_s=2.0)
    read = companion.say(mavlink.MAVLink_param_request_read_message(1, 1, b'GUID_TIMEOUT', -1))
    assert [(value.param_id, value.param_value) for value in read] == [('GUID_TIMEOUT', 2.0)]
    assert companion.say(mavlink.MAVLink_param_request_read_message(1, 1, b'NO_SUCH', -1)) == []
    everything = companion.say(mavlink.MAVLink_param_request_list_message(1, 1))
    assert 'FS_GCS_ENABLE' in {value.param_id for value in everything}
    assert [value.param_index for value in everything] == list(range(everything[0].param_count))
    for wanted, counts in ((1.0, 1.0), (NAN, 1.0), (1e9, 1.0)):
        answer = companion.say(mavlink.MAVLink_param_set_message(1, 1, b'GUID_TIMEOUT', wanted, 9))
        assert answer[0].param_value == counts


@pytest.mark.parametrize(('option', 'mode'), [(0, Mode.GUIDED), (1, Mode.RTL), (5, Mode.LAND)])
def test_a_lost_ground_station_brings_it_home_if_so_set(option, mode):
    companion = Companion().flying()
    companion.say(mavlink.MAVLink_param_set_message(1, 1, b'FS_GCS_ENABLE', option, 9))
    companion.say(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), source=(255, 190))
    companion.run(4.9, 0, 0, 0)
    assert companion.vehicle.mode is Mode.GUIDED
    companion.run(0.4, 0, 0, 0)
    assert companion.vehicle.mode is mode
    companion.say(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), source=(255, 190))
    companion.run(1.0, 0, 0, 0)
    assert companion.vehicle.mode is mode


def test_version_and_time_are_told_on_request():
    companion = Companion()
    companion.run(1.0)
    assert companion.command(REQUEST, VERSION) == ACCEPTED
    assert of(companion.heard, 'AUTOPILOT_VERSION')
    (reply,) = companion.say(mavlink.MAVLink_timesync_message(0, 123))
    assert (reply.tc1, reply.ts1) == (1_000_000_000, 123)
    assert companion.say(mavlink.MAVLink_timesync_message(5, 123)) == []


def test_global_position_agrees_with_the_local_one():
    companion = Companion(start_east_m=30.0, start_north_m=50.0)
    companion.run(3.0)
    companion.command(REQUEST, GLOBAL)
    here = of(companion.heard, 'GLOBAL_POSITION_INT')[-1]
    origin = Companion()
    origin.run(3.0)
    origin.command(REQUEST, GLOBAL)
    there = of(origin.heard, 'GLOBAL_POSITION_INT')[-1]
    metres = math.radians(1e-7) * 6_378_137
    assert (here.lat - there.lat) * metres == pytest.approx(50.0, abs=0.1)
    assert (here.lon - there.lon) * metres * math.cos(math.radians(there.lat / 1e7)) == pytest.approx(30.0, abs=0.1)


@pytest.mark.parametrize('values', [
    {'wind_east_m_s': 30.0, 'gust_m_s': 20.0},
    {'step_s': 0.05, 'wind_north_m_s': -30.0},
    {'step_s': 0.05, 'acceleration_m_s2': 30.0},
    {'acceleration_m_s2': 0.1, 'max_speed_m_s': 0.1},
])
def test_the_ends_of_the_parameters_ranges_stay_finite(values):
    companion = Companion(**values).guided()
    companion.command(ARM, 1)
    companion.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 5)
    companion.run(10.0)
    companion.run(5.0, 50.0, 0.0, -5.0)
    assert all(np.isfinite(part).all() for part in companion.vehicle.state.body.values())
    assert np.abs(companion.vehicle.state.velocity_enu_m_s).max() < 100.0


def test_prearm_checks_say_what_is_missing_and_are_never_armed_by():
    companion = Companion(ready_after_s=10.0)
    assert companion.command(401) == ACCEPTED
    assert companion.texts() == ['PreArm: still waiting for a satellite fix']
    companion.run(11.0)
    companion.heard.clear()
    assert companion.command(401) == ACCEPTED
    assert not companion.texts()
    assert not companion.vehicle.armed
