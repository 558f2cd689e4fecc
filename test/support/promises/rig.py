"""A whole flight as real processes, with a tap on its MAVLink: what was commanded, and how the vehicle moved."""

from __future__ import annotations

import itertools
import math
import os
import signal
import struct
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from std_srvs.srv import Trigger

from advise_msgs.action import Fly
from advise_msgs.msg import FlightStatus, Policy, VehicleStatus
from advise_ros.core.grid.grid import Grid
from advise_ros.core.people.trial import TrialSettings, fly
from advise_ros.mavlink import messages as mav
from advise_ros.middleware import without_shared_memory
from advise_ros.recording.demofile import save_demonstrations
from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.ros import qos
from support import reserve
from support.graph import Graph
from support.lossy_proxy import LossyProxy
from support.processes import Process
from support.promises.tap import Tap

PATIENCE_S, GOAL_PATIENCE_S = 60.0, 5.0
STANDS_M_S, FLIES_M_S = 0.15, 0.5
# Seconds without a setpoint until it acts by itself: GUID_TIMEOUT and COM_OF_LOSS_T.
TIMEOUTS_S = {'ardupilot': 3.0, 'px4': 1.0}
NAMES = {'ardupilot': 'ArduPilot', 'px4': 'PX4'}
# By default PX4 returns when the stream ends; we recommend to hold.
HOLD = 5
NODES = ('policy', 'guard', 'mavlink_bridge', 'advise', 'recorder', 'logger')


def square(side: int = 6) -> Grid:
    """Once round a square of 2 m cells, 3 m above the ground: about a minute of flight."""
    last = side - 1
    corners = ((last, 0), (last, last), (0, last), (0, 0))
    return Grid(2.0, side, side, (-1.0, -1.0), 3.0, tuple(y * side + x for x, y in corners))


@dataclass(frozen=True)
class Settings:
    """How a rig is set up.

    Attributes:
        autopilot: whose manners the vehicle has.
        speedup: simulated seconds a second; at any but 1 all nodes live by /clock.
        parameters: more of them, by node.
        env: more environment of the nodes.
    """

    autopilot: str = 'ardupilot'
    speedup: float = 1.0
    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    env: Mapping[str, str] = field(default_factory=dict)

    @property
    def simulated_time(self) -> bool:
        return self.speedup != 1.0


SETTINGS = Settings()


