"""The companion's side of ArduPilot, in simulated time against a scripted copter, through real frames."""

from __future__ import annotations

import pytest

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.messages import dialect
from advise_ros.mavlink.requests import Goal
from support.companion_flight import Flight
from support.scripted import GUIDED, LAND, REFUSAL, RTL, ScriptedCopter


def test_takes_off_without_any_setpoint_until_the_altitude_is_reached() -> None:
    flight = Flight(ScriptedCopter())
    flight.until(lambda: flight.status.ready)
    request = flight.ask(Goal.TAKEOFF)
    while not flight.status.commandable:
        assert flight.companion.setpoint((0.0, 0.0, 0.0), 0.0, flight.now_s) is None
        flight.tick()
    assert flight.copter.altitude_m >= 2.7
    assert request.reply is not None and request.reply.accepted
    setpoint = flight.companion.setpoint((1.0, 2.0, 3.0), 0.25, flight.now_s)
    assert (setpoint.vx, setpoint.vy, setpoint.vz, setpoint.yaw_rate) == (2.0, 1.0, -3.0, -0.25)
    assert (setpoint.type_mask, setpoint.coordinate_frame) == (0x05C7, 1)


def test_asks_for_the_messages_that_a_real_autopilot_does_not_send_by_itself() -> None:
    flight = Flight(ScriptedCopter(), pose_rate_hz=10.0)
    flight.run(1.0)
    assert flight.copter.intervals_s[mav.LOCAL_POSITION_NED] == pytest.approx(0.1)
    wanted = {mav.ATTITUDE, mav.EKF_STATUS_REPORT, mav.EXTENDED_SYS_STATE, mav.SYS_STATUS, mav.LOCAL_POSITION_NED}
    assert wanted <= set(flight.copter.intervals_s)
    asked = flight.copter.commands.count(mav.CMD_MESSAGE_INTERVAL)
    flight.run(20.0)
    assert flight.copter.commands.count(mav.CMD_MESSAGE_INTERVAL) == asked  # They arrive: nothing is repeated.


def test_asks_again_for_what_does_not_arrive() -> None:
    flight = Flight(ScriptedCopter(deaf={mav.CMD_MESSAGE_INTERVAL}))
    flight.run(10.0)
    flight.copter.deaf.clear()
    flight.until(lambda: flight.status.ready, 5.0)


def test_sends_one_heartbeat_a_second() -> None:
    flight = Flight(ScriptedCopter())
    flight.run(10.0)
    beats = [m for m in flight.sent if m.get_type() == 'HEARTBEAT']
    assert 9 <= len(beats) <= 11
    assert beats[0].autopilot == 8  # no autopilot


def test_waits_for_readiness_names_what_is_missing_and_then_goes() -> None:
    flight = Flight(ScriptedCopter(ready=False))
    flight.run(2.0)
    request = flight.ask(Goal.TAKEOFF)
    flight.run(1.0)
    assert request.reply is not None and request.reply.accepted
    assert 'EKF position, pre-arm check' in request.reply.message
    assert flight.status.waiting_for == 'EKF position, pre-arm check'
    assert mav.CMD_ARM not in flight.copter.commands
    flight.copter.ready = True
    flight.until(lambda: flight.status.commandable)


def test_gives_up_an_autopilot_that_never_becomes_ready_with_its_text() -> None:
    flight = Flight(ScriptedCopter(ready=False), ready_timeout_s=5.0)
    flight.run(1.0)
    flight.ask(Goal.TAKEOFF)
    flight.deliver([dialect.MAVLink_statustext_message(4, b'PreArm: Compass not calibrated')])
    flight.run(6.0)
    assert flight.status.waiting_for == (
        'another try: take-off given up: not ready after 5 s; still waiting for: EKF position, pre-arm check; '
        'the autopilot says: PreArm: Compass not calibrated'
    )
    flight.copter.ready = True
    flight.run(10.0)
    assert not flight.copter.armed  # Given up is given up.


