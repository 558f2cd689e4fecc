"""The companion's side of PX4, in simulated time against a scripted one, through real frames."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.requests import Goal
from support.companion_flight import Flight
from support.scripted_px4 import LAND, LOITER, OFFBOARD, ScriptedPx4


class StreamingFlight(Flight):
    """A flight whose owner keeps the stream alive, as the bridge's timer does."""

    copter: ScriptedPx4

    def tick(self) -> None:
        super().tick()
        setpoint = self.companion.setpoint((0.0, 0.0, 0.0), 0.0, self.now_s)
        if setpoint is not None:
            self.copter.receive(setpoint)


def test_streams_before_offboard_and_climbs_over_where_it_stood() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.until(lambda: flight.status.ready)
    request = flight.ask(Goal.TAKEOFF, 5.0)
    flight.until(lambda: flight.status.commandable)
    assert request.reply is not None and request.reply.accepted
    assert flight.copter.asked_without_stream == 0
    assert flight.copter.altitude_m == pytest.approx(5.0, abs=0.35)
    assert mav.CMD_TAKEOFF not in flight.copter.commands
    assert (flight.status.autopilot, flight.status.mode) == ('px4', 'OFFBOARD')
    on_the_way = [m.type_mask for m in flight.copter.setpoints]
    assert set(on_the_way) == {0x05C7, 0x0DF8}
    assert on_the_way == sorted(on_the_way), 'velocity until it may leave the ground, then a place'


def test_the_stream_never_pauses_in_offboard() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.fly()
    flight.run(30.0)
    assert flight.copter.mode == OFFBOARD
    assert flight.status.commandable


def test_waits_for_readiness_in_words() -> None:
    flight = StreamingFlight(ScriptedPx4(ready=False, silent={mav.LOCAL_POSITION_NED}))
    flight.run(1.0)
    request = flight.ask(Goal.TAKEOFF)
    flight.run(1.0)
    assert request.reply is not None
    assert request.reply.message == 'take-off begins when the autopilot is ready; still waiting for: position, pre-arm check'
    assert not flight.copter.setpoints
    flight.copter.ready = True
    flight.copter.silent.clear()
    flight.until(lambda: flight.status.commandable)


def test_a_mode_of_somebody_elses_ends_the_stream() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.fly()
    flight.copter.set_mode(LOITER)
    flight.run(1.0)
    before = len(flight.copter.setpoints)
    flight.run(10.0)
    assert len(flight.copter.setpoints) == before
    assert 'LOITER was set by someone else or a failsafe' in flight.status.waiting_for
    refused = flight.ask(Goal.TAKEOFF)
    assert refused.reply == (False, (
        'take-off refused: it flies already: LOITER was set by someone else or a failsafe (it is in LOITER); '
        'mavlink_bridge/take_over takes it over'))
    request = flight.ask(Goal.TAKE_OVER)
    flight.until(lambda: flight.status.commandable)
    assert request.reply == (True, 'taken over; it stands until it is commanded')
    assert flight.copter.asked_without_stream == 0


def test_nothing_is_streamed_into_a_flight_of_somebody_elses() -> None:
    copter = ScriptedPx4(mode=OFFBOARD, armed=True, position_ned=[0.0, 0.0, -5.0])
    flight = StreamingFlight(copter)
    for _ in range(100):
        copter.streamed_s = copter.time_s  # Another companion's setpoints.
        flight.run(0.05)
    assert not copter.setpoints
    assert flight.status.waiting_for == (
        'mavlink_bridge/take_over: somebody else flies it, or a bridge before this one (it is in OFFBOARD)')
    assert flight.status.owner == 'others'
    flight.ask(Goal.TAKE_OVER)
    flight.until(lambda: flight.status.commandable)
    assert copter.setpoints


