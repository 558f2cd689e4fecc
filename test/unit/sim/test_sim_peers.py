"""Clocks, echoes of setpoints, several links and the truth: what two peers see of the simulated autopilots."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.mavlink.framing import CHECKSUM, HEADER_V2, Framer
from advise_ros.mavlink.signing import Encoder
from advise_ros.sim.arducopter import ArduCopter
from advise_ros.sim.px4 import SimulatedPx4
from support.sim_companion import ACCEPTED, ARM, FAILED, INTERVAL, LOCAL_POSITION, POSITION_ONLY, REQUEST, Companion, of
from support.sim_px4_companion import NORTH, OFFBOARD, STILL, Px4Companion

TARGET, SYSTEM_TIME, REBOOT = 85, 2, 246
TRUTHS = {Companion: mavlink.MAVLINK_MSG_ID_SIM_STATE, Px4Companion: mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION}
both = pytest.mark.parametrize('kind', [Companion, Px4Companion])


def flying(kind: type[Companion]) -> Any:
    companion = kind()
    return companion.lift() if isinstance(companion, Px4Companion) else companion.flying()


def foreign(companion: Companion, *velocity_ned: float) -> None:
    """Another companion's setpoint."""
    fields = [0, 1, 1, 1, 0x05C7, 0, 0, 0, *velocity_ned, 0, 0, 0, 0, 0]
    companion.say(mavlink.MAVLink_set_position_target_local_ned_message(*fields), source=(1, 192))


# -- clocks ------------------------------------------------------------------------------------
@both
def test_timesync_is_answered_with_the_time_since_boot_whoever_asks(kind):
    companion = kind()
    for stamp in (1, 2**40):
        (reply,) = companion.say(mavlink.MAVLink_timesync_message(0, stamp))
        assert (reply.tc1, reply.ts1) == (companion.vehicle.now_ns, stamp)
    assert companion.say(mavlink.MAVLink_timesync_message(7, 1)) == []


def test_px4_answers_timesync_with_the_askers_ids_behind_the_times_and_arducopter_with_the_times_alone():
    """What this dialect does not know of the message is on the wire all the same."""
    ends = []
    for kind in (Companion, Px4Companion):
        (reply,) = kind().say(mavlink.MAVLink_timesync_message(0, 2**62), source=(1, 191))
        frame = Encoder(1, 1).frame(reply)
        (read,) = Framer().datagram(frame)
        assert (read.get_type(), read.tc1, read.ts1) == ('TIMESYNC', reply.tc1, 2**62)
        ends.append(frame[HEADER_V2 + 16:-CHECKSUM])
    assert ends == [b'', bytes([1, 191])]


def test_px4_asks_for_our_time_ten_times_a_second_and_arducopter_never():
    asked = [message for message in Px4Companion().run(5.0, *STILL) if message.get_type() == 'TIMESYNC']
    assert [message.tc1 for message in asked] == [0] * 50
    assert set(np.diff([message.ts1 for message in asked])) == {100_000_000}
    companion = Companion()
    companion.command(ARM, 1)
    assert not of(companion.run(5.0), 'TIMESYNC')


@both
def test_stamps_step_unevenly_and_never_backwards_nor_past_the_simulated_time(kind):
    companion = kind()
    assert companion.command(INTERVAL, LOCAL_POSITION, 50_000) == ACCEPTED
    stamps = [message.time_boot_ms for message in of(companion.run(10.0), 'LOCAL_POSITION_NED')]
    steps = set(np.diff(stamps))
    assert len(steps) > 1
    assert steps <= set(range(48, 53))
    assert stamps[-1] <= companion.vehicle.now_ns / 1e6
    if kind is Px4Companion:
        assert all(stamp % 4 == 0 for stamp in stamps)


@both
def test_system_time_goes_with_the_time_since_boot(kind):
    companion = kind()
    assert companion.command(INTERVAL, SYSTEM_TIME, 100_000) == ACCEPTED
    told = of(companion.run(2.0), 'SYSTEM_TIME')
    assert len(told) == 20
    unix = (told[-1].time_unix_usec - told[0].time_unix_usec) / 1000
    assert unix == pytest.approx(told[-1].time_boot_ms - told[0].time_boot_ms, abs=5)


@both
def test_a_reboot_sets_the_clock_to_zero_and_forgets_the_streams_but_not_the_parameters(kind):
    companion = kind()
    name = 'FENCE_ALT_MAX' if kind is Companion else 'GF_MAX_VER_DIST'
    companion.say(mavlink.MAVLink_param_set_message(1, 1, name.encode(), 20.0, mavlink.MAV_PARAM_TYPE_REAL32))
    assert companion.command(INTERVAL, LOCAL_POSITION, 50_000) == ACCEPTED
    assert of(companion.run(5.0), 'LOCAL_POSITION_NED')
    assert companion.command(REBOOT, 1) == ACCEPTED
    sent = companion.run(5.0)
    assert companion.vehicle.now_s == pytest.approx(5.0, abs=0.03)
    assert not of(sent, 'LOCAL_POSITION_NED')
    assert companion.vehicle.fence.height_m == (20.0 if kind is Px4Companion else np.inf)


def test_armed_it_does_not_reboot():
    companion = Companion().flying()
    assert companion.command(REBOOT, 1) == FAILED
    assert companion.vehicle.now_s > 10.0