@pytest.mark.parametrize('goal', [Goal.ARM, Goal.TAKEOFF])
def test_a_refusal_to_arm_is_told_in_the_autopilots_words(goal: Goal) -> None:
    flight = Flight(ScriptedCopter(refuse={mav.CMD_ARM: REFUSAL}))
    flight.until(lambda: flight.status.ready)
    request = flight.ask(goal)
    flight.run(3.0)
    assert request.reply is not None and not request.reply.accepted
    assert REFUSAL in request.reply.message
    assert flight.status.text == REFUSAL
    assert REFUSAL in flight.status.waiting_for


def test_arming_before_readiness_says_what_is_missing() -> None:
    flight = Flight(ScriptedCopter(ready=False, refuse={mav.CMD_ARM: REFUSAL}))
    flight.run(1.0)
    request = flight.ask(Goal.ARM)
    flight.run(1.0)
    assert request.reply is not None
    assert request.reply.message == (
        f'arm refused: failed; the autopilot says: {REFUSAL} (still waiting for: EKF position, pre-arm check)'
    )


def test_a_lost_take_off_ack_is_judged_by_the_state() -> None:
    flight = Flight(ScriptedCopter(lose_acks={mav.CMD_TAKEOFF, mav.CMD_ARM, mav.CMD_SET_MODE}))
    flight.fly()
    assert flight.status.waiting_for == ''


def test_what_is_wrong_with_the_link_is_told_while_nothing_comes_that_was_asked_for() -> None:
    flight = Flight(ScriptedCopter(silent={mav.SYS_STATUS, mav.EKF_STATUS_REPORT}))
    flight.run(1.0)
    flight.companion.step(flight.now_s, 'what it sends is signed')
    assert flight.status.waiting_for == 'EKF position, pre-arm check (what it sends is signed)'
    flight.copter.silent.clear()
    flight.until(lambda: flight.status.ready)
    flight.companion.step(flight.now_s, 'what it sends is signed')
    assert flight.status.waiting_for == ''


def test_silence_is_a_refusal_after_five_tries() -> None:
    flight = Flight(ScriptedCopter(deaf={mav.CMD_ARM}))
    flight.until(lambda: flight.status.ready)
    request = flight.ask(Goal.ARM)
    flight.until(lambda: request.reply is not None, 4.0)
    assert request.reply is not None and request.reply.accepted  # Under way, as nobody has refused so far.
    flight.run(8.0)
    assert flight.copter.commands.count(mav.CMD_ARM) == 5
    assert flight.status.waiting_for == 'another try: arm refused: no answer to 5 commands'


def test_a_mode_that_somebody_else_sets_is_respected_until_take_over_is_asked() -> None:
    flight = Flight(ScriptedCopter())
    flight.fly()
    flight.copter.mode = RTL
    flight.run(1.0)
    modes = flight.copter.commands.count(mav.CMD_SET_MODE)
    flight.run(10.0)
    assert not flight.status.commandable
    assert flight.companion.setpoint((1.0, 0.0, 0.0), 0.0, flight.now_s) is None
    assert flight.status.waiting_for == (
        'mavlink_bridge/take_over: RTL was set by someone else or a failsafe (it is in RTL)'
    )
    assert flight.copter.commands.count(mav.CMD_SET_MODE) == modes
    request = flight.ask(Goal.TAKE_OVER)
    flight.run(1.0)
    assert request.reply == (True, 'taken over; it stands until it is commanded')
    assert flight.status.commandable