class Rig:
    """simulator - bad radio - mavlink_bridge - guard - policy, and advise, recorder and logger beside them.

    Attributes:
        tap: what passes between autopilot and bridge.
        proxy: the radio.
        processes: by node.
    """

    def __init__(self, graph: Graph, folder: Path, rng: np.random.Generator, settings: Settings) -> None:
        self.graph, self.rng, self.grid, self._folder, self._settings = graph, rng, square(), folder, settings
        self._grid_file = folder / 'grid.yaml'
        self._grid_file.write_text(yaml.safe_dump({'grid': grid_to_mapping(self.grid)}))
        self._bags = 0
        self.tap = Tap()
        port = reserve.free_udp_port()
        self.proxy = LossyProxy(port, rng, self.tap)
        self._listen()
        demonstrations = folder / 'demonstrations.json'
        save_demonstrations(demonstrations, fly(self.grid, TrialSettings(flights=1, noise_rate=0.0, mistake_share=0.0), rng))
        on_grid = {'grid_file': str(self._grid_file)}
        self._parameters: dict[str, dict[str, Any]] = {
            'policy': {**on_grid, 'speed_m_s': 1.0}, 'guard': on_grid, 'recorder': on_grid, 'logger': {},
            'mavlink_bridge': {**on_grid, 'url': f'udpin:127.0.0.1:{port}'},
            'advise': {
                **on_grid, 'acquisition': 'occupancy', 'demonstrations_file': str(demonstrations),
                'session_file': str(folder / 'session.json'),
            },
        }
        self._parameters = {
            name: {**values, **settings.parameters.get(name, {})} for name, values in self._parameters.items()
        }
        self.processes: dict[str, Process] = {}
        self.simulator = graph.start('simulator', {
            'endpoint': f'udpout:127.0.0.1:{self.proxy.port}', 'ready_after_s': 0.5, 'battery_s': 100_000.0,
            'autopilot': settings.autopilot, 'speedup': settings.speedup,
            'publish_clock': settings.simulated_time,
            # The tap sees the autopilot's estimate. With PX4's error of 0.3 m/s who stands seems to move, at any time and for
            # long; how a vehicle stands in spite of that error is measured by its true position, in standing.py.
            'drift_m_s': 0.0,
            **settings.parameters.get('simulator', {}),
        })
        for name in NODES:
            self.start(name)

    def _listen(self) -> None:
        self.vehicle = self.graph.listen('vehicle_status', VehicleStatus, qos.latched())
        self.flights = self.graph.listen('policy/status', FlightStatus, qos.latched())
        self.policies = self.graph.listen('advise/policy', Policy, qos.latched())
        self.said: dict[str, str] = {}
        self._spoke_s: dict[str, float] = {}
        self.graph.node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 100)

    def _on_diagnostics(self, array: DiagnosticArray) -> None:
        now_s = time.monotonic()
        for status in array.status:
            self.said[status.name] = status.message
            self._awaited(status.name, now_s)
        self.graph.notify()

    def _awaited(self, name: str, now_s: float) -> None:
        if self._spoke_s.get(name) == math.inf:
            self._spoke_s[name] = now_s

    def start(self, name: str) -> None:
        """Start a node, or start it anew; the logger takes a new bag."""
        parameters = {'use_sim_time': self._settings.simulated_time, **self._parameters[name]}
        if name == 'logger':
            self._bags += 1
            parameters['bag'] = str(self._folder / f'bag-{self._bags}')
        remaps = {'cmd_vel': 'guard/cmd_vel'} if name == 'mavlink_bridge' else {}
        old = self.processes.get(name)
        if old is not None:
            self.graph.processes.remove(old)
        self.processes[name] = self.graph.start(name, parameters, remaps, self._settings.env)

    # -- the autopilot -----------------------------------------------------------------------
    @property
    def timeout_s(self) -> float:
        """The autopilot's own, of setpoints."""
        return TIMEOUTS_S[self._settings.autopilot]

    def with_autopilot(self, trouble: str) -> str:
        """The trouble's name in the ledger."""
        return f'{trouble} ({NAMES[self._settings.autopilot]})'

    def set_up_autopilot(self) -> None:
        """As docs/safety.md recommends: PX4 holds when the stream ends."""
        if self._settings.autopilot != 'px4':
            return
        station = mav.dialect.MAVLink(None, srcSystem=255, srcComponent=190)
        hold, = struct.unpack('<f', struct.pack('<i', HOLD))
        asked = mav.dialect.MAVLink_param_set_message(1, 1, b'COM_OBL_RC_ACT', hold, mav.dialect.MAV_PARAM_TYPE_INT32)

        def told() -> bool:
            self.proxy.tell_vehicle(asked.pack(station))
            return 'COM_OBL_RC_ACT' in self.tap.parameters

        self.graph.wait_until(told, PATIENCE_S, 'the autopilot to take a parameter')

    # -- flying ------------------------------------------------------------------------------
    @property
    def speed_m_s(self) -> float:
        return self.tap.motions[-1].speed_m_s if self.tap.motions else 0.0

    def fly(self) -> None:
        """Have the vehicle in motion along the route: take-off, goal, whatever it lacks."""
        end_s = time.monotonic() + PATIENCE_S
        while not self.flies():
            assert time.monotonic() < end_s, f'the vehicle does not fly: {self.story()}'
            if not (self.vehicle and self.vehicle[-1].commandable):
                self._take_off()
            elif not self._under_way():
                self._send_goal()
            time.sleep(0.05)

    def _send_goal(self) -> None:
        """A policy that has just come back may lose the first goal: it is sent again."""
        with suppress(AssertionError):
            self.graph.send_goal(Fly, 'policy/fly', Fly.Goal(start_cell=0), timeout_s=GOAL_PATIENCE_S)

    def flies(self) -> bool:
        return self._under_way() and self.speed_m_s > FLIES_M_S and self._heard_lately()

    def _heard_lately(self) -> bool:
        return bool(self.tap.motions) and time.monotonic() - self.tap.motions[-1].at_s < 0.3

    def _under_way(self) -> bool:
        return bool(self.flights) and self.flights[-1].phase in (FlightStatus.TO_START, FlightStatus.FLYING)

    def _take_off(self) -> None:
        self.graph.wait_until(lambda: self.vehicle and self.vehicle[-1].ready, PATIENCE_S, 'a vehicle that is ready')
        service = 'take_over' if self.vehicle[-1].in_air else 'takeoff'  # A bridge that came back owns nothing.
        if not self.graph.call(Trigger, f'mavlink_bridge/{service}', timeout_s=PATIENCE_S).success:
            return
        self.graph.wait_until(lambda: self.vehicle[-1].commandable or not self.vehicle[-1].ready, PATIENCE_S, 'the take-off')

    def story(self) -> str:
        """What is known when something fails."""
        vehicle = self.vehicle[-1] if self.vehicle else None
        flight = self.flights[-1] if self.flights else None
        return f'vehicle {vehicle}, flight {flight}, speed {self.speed_m_s:.2f} m/s, diagnostics {self.said}'

    # -- measuring ---------------------------------------------------------------------------
    def wait_stands(self, since_s: float, limit_s: float) -> float:
        """Seconds from a moment until the vehicle stands (infinite: it does not within `limit_s`)."""
        return self._first(lambda: self._standing(since_s), since_s, limit_s)

    def _standing(self, since_s: float) -> float | None:
        motions = self.tap.motions_since(since_s)
        for first, second in itertools.pairwise(motions):
            if max(first.speed_m_s, second.speed_m_s) < STANDS_M_S:
                return first.at_s
        return None

    def wait_zero(self, since_s: float, limit_s: float) -> float:
        """Seconds from a moment until zero velocity is commanded on the wire."""
        def found() -> float | None:
            return next((command.at_s for command in self.tap.commands_since(since_s) if command.speed_m_s == 0.0), None)

        return self._first(found, since_s, limit_s)

    @staticmethod
    def _first(found: Callable[[], float | None], since_s: float, limit_s: float) -> float:
        while True:
            over = time.monotonic() >= since_s + limit_s
            at_s = found()
            if at_s is not None or over:
                return math.inf if at_s is None else at_s - since_s
            time.sleep(0.01)

    def longest_gap(self, since_s: float, until_s: float) -> float:
        """Longest time without a setpoint that moves the vehicle."""
        moving = [command.at_s for command in self.tap.commands_since(since_s) if command.speed_m_s > 0.0]
        times = [since_s, *(at_s for at_s in moving if at_s < until_s), until_s]
        return max(after - before for before, after in itertools.pairwise(times))

    def pause(self, longest_s: float) -> None:
        """A random moment."""
        time.sleep(float(self.rng.uniform(0.0, longest_s)))

    # -- taking away -------------------------------------------------------------------------
    def bring_back(self, name: str) -> float:
        """Continue a stopped node, start a killed one anew; when (steady)."""
        now_s, process = time.monotonic(), self.processes[name]
        self._spoke_s[f'/{name}'] = math.inf
        if process.running:
            process.signal(signal.SIGCONT)
        else:
            self.start(name)
        return now_s

    def wait_speaks(self, name: str, since_s: float, limit_s: float) -> float:
        """Seconds from a node's return until it says something on /diagnostics."""
        self.graph.wait_until(lambda: self._spoke_s[f'/{name}'] < math.inf, limit_s, f'{name} to speak again')
        return self._spoke_s[f'/{name}'] - since_s


