"""Both dialects over links that lose, delay and reorder, in simulated time; and the proxy that does it in real time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.link import Link
from advise_ros.mavlink.messages import dialect as mavlink
from advise_ros.mavlink.requests import Goal
from advise_ros.sim.arducopter import ArduCopter
from advise_ros.sim.px4 import SimulatedPx4
from support import reserve
from support.companion_flight import DT_S
from support.lossy import LossyProxy, Wire
from support.simulated_flight import Simulated, SimulatedFlight

QUALITIES = [{'loss': 0.3}, {'delay_s': 0.5}, {'loss': 0.3, 'delay_s': 0.2, 'jitter_s': 0.3}]


class BadFlight(SimulatedFlight):
    """A flight whose link is bad in both directions."""

    def __init__(self, copter: Simulated, seed: int, **quality: float) -> None:
        super().__init__(copter)
        self.down, self.up = (Wire(rng, **quality) for rng in np.random.default_rng(seed).spawn(2))
        self._companion_codec = mavlink.MAVLink(None, 1, 191)

    def tick(self) -> None:
        self.now_s += DT_S
        ours = self.companion.step(self.now_s)
        setpoint = self.companion.setpoint(self.velocity, 0.0, self.now_s)
        for message in [*ours, *([] if setpoint is None else [setpoint])]:
            self.up.put(bytes(message.pack(self._companion_codec)), self.now_s)
        replies = [
            reply for frame in self.up.due(self.now_s)
            for message in self._framer.datagram(frame) for reply in self.copter.receive(message)
        ]
        for message in [*replies, *self.copter.step(DT_S)]:
            self.down.put(bytes(message.pack(self._codec)), self.now_s)
        for frame in self.down.due(self.now_s):
            for message in self._framer.datagram(frame):
                self.companion.observe(message, self.now_s)


@pytest.mark.parametrize('quality', QUALITIES, ids=str)
@pytest.mark.parametrize('dialect', [ArduCopter, SimulatedPx4])
def test_takes_off_flies_where_it_is_told_and_lands_over_a_bad_link(dialect: type[Any], quality: dict[str, float]) -> None:
    flight = BadFlight(Simulated(dialect), 1, **quality)
    flight.until(lambda: flight.status.ready)
    flight.ask(Goal.TAKEOFF, 4.0)
    flight.until(lambda: flight.status.commandable)
    flight.velocity = (1.0, 0.0, 0.0)
    flight.run(7.0)
    east, north, _ = (float(part) for part in flight.copter.vehicle.state.position_enu_m)
    assert east > 3.0
    assert abs(north) < 0.5
    flight.velocity = (0.0, 0.0, 0.0)
    flight.run(10.0)
    assert flight.status.commandable, flight.status.waiting_for
    flight.ask(Goal.LAND)
    flight.until(lambda: not flight.status.armed)


@pytest.mark.parametrize('cut_s', [0.5, 2.0, 30.0])
@pytest.mark.parametrize('dialect', [ArduCopter, SimulatedPx4])
def test_what_was_on_its_way_when_the_link_was_cut_moves_nothing_after(dialect: type[Any], cut_s: float) -> None:
    flight = BadFlight(Simulated(dialect), 2, delay_s=0.1, jitter_s=0.1)
    flight.until(lambda: flight.status.ready)
    flight.ask(Goal.TAKEOFF, 4.0)
    flight.until(lambda: flight.status.commandable)
    flight.velocity = (1.0, 0.0, 0.0)
    flight.run(3.0)
    flight.down.cut = flight.up.cut = True
    flight.run(cut_s)
    flight.down.cut = flight.up.cut = False
    flight.velocity = (0.0, 0.0, 0.0)
    flight.run(8.0)
    assert flight.status.connected
    assert float(np.linalg.norm(flight.copter.vehicle.state.velocity_enu_m_s[:2])) < 0.1 or flight.mode == 'RTL'


def test_the_proxy_loses_about_what_it_is_told_and_can_be_cut() -> None:
    port = reserve.free_udp_port()
    companion = Link(f'udpin:127.0.0.1:{port}', system_id=42)
    companion.start()
    with LossyProxy(port, 3, loss=0.5) as proxy:
        vehicle = Link(f'udpout:127.0.0.1:{proxy.vehicle_port}', system_id=21)
        vehicle.start()
        heard: list[Any] = []
        while len(heard) < 20:
            vehicle.send(mav.heartbeat())
            heard += companion.poll()
        companion.answer_to(heard[-1].source)
        while not vehicle.poll():
            companion.send(mav.heartbeat())
        proxy.cut(True)
        assert not proxy.down._held or proxy.down.due(1e9) == []
        vehicle.close()
    companion.close()