def test_lands_without_a_stream() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.fly()
    flight.ask(Goal.LAND)
    flight.until(lambda: not flight.status.armed)
    before = len(flight.copter.setpoints)
    assert flight.copter.mode == OFFBOARD  # PX4 goes back there.
    flight.run(3.0)
    assert len(flight.copter.setpoints) == before
    assert flight.status.waiting_for == ''


def test_a_refused_arming_is_told() -> None:
    flight = StreamingFlight(ScriptedPx4(refuse={mav.CMD_ARM: 'Arming denied: Resolve system health failures'}))
    flight.until(lambda: flight.status.ready)
    request = flight.ask(Goal.TAKEOFF)
    flight.run(5.0)
    assert request.reply is not None
    assert 'Arming denied: Resolve system health failures' in request.reply.message
    assert not flight.status.armed


def test_leaving_a_flying_vehicle_makes_it_hold() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.fly()
    setpoint, hold = flight.companion.farewell(flight.now_s)
    assert (setpoint.vx, setpoint.vy, setpoint.vz) == (0.0, 0.0, 0.0)
    assert (hold.command, hold.param1, hold.param2, hold.param3) == (mav.CMD_SET_MODE, 1.0, 4.0, 3.0)


def test_a_rest_makes_it_hold_in_a_climb_too_and_only_a_take_over_leads_back() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.until(lambda: flight.status.ready)
    request = flight.ask(Goal.TAKEOFF, 5.0)
    flight.until(lambda: flight.status.in_air)
    setpoint, hold = flight.companion.rest('at rest', flight.now_s)
    assert (setpoint.vz, hold.command, hold.param2, hold.param3) == (0.0, mav.CMD_SET_MODE, 4.0, 3.0)
    flight.copter.set_mode(LOITER)
    before = len(flight.copter.setpoints)
    flight.run(3.0)
    assert request.reply is not None and request.reply.accepted  # It had been, before.
    assert len(flight.copter.setpoints) == before
    assert (flight.status.commandable, flight.status.waiting_for) == (False, 'at rest')
    refused = flight.ask(Goal.TAKEOFF, 5.0)
    assert refused.reply == (False, 'take-off refused: at rest')
    flight.companion.resume()
    flight.run(1.0)
    assert not flight.status.commandable
    assert 'the bridge was deactivated' in flight.status.waiting_for
    flight.ask(Goal.TAKE_OVER)
    flight.until(lambda: flight.status.commandable)


def test_a_landing_goes_on_at_rest() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.fly()
    flight.companion.rest('at rest', flight.now_s)
    flight.ask(Goal.LAND)
    flight.until(lambda: not flight.status.armed)
    assert flight.copter.altitude_m < 0.1


def _land_by_service(flight: StreamingFlight) -> None:
    flight.ask(Goal.LAND)


def _land_by_ground_station(flight: StreamingFlight) -> None:
    flight.copter.set_mode(LAND)


def _land_by_failsafe(flight: StreamingFlight) -> None:
    flight.copter.fail(LAND)


LANDINGS = (_land_by_service, _land_by_ground_station, _land_by_failsafe)


@pytest.mark.parametrize('land', LANDINGS)
def test_flies_ten_times_whoever_lands_it(land: Callable[[StreamingFlight], None]) -> None:
    """Disarmed in OFFBOARD its pre-arm check passes only while setpoints flow, and arming takes a moment of them."""
    flight = StreamingFlight(ScriptedPx4())
    for _ in range(10):
        flight.until(lambda: flight.status.ready)
        request = flight.ask(Goal.TAKEOFF)
        flight.until(lambda: flight.status.commandable)
        assert request.reply is not None and request.reply.accepted
        land(flight)
        flight.until(lambda: not flight.status.armed and flight.status.mode == 'OFFBOARD')
        flight.copter.failsafe = False
    assert flight.copter.asked_without_stream == 0
    assert flight.copter.commands.count(mav.CMD_ARM) == 10