def test_a_mode_change_during_take_off_ends_it() -> None:
    flight = Flight(ScriptedCopter())
    flight.until(lambda: flight.status.ready)
    flight.ask(Goal.TAKEOFF)
    flight.until(lambda: flight.copter.altitude_m > 2.0)
    flight.copter.mode, flight.copter.climb_to_m = LAND, None
    flight.run(0.5)
    assert flight.status.waiting_for == (
        'another try: take-off given up: LAND was set by someone else or a failsafe; mavlink_bridge/take_over takes it over')
    flight.until(lambda: not flight.status.armed)
    assert flight.status.waiting_for == 'another try: take-off given up: LAND was set by someone else or a failsafe'


def test_lands_and_stops_commanding_at_once() -> None:
    flight = Flight(ScriptedCopter())
    flight.fly()
    request = flight.ask(Goal.LAND)
    assert not flight.status.commandable
    flight.until(lambda: not flight.status.armed)
    assert request.reply is not None and request.reply.accepted
    assert flight.copter.mode == LAND
    flight.run(0.5)
    assert flight.status.waiting_for == ''


def test_landing_on_the_ground_changes_nothing() -> None:
    flight = Flight(ScriptedCopter())
    flight.until(lambda: flight.status.ready)
    request = flight.ask(Goal.LAND)
    assert request.reply == (True, 'disarmed already')
    flight.run(1.0)
    assert flight.copter.mode == 0


def test_the_link_is_lost_reported_and_comes_back_without_old_goals() -> None:
    flight = Flight(ScriptedCopter(ready=False), heartbeat_timeout_s=2.0)
    flight.run(1.0)
    flight.ask(Goal.TAKEOFF)
    flight.run(1.0)
    flight.cut = True
    flight.run(3.0)
    assert not flight.status.connected
    assert flight.status.waiting_for == 'heartbeat: the link to the autopilot is lost'
    refused = flight.ask(Goal.ARM).reply
    assert refused == (False, 'arm refused: the link to the autopilot is lost')
    flight.cut, flight.copter.ready = False, True
    flight.run(10.0)
    assert flight.status.connected and flight.status.ready
    assert not flight.copter.armed


def test_facts_of_before_a_reboot_are_void() -> None:
    flight = Flight(ScriptedCopter(), heartbeat_timeout_s=3.0)
    flight.run(5.0)
    assert flight.status.ready
    flight.copter = ScriptedCopter(ready=False)
    flight.run(8.0)
    assert not flight.status.ready
    assert flight.status.waiting_for == 'EKF position, pre-arm check'


def test_only_the_chosen_autopilot_counts() -> None:
    flight = Flight(ScriptedCopter(system_id=7))
    ground_station = dialect.MAVLink(None, 255, 190)
    other = dialect.MAVLink(None, 9, 1)
    flight.deliver([dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)], ground_station)
    assert not flight.status.connected
    flight.run(1.0)
    flight.deliver([dialect.MAVLink_heartbeat_message(2, 3, 128, 9, 4, 3)], other)
    assert flight.companion.vehicle.target == (7, 1)
    assert not flight.status.armed


def test_numbers_that_are_not_finite_never_reach_the_position() -> None:
    flight = Flight(ScriptedCopter())
    flight.run(2.0)
    before = flight.companion.vehicle.motion
    flight.deliver([dialect.MAVLink_local_position_ned_message(10**6, float('nan'), 0.0, 0.0, 0.0, 0.0, 0.0)])
    flight.deliver([dialect.MAVLink_local_position_ned_message(10**6, 0.0, 0.0, 0.0, 0.0, float('inf'), 0.0)])
    assert flight.companion.vehicle.motion is before
    assert flight.companion.vehicle.refused_numbers == 2


def test_a_text_in_chunks_is_put_together() -> None:
    flight = Flight(ScriptedCopter())
    flight.run(0.5)
    goes_on = []
    for chunk, part in enumerate((b'x' * 50, b'yz')):
        flight.deliver([dialect.MAVLink_statustext_message(4, part, 3, chunk)])
        goes_on.append(flight.companion.vehicle.text_goes_on)
    assert flight.status.text == 'x' * 50 + 'yz'
    assert goes_on == [True, False]