# -- whose setpoints ---------------------------------------------------------------------------
@both
def test_the_target_that_is_flown_is_shown_a_moment_later_to_the_last_digit(kind):
    companion = flying(kind)
    assert companion.command(INTERVAL, TARGET, 50_000) == ACCEPTED
    companion.run(2.0, *STILL)
    told = of(companion.run(2.0, 0.123456, -0.654321, 0.1), 'POSITION_TARGET_LOCAL_NED')
    shown = [(message.vx, message.vy, message.vz) for message in told]
    assert shown[0] == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    assert all(values == pytest.approx((0.123456, -0.654321, 0.1), abs=1e-6) for values in shown[3:])


@both
@pytest.mark.parametrize('every', [2, 4, 20])
def test_a_second_companions_setpoints_show(kind, every):
    companion = flying(kind)
    assert companion.command(INTERVAL, TARGET, 50_000) == ACCEPTED
    companion.run(1.0, *NORTH)
    alien = 0
    for turn in range(60):
        companion.setpoint(*NORTH)
        sent = companion.run(0.025)
        if turn % (every // 2) == 0:
            foreign(companion, 0.0, 0.7, 0.0)
        sent += companion.run(0.025)
        alien += sum(abs(message.vy - 0.7) < 1e-6 for message in of(sent, 'POSITION_TARGET_LOCAL_NED'))
    assert alien >= 3


def test_without_others_the_target_is_never_another_one():
    companion = Companion().flying()
    assert companion.command(INTERVAL, TARGET, 50_000) == ACCEPTED
    companion.run(1.0, *NORTH)
    told = of(companion.run(10.0, *NORTH), 'POSITION_TARGET_LOCAL_NED')
    assert len(told) == 200
    assert {(message.vx, message.vy) for message in told} == {(1.0, 0.0)}


def test_a_position_is_shown_as_one_and_in_another_mode_nothing_is_shown():
    companion = Companion().flying()
    assert companion.command(INTERVAL, TARGET, 50_000) == ACCEPTED
    companion.setpoint(mask=POSITION_ONLY, x=1.0, y=2.0, z=-6.0)
    told = of(companion.run(1.0), 'POSITION_TARGET_LOCAL_NED')[-1]
    assert (told.x, told.y, told.z, told.type_mask & 0x3F) == (1.0, 2.0, -6.0, 0x38)
    companion.command(176, 1, 5)
    companion.run(0.1)
    assert not of(companion.run(1.0), 'POSITION_TARGET_LOCAL_NED')


# -- the truth and several links -----------------------------------------------------------------
@both
def test_the_true_position_is_given_on_request(kind):
    companion = kind(start_east_m=3.0, start_north_m=4.0)
    companion.run(1.0)
    assert companion.command(REQUEST, TRUTHS[kind]) == ACCEPTED
    here = next(message for message in reversed(companion.heard) if message.get_msgId() == TRUTHS[kind])
    latitude = here.lat_int if kind is Companion else here.lat
    assert (latitude / 1e7 - 47.397742) * 111_319.5 == pytest.approx(4.0, abs=0.02)


@pytest.mark.parametrize('dialect', [ArduCopter, SimulatedPx4])
def test_each_link_has_its_own_rates_and_gets_its_own_answers(dialect):
    companion = Companion(dialect=dialect)
    autopilot = companion.autopilot
    second = autopilot.add_channel()
    ask = mavlink.MAVLink_command_long_message(1, 1, INTERVAL, 0, LOCAL_POSITION, 100_000, 0, 0, 0, 0, 0)
    station = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    message = mavlink.MAVLink(None).decode(bytearray(ask.pack(station)))
    assert [reply.get_type() for reply in autopilot.receive(message, second)] == ['COMMAND_ACK']
    sent: list[list[Any]] = [[], []]
    for _ in range(200):
        for number, messages in enumerate(autopilot.step_all()):
            sent[number] += messages
    assert not of(sent[0], 'LOCAL_POSITION_NED')
    assert len(of(sent[1], 'LOCAL_POSITION_NED')) > 20
    assert all(of(messages, 'HEARTBEAT') for messages in sent)


def test_a_mode_that_one_peer_sets_shows_to_the_other_in_the_next_message():
    companion = Companion()
    second = companion.autopilot.add_channel()
    companion.run(0.3)
    companion.command(176, 1, 5)
    beats = of(companion.autopilot.step_all()[second], 'HEARTBEAT')
    assert [beat.custom_mode for beat in beats] == [5]


def test_px4s_texts_go_to_the_link_where_the_ground_station_lives():
    companion = Px4Companion(ready_after_s=100.0)
    autopilot = companion.autopilot
    second = autopilot.add_channel()
    beat = mavlink.MAVLink(None).decode(bytearray(
        mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(mavlink.MAVLink(None, srcSystem=255, srcComponent=190)),
    ))
    autopilot.receive(beat, second)
    companion.vehicle.say('to whom it may concern')
    first, other = autopilot.step_all()
    assert not of(first, 'STATUSTEXT')
    assert of(other, 'STATUSTEXT')


def test_offboard_is_left_to_whoever_streams():
    """The vehicle flies between two companions; only the target shows it."""
    companion = Px4Companion().lift()
    for _ in range(40):
        companion.setpoint(*NORTH)
        companion.run(0.05)
        foreign(companion, -1.0, 0.0, 0.0)
        companion.run(0.05)
    assert companion.vehicle.mode == OFFBOARD[0] << 16
    assert companion.speed < 0.6
