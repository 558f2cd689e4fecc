"""The companion's side of PX4, in simulated time against a scripted one, through real frames."""

from __future__ import annotations

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
    flight.copter.mode, flight.copter.wants_offboard = LOITER, False
    flight.run(1.0)
    before = len(flight.copter.setpoints)
    flight.run(10.0)
    assert len(flight.copter.setpoints) == before
    assert 'LOITER was set by someone else or a failsafe' in flight.status.waiting_for
    request = flight.ask(Goal.TAKEOFF)
    flight.until(lambda: flight.status.commandable)
    assert request.reply is not None and 'in the air already' in request.reply.message


def test_nothing_is_streamed_into_a_flight_of_somebody_elses() -> None:
    copter = ScriptedPx4(mode=OFFBOARD, armed=True, position_ned=[0.0, 0.0, -5.0])
    flight = StreamingFlight(copter)
    for _ in range(100):
        copter.streamed_s = copter.time_s  # Another companion's setpoints.
        flight.run(0.05)
    assert not copter.setpoints
    assert flight.status.waiting_for == (
        'OFFBOARD mode (it is OFFBOARD; somebody else flies it, or a bridge before this one; mavlink_bridge/takeoff takes over)')
    flight.ask(Goal.TAKEOFF)
    flight.until(lambda: flight.status.commandable)
    assert copter.setpoints


def test_lands_without_a_stream() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.fly()
    flight.ask(Goal.LAND)
    flight.until(lambda: not flight.status.armed)
    before = len(flight.copter.setpoints)
    assert flight.copter.mode == LAND
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


def test_a_rest_makes_it_hold_in_a_climb_too_and_only_a_take_off_leads_back() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.until(lambda: flight.status.ready)
    request = flight.ask(Goal.TAKEOFF, 5.0)
    flight.until(lambda: flight.status.in_air)
    setpoint, hold = flight.companion.rest('at rest', flight.now_s)
    assert (setpoint.vz, hold.command, hold.param2, hold.param3) == (0.0, mav.CMD_SET_MODE, 4.0, 3.0)
    flight.copter.mode, flight.copter.wants_offboard = LOITER, False
    before = len(flight.copter.setpoints)
    flight.run(3.0)
    assert request.reply is not None and request.reply.accepted  # It had been, before.
    assert len(flight.copter.setpoints) == before
    assert (flight.status.commandable, flight.status.waiting_for) == (False, 'at rest')
    refused = flight.ask(Goal.TAKEOFF, 5.0)
    assert refused.reply == (False, 'take-off refused: at rest')
    flight.companion.resume()
    flight.copter.mode = OFFBOARD  # Somebody else's.
    flight.run(1.0)
    assert not flight.status.commandable
    assert 'the bridge was deactivated' in flight.status.waiting_for
    flight.ask(Goal.TAKEOFF, 5.0)
    flight.until(lambda: flight.status.commandable)


def test_a_landing_goes_on_at_rest() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.fly()
    flight.companion.rest('at rest', flight.now_s)
    flight.ask(Goal.LAND)
    flight.until(lambda: not flight.status.armed)
    assert flight.copter.mode == LAND


def test_calls_itself_a_ground_station_as_texts_go_to_no_one_else() -> None:
    flight = StreamingFlight(ScriptedPx4())
    flight.run(3.0)
    assert [m.type for m in flight.sent if m.get_msgId() == mav.HEARTBEAT][-1] == 6