def test_the_answer_to_somebody_elses_command_does_not_count() -> None:
    flight = Flight(ScriptedCopter(deaf={mav.CMD_ARM}))
    flight.until(lambda: flight.status.ready)
    request = flight.ask(Goal.ARM)
    flight.tick()
    flight.deliver([dialect.MAVLink_command_ack_message(mav.CMD_ARM, mav.ACK_FAILED, 0, 0, 255, 190)])
    flight.run(1.0)
    assert request.reply is None


def test_a_climb_that_stops_short_counts_as_arrived_after_standing_still() -> None:
    flight = Flight(ScriptedCopter())
    flight.until(lambda: flight.status.ready)
    flight.ask(Goal.TAKEOFF, 3.0)
    flight.until(lambda: flight.copter.altitude_m > 2.0)
    flight.copter.climb_to_m = None
    flight.run(1.0)
    assert not flight.status.commandable
    flight.until(lambda: flight.status.commandable, 5.0)


def test_guided_mode_is_named() -> None:
    flight = Flight(ScriptedCopter(mode=GUIDED))
    flight.run(1.0)
    assert (flight.status.autopilot, flight.status.mode) == ('ardupilot', 'GUIDED')


def test_a_vehicle_that_was_taken_stays_taken_when_its_mode_comes_back() -> None:
    flight = Flight(ScriptedCopter())
    flight.fly()
    flight.copter.mode = LAND
    flight.run(1.0)
    flight.copter.mode = GUIDED  # Somebody flies it in GUIDED himself.
    flight.run(3.0)
    assert not flight.status.commandable
    assert flight.status.waiting_for == (
        'mavlink_bridge/take_over: LAND was set by someone else or a failsafe (it is in GUIDED)')
    flight.ask(Goal.TAKE_OVER)
    flight.run(1.0)
    assert flight.status.commandable


def test_a_take_back_that_was_refused_leaves_it_with_the_others() -> None:
    flight = Flight(ScriptedCopter())
    flight.fly()
    flight.copter.mode = RTL
    flight.run(1.0)
    flight.copter.refuse[mav.CMD_SET_MODE] = 'Mode change refused'
    request = flight.ask(Goal.TAKE_OVER)
    flight.run(2.0)
    assert request.reply is not None and not request.reply.accepted
    flight.copter.mode = GUIDED
    flight.run(2.0)
    assert not flight.status.commandable


def test_a_bridge_that_starts_anew_owns_nothing() -> None:
    copter = ScriptedCopter()
    Flight(copter).fly()
    later = Flight(copter)
    later.run(5.0)
    assert (later.status.commandable, later.status.owner) == (False, 'others')
    assert later.status.waiting_for == (
        'mavlink_bridge/take_over: somebody else flies it, or a bridge before this one (it is in GUIDED)')
    before = len(copter.setpoints)
    assert later.ask(Goal.TAKEOFF).reply == (False, (
        'take-off refused: it flies already: somebody else flies it, or a bridge before this one (it is in GUIDED); '
        'mavlink_bridge/take_over takes it over'))
    later.run(1.0)
    assert len(copter.setpoints) == before
    later.ask(Goal.TAKE_OVER)
    later.until(lambda: later.status.commandable)
    assert later.status.owner == 'ours'


def test_take_off_in_our_own_flight_is_refused_and_changes_nothing() -> None:
    flight = Flight(ScriptedCopter())
    flight.until(lambda: flight.status.ready)
    flight.ask(Goal.TAKEOFF)
    flight.until(lambda: flight.copter.altitude_m > 1.0)
    again = flight.ask(Goal.TAKEOFF, 30.0)
    assert again.reply == (False, 'take-off refused: a take-off is under way; it waits for take-off altitude')
    flight.until(lambda: flight.status.commandable)
    assert flight.copter.altitude_m < 4.0
    sent = len(flight.sent)
    assert flight.ask(Goal.TAKEOFF).reply == (False, "take-off refused: it flies already, and is this bridge's")
    assert flight.status.commandable
    flight.run(1.0)
    commands = {m.command for m in flight.sent[sent:] if m.get_type() == 'COMMAND_LONG'}
    assert commands <= {mav.CMD_MESSAGE_INTERVAL}