@contextmanager
def private_graph() -> Iterator[Graph]:
    """A graph in a ROS domain of its own, outside of pytest too; complains when a process had to be forced."""
    with reserve.ros_domain() as domain:
        os.environ.update(ROS_DOMAIN_ID=str(domain), PYTHONUNBUFFERED='1')
        theirs = {**os.environ, 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'FASTRTPS_DEFAULT_PROFILES_FILE': ''}
        os.environ.update(theirs)
        without_shared_memory(os.environ)  # Nor shall our watch wait for a node that we stopped.
        graph = Graph(domain, theirs)
        try:
            yield graph
        finally:
            complaints = graph.close()
        if complaints:
            raise AssertionError('\n'.join(complaints))


@contextmanager
def flying(folder: Path, rng: np.random.Generator, settings: Settings = SETTINGS) -> Iterator[Rig]:
    """A rig in a private ROS domain whose vehicle is in the air, flying."""
    with private_graph() as graph:
        rig = Rig(graph, folder, rng, settings)
        try:
            graph.wait_until(lambda: rig.policies, PATIENCE_S, 'the first policy')
            rig.set_up_autopilot()
            rig.fly()
            yield rig
        finally:
            rig.proxy.close()
            for process in rig.processes.values():
                process.expected_to_end = True
