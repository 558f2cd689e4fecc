"""The executable `simulator`."""

from __future__ import annotations

import sys
import time

import numpy as np
from rclpy.clock import Clock, ClockType
from rosgraph_msgs.msg import Clock as ClockMessage

from advise_ros.config import SimulatorConfig
from advise_ros.mavlink.signing import optional_key
from advise_ros.ros import convert, qos, run
from advise_ros.ros.configured import ConfiguredNode
from advise_ros.ros.diagnostics import OK, WARN, Diagnostics
from advise_ros.sim.arducopter import ArduCopter
from advise_ros.sim.autopilot import COMPONENT_ID, Message
from advise_ros.sim.link import SimulatorLink
from advise_ros.sim.pacing import Pacer, Patience
from advise_ros.sim.px4 import SimulatedPx4

DIALECTS = {'ardupilot': ArduCopter, 'px4': SimulatedPx4}

FASTEST_TIMER_S, SLOWEST_TIMER_S = 0.001, 0.01
# A callback hands control back after this long, so that signals and diagnostics are served.
LONGEST_TURN_NS = 10_000_000


class SimulatorNode(ConfiguredNode):
    """A simulated quadcopter that speaks MAVLink 2 like ArduCopter in GUIDED, or PX4 in OFFBOARD; RotorPy is its physics.

    It sends heartbeats to `endpoint` and waits for a companion (mavlink_bridge) or a ground station: message
    intervals, mode, arm, take-off, velocity setpoints, land; what the real ones refuse, it refuses. Simulated
    time runs `speedup` times as fast as steady time; the flight is the same at every speed. Publishes /clock
    (rosgraph_msgs/Clock), at most some milliseconds ahead of the time_boot_ms of its messages, and says on
    /diagnostics which speed it reaches. At any speed but 1 every other node needs -p use_sim_time:=true.
    A `second_endpoint` takes a ground station or another companion beside the first; docs/simulator.md lists what
    it does as the real ones do.

    Examples:
      ros2 run advise_ros simulator --ros-args -p endpoint:=udpout:127.0.0.1:14550 -p speedup:=10.0
      ros2 run advise_ros simulator --ros-args -p autopilot:=px4
    Next: `mavlink_bridge` on the same port; `fly_check udpin:127.0.0.1:14550` shows what it says.
    """

    def __init__(self) -> None:
        super().__init__('simulator')
        self.config = self.load(SimulatorConfig)
        self._autopilot = DIALECTS[self.config.autopilot](self.config, np.random.default_rng(self.config.seed))
        self._links = [self._open('endpoint')]
        if self.config.second_endpoint:
            self._links.append(self._open('second_endpoint'))
            self._autopilot.add_channel()
        self._pacer = Pacer(self.config.speedup, round(self.config.step_s * 1e9))
        self._patience = Patience(self.config.setpoint_lead_s)
        self._clock_period_ns = round(1e9 / self.config.clock_rate_hz)
        self._clock_sent_ns = 0
        self._spoken_to = False
        self._clock_publisher = self.create_publisher(ClockMessage, '/clock', qos.COMMAND) if self.config.publish_clock else None
        self._diagnostics = Diagnostics(self, self._report)
        self.create_timer(self._timer_period_s(), self._turn, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _open(self, parameter: str) -> SimulatorLink:
        key = optional_key(self.config.signing_key_file)
        return SimulatorLink(getattr(self.config, parameter), self.config.system_id, COMPONENT_ID, key, parameter)

    def _timer_period_s(self) -> float:
        if self.config.speedup == 0.0:
            return FASTEST_TIMER_S
        return min(max(self.config.step_s / self.config.speedup, FASTEST_TIMER_S), SLOWEST_TIMER_S)

    def _turn(self) -> None:
        """Answer what has arrived and do the ticks that are due, reading before each."""
        started_ns = time.monotonic_ns()
        self._answer()
        self._pacer.run_at(self._speedup, started_ns)
        while self._pacer.due(now_ns := time.monotonic_ns()) > 0 and now_ns - started_ns < LONGEST_TURN_NS:
            self._answer()
            vehicle = self._autopilot.vehicle
            if self._patience.waits(vehicle.flight.moving_setpoint_age_s(vehicle.now_s), now_ns):
                self._pacer.forgive(now_ns)
                return
            messages = self._autopilot.step_all()
            self._pacer.did(1)
            self._publish_clock(now_ns)
            for link, due in zip(self._links, messages, strict=True):
                link.send(due)

    @property
    def _speedup(self) -> float:
        vehicle = self._autopilot.vehicle
        parked = vehicle.ready and not vehicle.armed
        return (self.config.parked_speedup if parked else 0.0) or self.config.speedup

    def _answer(self) -> None:
        for number, link in enumerate(self._links):
            for message in link.read():
                self._spoken_to = True
                self._forward(message, link)
                link.send(self._autopilot.receive(message, number))

    def _forward(self, message: Message, source: SimulatorLink) -> None:
        """Peers on other links receive each other's heartbeats, as with the real ones, and nothing else."""
        if message.get_type() == 'HEARTBEAT':
            for link in self._links:
                if link is not source:
                    link.pass_on(message)

    def _publish_clock(self, steady_ns: int) -> None:
        if self._clock_publisher is not None and steady_ns - self._clock_sent_ns >= self._clock_period_ns:
            self._clock_sent_ns = steady_ns
            self._clock_publisher.publish(ClockMessage(clock=convert.stamp_from_ns(self._autopilot.vehicle.now_ns)))

    def _report(self) -> None:
        pacer, vehicle = self._pacer, self._autopilot.vehicle
        values = {
            'speedup asked': pacer.speedup,
            'speedup achieved': 'measuring' if pacer.achieved is None else f'{pacer.achieved:.2f}',
            'simulated time (s)': f'{vehicle.now_s:.1f}',
            'mode': vehicle.mode.name,
            'armed': vehicle.armed,
        }
        if pacer.falls_behind and pacer.achieved is not None:
            shortfall = f'speedup {pacer.speedup:g} asked, {pacer.achieved:.1f} achieved: this machine cannot keep up'
            self._diagnostics.set(WARN, shortfall, values)
        elif not self._spoken_to:
            self._diagnostics.set(OK, f'waiting for a companion on {self.config.endpoint}', values)
        else:
            self._diagnostics.set(OK, 'simulating' if vehicle.ready else 'simulating; not ready to arm yet', values)

    def close(self) -> None:
        for link in self._links:
            link.close()


def main() -> None:
    sys.exit(run.run_node(SimulatorNode, SimulatorConfig))


if __name__ == '__main__':
    main()