def test_a_pre_arm_check_that_fails_beside_the_stream_is_waited_for_in_offboard_too() -> None:
    copter = ScriptedPx4(ready=False, mode=OFFBOARD)
    flight = StreamingFlight(copter)
    flight.run(3.0)
    assert not copter.setpoints
    flight.ask(Goal.TAKEOFF)
    flight.run(5.0)
    assert copter.setpoints and not copter.armed
    assert flight.status.waiting_for == 'pre-arm check'
    copter.ready = True
    flight.until(lambda: flight.status.commandable)


def test_a_failsafe_that_ends_finds_no_stream_to_come_back_to() -> None:
    """One that lost its satellites landed, came back to OFFBOARD by itself and took off again from the ground."""
    flight = StreamingFlight(ScriptedPx4())
    flight.fly()
    flight.copter.fail(LAND)
    flight.run(1.0)
    assert flight.status.failsafe == 'LAND'
    assert (flight.status.owner, flight.status.commandable) == ('others', False)
    assert 'the failsafe "LAND" has it (it is in LAND)' in flight.status.waiting_for
    before = len(flight.copter.setpoints)
    flight.run(0.5)
    flight.copter.recover()
    flight.run(20.0)
    assert flight.copter.mode != OFFBOARD or not flight.copter.armed
    assert len(flight.copter.setpoints) == before


def test_the_stream_ends_within_two_tenths_where_the_mode_is_told_at_once() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.fly()
    flight.copter.fail(LAND)
    flight.run(0.2)
    assert not flight.status.commandable


def test_an_autopilot_that_does_not_tell_its_mode_at_once_is_asked_three_times_and_watched_by_its_heartbeat() -> None:
    copter = ScriptedPx4(unknown={mav.CURRENT_MODE})
    flight = StreamingFlight(copter)
    flight.fly()
    asked = [m for m in flight.sent if m.get_type() == 'COMMAND_LONG' and m.param1 == mav.CURRENT_MODE]
    assert len(asked) == 3
    copter.fail(LAND)
    flight.run(1.2)
    assert not flight.status.commandable
    assert flight.status.failsafe == 'LAND'  # By the state in the heartbeat.


def test_take_off_in_a_failsafe_names_it_and_take_over_ends_it() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.ask(Goal.TAKEOFF)
    flight.until(lambda: flight.status.ready)
    flight.ask(Goal.TAKEOFF, 40.0)
    flight.until(lambda: flight.status.commandable)
    flight.deliver([mav.dialect.MAVLink_statustext_message(4, b'Failsafe activated: no GPS')])
    flight.copter.fail(LAND)
    flight.run(1.0)
    assert flight.ask(Goal.TAKEOFF).reply == (False, (
        'take-off refused: it flies already: the failsafe "Failsafe activated: no GPS" has it (it is in LAND); '
        'mavlink_bridge/take_over takes it over'))
    flight.copter.failsafe = False
    flight.ask(Goal.TAKE_OVER)
    flight.until(lambda: flight.status.commandable)
    assert (flight.status.owner, flight.status.failsafe) == ('ours', '')


@pytest.mark.parametrize('text', [b'Failsafe activated', b'Failsafe activated\t', b'Failsafe activated: '])
def test_a_failsafe_whose_text_gives_no_reason_goes_by_the_name_of_its_mode(text: bytes) -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.fly()
    flight.deliver([mav.dialect.MAVLink_statustext_message(4, text)])
    flight.copter.fail(LOITER)
    flight.run(1.0)
    assert flight.status.failsafe == 'LOITER'
    flight.copter.fail(LAND)  # After its delay.
    flight.until(lambda: flight.status.failsafe == 'LAND', 2.0)
    flight.until(lambda: flight.status.failsafe != 'LAND')
    assert flight.status.failsafe == ''


def test_calls_itself_a_ground_station_as_texts_go_to_no_one_else() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.run(3.0)
    assert [m.type for m in flight.sent if m.get_msgId() == mav.HEARTBEAT][-1] == 6
