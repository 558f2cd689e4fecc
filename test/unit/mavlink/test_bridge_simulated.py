"""The companion flies the simulator's two dialects in simulated time; both are as strict as the real ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.requests import Goal
from advise_ros.sim.arducopter import ArduCopter
from advise_ros.sim.px4 import SimulatedPx4
from support.simulated_flight import Simulated, SimulatedFlight

LOITER = {ArduCopter: 5, SimulatedPx4: 0x03040000}
DIALECTS = [ArduCopter, SimulatedPx4]
both = pytest.mark.parametrize('dialect', DIALECTS)


@both
def test_takes_off_flies_and_lands(dialect: type[Any]) -> None:
    flight = SimulatedFlight(Simulated(dialect))
    request = flight.ask(Goal.TAKEOFF, 5.0) if flight.until(lambda: flight.status.connected) is None else None
    assert request is not None
    flight.until(lambda: flight.status.commandable)
    assert request.reply is not None and request.reply.accepted
    assert flight.copter.vehicle.state.altitude_m == pytest.approx(5.0, abs=0.5)
    flight.velocity = (1.0, 0.5, 0.0)
    flight.run(6.0)
    east, north, up = (float(part) for part in flight.copter.vehicle.state.position_enu_m)
    assert east == pytest.approx(2.0 * north, abs=0.2)
    assert east > 3.0
    assert up == pytest.approx(5.0, abs=0.5)
    flight.ask(Goal.LAND)
    flight.until(lambda: not flight.copter.vehicle.armed)
    flight.run(2.0)
    assert flight.status.waiting_for == ''
    assert not flight.status.in_air


@both
def test_the_way_there_and_back_is_measured(dialect: type[Any]) -> None:
    flight = SimulatedFlight(Simulated(dialect))
    flight.run(5.0)
    round_trip_s = flight.companion.timesync.round_trip_s(flight.now_s)
    assert round_trip_s is not None and round_trip_s < 0.1


@both
def test_flies_twice(dialect: type[Any]) -> None:
    flight = SimulatedFlight(Simulated(dialect))
    for _ in range(2):
        flight.until(lambda: flight.status.ready)
        flight.ask(Goal.TAKEOFF, 3.0)
        flight.until(lambda: flight.status.commandable)
        flight.ask(Goal.LAND)
        flight.until(lambda: not flight.status.armed)


@both
def test_somebody_elses_mode_is_never_fought(dialect: type[Any]) -> None:
    flight = SimulatedFlight(Simulated(dialect))
    flight.until(lambda: flight.status.ready)
    flight.ask(Goal.TAKEOFF, 4.0)
    flight.until(lambda: flight.status.commandable)
    flight.velocity = (1.0, 0.0, 0.0)
    flight.run(1.0)
    flight.copter.vehicle.set_mode(LOITER[dialect])
    flight.run(20.0)
    assert flight.mode == 'LOITER'
    assert 'LOITER was set by someone else or a failsafe' in flight.status.waiting_for
    request = flight.ask(Goal.TAKE_OVER)
    flight.until(lambda: flight.status.commandable)
    assert request.reply == (True, 'taken over; it stands until it is commanded')


@pytest.mark.parametrize('cut_s', [0.1, 0.8, 5.0, 12.0])
@both
def test_a_lost_link_stops_it_and_no_old_command_is_flown_after(dialect: type[Any], cut_s: float) -> None:
    """ArduPilot brakes and stays; PX4 leaves OFFBOARD, and is not taken back unasked."""
    flight = SimulatedFlight(Simulated(dialect))
    flight.until(lambda: flight.status.ready)
    flight.ask(Goal.TAKEOFF, 4.0)
    flight.until(lambda: flight.status.commandable)
    flight.velocity = (1.0, 0.0, 0.0)
    flight.run(2.0)
    flight.cut = True
    flight.run(cut_s)
    flight.cut, flight.velocity = False, (0.0, 0.0, 0.0)
    flight.run(5.0)
    left_offboard = dialect is SimulatedPx4 and cut_s > 1.0
    assert flight.status.connected
    assert flight.status.commandable is not left_offboard
    assert ('the failsafe "RTL" has it' in flight.status.waiting_for) is left_offboard
    assert float(np.linalg.norm(flight.copter.vehicle.state.velocity_enu_m_s[:2])) < 0.1 or flight.mode == 'RTL'


def test_a_px4_without_stream_is_never_asked_for_offboard() -> None:
    """With the stock wait that freezes its simulation."""
    flight = SimulatedFlight(Simulated(SimulatedPx4))
    asked: list[bool] = []
    receive = flight.copter.receive

    def heard(message: Any) -> list[Any]:
        if message.get_type() == 'COMMAND_LONG' and message.command == 176 and message.param2 == 6:
            asked.append(flight.copter.vehicle.streaming)
        return receive(message)

    flight.copter.receive = heard  # type: ignore[method-assign]
    flight.until(lambda: flight.status.ready)
    flight.ask(Goal.TAKEOFF, 3.0)
    flight.until(lambda: flight.status.commandable)
    assert asked and all(asked)


@both
def test_a_refusal_is_told_in_the_autopilots_words(dialect: type[Any]) -> None:
    flight = SimulatedFlight(Simulated(dialect, ready_after_s=60.0))
    flight.run(2.0)
    request = flight.ask(Goal.ARM)
    flight.until(lambda: request.reply is not None)
    flight.run(6.0)
    words = {
        ArduCopter: 'Arm: still waiting for a satellite fix',
        SimulatedPx4: 'Arming denied: Resolve system health failures first',
    }
    assert words[dialect] in flight.status.text
    assert 'still waiting for' in flight.status.waiting_for


def test_a_ground_station_failsafe_is_left_alone() -> None:
    flight = SimulatedFlight(Simulated(ArduCopter))
    flight.copter.autopilot._parameters.set('FS_GCS_ENABLE', 1.0)
    flight.until(lambda: flight.status.ready)
    flight.ask(Goal.TAKEOFF, 4.0)
    flight.until(lambda: flight.status.commandable)
    flight.copter.autopilot._failsafe.heartbeat(flight.copter.vehicle.now_s)  # type: ignore[attr-defined]
    flight.run(20.0)
    assert flight.mode == 'RTL'
    assert 'the failsafe "RTL" has it' in flight.status.waiting_for
    assert flight.status.failsafe == 'RTL'


def test_the_rates_that_a_ground_station_asks_for_do_not_last() -> None:
    flight = SimulatedFlight(Simulated(ArduCopter))
    flight.until(lambda: flight.status.ready)
    slow = mav.dialect.MAVLink_request_data_stream_message(1, 1, 0, 4, 1)  # As MAVProxy does every 15 s.
    flight.copter.receive(slow)

    def positions(seconds: float) -> int:
        before = flight.companion.vehicle.n_received[mav.LOCAL_POSITION_NED]
        flight.run(seconds)
        return flight.companion.vehicle.n_received[mav.LOCAL_POSITION_NED] - before

    assert positions(0.5) <= 5
    flight.run(5.0)
    assert positions(1.0) >= 19
    asked = sum(message.get_type() == 'COMMAND_LONG' for message in flight.sent)
    flight.run(6.0)
    assert sum(message.get_type() == 'COMMAND_LONG' for message in flight.sent) == asked