def test_arming_while_a_take_off_waits_says_what_that_does() -> None:
    flight = Flight(ScriptedCopter(ready=False))
    flight.run(1.0)
    flight.ask(Goal.TAKEOFF)
    assert flight.ask(Goal.ARM).reply == (False, (
        'arm refused: a take-off is under way and arms by itself; it waits for EKF position, pre-arm check'))
    assert flight.ask(Goal.DISARM).reply == (True, 'disarmed already; the take-off is given up')
    flight.copter.ready = True
    flight.run(5.0)
    assert not flight.copter.armed


def test_disarming_in_the_air_is_refused_and_changes_nothing() -> None:
    flight = Flight(ScriptedCopter())
    flight.fly()
    assert flight.ask(Goal.DISARM).reply == (False, 'disarm refused: it is in the air; mavlink_bridge/land lands it')
    assert flight.status.commandable


@pytest.mark.parametrize(('armed', 'why'), [
    (False, 'it is disarmed; mavlink_bridge/takeoff takes off'), (True, 'it does not fly; mavlink_bridge/takeoff takes off'),
])
def test_on_the_ground_nothing_is_taken_over(armed: bool, why: str) -> None:
    flight = Flight(ScriptedCopter(armed=armed, mode=GUIDED))
    flight.run(2.0)
    assert flight.ask(Goal.TAKE_OVER).reply == (False, f'take-over refused: {why}')


def test_a_landing_is_ended_by_take_over_and_by_nothing_else() -> None:
    flight = Flight(ScriptedCopter())
    flight.fly()
    flight.ask(Goal.LAND)
    flight.run(0.5)
    assert flight.ask(Goal.TAKEOFF).reply == (False, 'take-off refused: it is landing; mavlink_bridge/take_over ends that')
    flight.ask(Goal.TAKE_OVER)
    flight.until(lambda: flight.status.commandable)
    assert flight.copter.mode == GUIDED


def test_who_ends_our_landing_has_the_vehicle_in_our_own_mode_too() -> None:
    flight = Flight(ScriptedCopter())
    flight.until(lambda: flight.status.ready)
    flight.ask(Goal.TAKEOFF, 30.0)
    flight.until(lambda: flight.status.commandable)
    flight.ask(Goal.LAND)
    flight.until(lambda: flight.status.mode == 'LAND')
    flight.run(1.0)
    flight.copter.set_mode(GUIDED)
    flight.run(3.0)
    assert (flight.status.commandable, flight.status.owner) == (False, 'others')


def test_a_waiting_take_off_ends_when_somebody_else_takes_off() -> None:
    flight = Flight(ScriptedCopter(ready=False))
    flight.run(1.0)
    flight.ask(Goal.TAKEOFF)
    flight.copter.armed, flight.copter.position_ned[2] = True, -3.0
    flight.run(2.0)
    assert mav.CMD_SET_MODE not in flight.copter.commands
    assert flight.status.owner == 'others'
    assert 'somebody else armed it' in flight.status.waiting_for


@pytest.mark.parametrize('landing', [LAND, RTL])
def test_flies_ten_times_after_landings_of_our_own_and_of_others(landing: int) -> None:
    flight = Flight(ScriptedCopter())
    for attempt in range(10):
        flight.until(lambda: flight.status.ready)
        flight.ask(Goal.TAKEOFF)
        flight.until(lambda: flight.status.commandable)
        if attempt % 2:
            flight.copter.set_mode(landing)
            flight.run(1.0)
        flight.ask(Goal.LAND)
        flight.until(lambda: not flight.status.armed)
    assert flight.copter.commands.count(mav.CMD_TAKEOFF) == 10


def test_a_command_in_progress_is_not_repeated_and_its_end_counts() -> None:
    flight = Flight(ScriptedCopter(deaf={mav.CMD_ARM}))
    flight.until(lambda: flight.status.ready)
    request = flight.ask(Goal.ARM)
    flight.run(0.2)
    flight.deliver([mav.dialect.MAVLink_command_ack_message(mav.CMD_ARM, mav.ACK_IN_PROGRESS)])
    flight.run(10.0)
    assert flight.copter.commands.count(mav.CMD_ARM) == 1
    flight.deliver([mav.dialect.MAVLink_command_ack_message(mav.CMD_ARM, mav.ACK_ACCEPTED)])
    flight.run(0.2)
    assert request.reply is not None and request.reply.accepted
    assert flight.status.waiting_for == ''


@pytest.mark.parametrize('bad', [
    {'x': 1e30}, {'y': -2e5}, {'z': float('inf')}, {'vx': 300.0}, {'vy': float('nan')}, {'vz': -1e9},
])
def test_positions_that_cannot_be_true_are_refused_and_counted(bad: dict[str, float]) -> None:
    flight = Flight(ScriptedCopter())
    flight.until(lambda: flight.status.ready)
    before = flight.companion.vehicle.motion
    fields = {'x': 0.0, 'y': 0.0, 'z': 0.0, 'vx': 0.0, 'vy': 0.0, 'vz': 0.0, **bad}
    flight.deliver([mav.dialect.MAVLink_local_position_ned_message(time_boot_ms=10**6, **fields)])
    assert flight.companion.vehicle.motion == before
    assert flight.companion.vehicle.refused_numbers == 1


def test_positions_that_are_repeated_or_overtaken_are_no_news() -> None:
    flight = Flight(ScriptedCopter())
    flight.until(lambda: flight.status.ready)
    before = flight.companion.vehicle.motion
    assert before is not None
    for late_ms in (0, 400):
        boot_ms = max(0, before.time_boot_ms - late_ms)
        flight.deliver([mav.dialect.MAVLink_local_position_ned_message(boot_ms, 9.0, 9.0, 9.0, 0.0, 0.0, 0.0)])
    assert flight.companion.vehicle.motion == before


def test_a_plane_is_not_flown_as_a_copter() -> None:
    flight = Flight(ScriptedCopter(silent={mav.HEARTBEAT}))
    flight.deliver([mav.dialect.MAVLink_heartbeat_message(1, mav.AUTOPILOT_ARDUPILOT, 0, 4, 4, 3)])
    assert flight.status.waiting_for == 'heartbeat: no autopilot has answered (system 1 is no multicopter (MAV_TYPE 1))'


def test_another_address_with_its_ids_is_a_stranger_until_it_falls_silent() -> None:
    flight = Flight(ScriptedCopter(), heartbeat_timeout_s=1.0)
    here, there = ('10.0.0.1', 1), ('10.0.0.2', 1)
    beat = mav.dialect.MAVLink_heartbeat_message(2, mav.AUTOPILOT_ARDUPILOT, 0, 0, 4, 3)
    beat.pack(mav.dialect.MAVLink(None, 1, 1))
    assert flight.companion.observe(beat, 0.0, here)
    assert not flight.companion.observe(beat, 0.5, there)
    assert flight.companion.vehicle.refused_strangers == 1
    assert flight.companion.observe(beat, 2.0, there)


def test_a_text_without_end_or_with_control_characters_stays_a_line() -> None:
    flight = Flight(ScriptedCopter())
    flight.run(1.0)
    for chunk in range(200):
        flight.deliver([mav.dialect.MAVLink_statustext_message(4, b'\x1b[2J' + b'x' * 46, 7, chunk)])
    assert len(flight.status.text) <= 400
    assert '\x1b' not in flight.status.text
