"""A whole flight as real processes, with a tap on its MAVLink: what was commanded, and how the vehicle moved."""

from __future__ import annotations

import itertools
import math
import os
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from std_srvs.srv import Trigger

from advise_msgs.action import Fly
from advise_msgs.msg import FlightStatus, Policy, VehicleStatus
from advise_ros.core.grid import Grid
from advise_ros.core.trial import TrialSettings, fly
from advise_ros.mavlink import messages as mav
from advise_ros.recording.demofile import save_demonstrations
from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.ros import qos
from support import reserve
from support.graph import Graph
from support.lossy_proxy import LossyProxy
from support.processes import Process

PATIENCE_S = 60.0
STANDS_M_S, FLIES_M_S = 0.15, 0.5
KEPT = 20_000  # Samples of the tap: minutes.
SETPOINT = mav.dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED
NODES = ('policy', 'guard', 'mavlink_bridge', 'advise', 'recorder', 'logger')


class Command(NamedTuple):
    """A setpoint on the wire: when (steady), and its speed."""

    at_s: float
    speed_m_s: float


class Motion(NamedTuple):
    """What the vehicle says of itself: when (steady), speed, and position (east, north, up)."""

    at_s: float
    speed_m_s: float
    position_enu_m: tuple[float, float, float]


def square(side: int = 6) -> Grid:
    """Once round a square of 2 m cells, 3 m above the ground: about a minute of flight."""
    last = side - 1
    corners = ((last, 0), (last, last), (0, last), (0, 0))
    return Grid(2.0, side, side, (-1.0, -1.0), 3.0, tuple(y * side + x for x, y in corners))


class Tap:
    """Setpoints and positions that pass, the newest last; steady receive times."""

    def __init__(self) -> None:
        self.commands: deque[Command] = deque(maxlen=KEPT)
        self.motions: deque[Motion] = deque(maxlen=KEPT)

    def __call__(self, direction: str, message: Any, at_s: float) -> None:
        number = message.get_msgId()
        if direction == 'down' and number == SETPOINT:
            self.commands.append(Command(at_s, math.hypot(message.vx, message.vy, message.vz)))
        elif direction == 'up' and number == mav.LOCAL_POSITION_NED:
            speed = math.hypot(message.vx, message.vy, message.vz)
            self.motions.append(Motion(at_s, speed, (message.y, message.x, -message.z)))

    def commands_since(self, at_s: float) -> list[Command]:
        return [command for command in list(self.commands) if command.at_s >= at_s]

    def motions_since(self, at_s: float) -> list[Motion]:
        return [motion for motion in list(self.motions) if motion.at_s >= at_s]


@dataclass(frozen=True)
class Settings:
    """How a rig is set up.

    Attributes:
        speedup: simulated seconds a second; at any but 1 all nodes live by /clock.
        pose_rate_hz: in simulated time.
        parameters: more of them, by node.
        env: more environment of the nodes.
    """

    speedup: float = 1.0
    pose_rate_hz: float = 50.0
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
            'mavlink_bridge': {**on_grid, 'url': f'udpin:127.0.0.1:{port}', 'pose_rate_hz': settings.pose_rate_hz},
            'advise': {**on_grid, 'demonstrations_file': str(demonstrations), 'session_file': str(folder / 'session.json')},
        }
        for name, values in settings.parameters.items():
            self._parameters[name] = {**self._parameters[name], **values}
        self.processes: dict[str, Process] = {}
        self.simulator = graph.start('simulator', {
            'endpoint': f'udpout:127.0.0.1:{self.proxy.port}', 'ready_after_s': 0.5, 'battery_s': 100_000.0,
            'speedup': settings.speedup, 'publish_clock': settings.simulated_time,
        })
        for name in NODES:
            self.start(name)

    def _listen(self) -> None:
        self.vehicle = self.graph.listen('vehicle_status', VehicleStatus, qos.latched())
        self.flights = self.graph.listen('policy/status', FlightStatus, qos.latched())
        self.policies = self.graph.listen('advise/policy', Policy, qos.latched())
        self.diagnostics = self.graph.listen('/diagnostics', DiagnosticArray, 100)

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
                self.graph.send_goal(Fly, 'policy/fly', Fly.Goal(start_cell=0))
            time.sleep(0.05)

    def flies(self) -> bool:
        return self._under_way() and self.speed_m_s > FLIES_M_S and self._heard_lately()

    def _heard_lately(self) -> bool:
        return bool(self.tap.motions) and time.monotonic() - self.tap.motions[-1].at_s < 0.3

    def _under_way(self) -> bool:
        return bool(self.flights) and self.flights[-1].phase in (FlightStatus.TO_START, FlightStatus.FLYING)

    def _take_off(self) -> None:
        self.graph.wait_until(lambda: self.vehicle and self.vehicle[-1].ready, PATIENCE_S, 'a vehicle that is ready')
        self.graph.call(Trigger, 'mavlink_bridge/takeoff', timeout_s=PATIENCE_S)
        self.graph.wait_until(lambda: self.vehicle[-1].commandable or not self.vehicle[-1].ready, PATIENCE_S, 'the take-off')

    def story(self) -> str:
        """What is known when something fails."""
        vehicle = self.vehicle[-1] if self.vehicle else None
        flight = self.flights[-1] if self.flights else None
        said = {status.name: status.message for array in self.diagnostics[-40:] for status in array.status}
        return f'vehicle {vehicle}, flight {flight}, speed {self.speed_m_s:.2f} m/s, diagnostics {said}'

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
        while time.monotonic() < since_s + limit_s:
            at_s = found()
            if at_s is not None:
                return at_s - since_s
            time.sleep(0.01)
        return math.inf

    def longest_gap(self, since_s: float, until_s: float) -> float:
        """Longest time without a setpoint that moves the vehicle."""
        moving = [command.at_s for command in self.tap.commands_since(since_s) if command.speed_m_s > 0.0]
        times = [since_s, *(at_s for at_s in moving if at_s < until_s), until_s]
        return max(after - before for before, after in itertools.pairwise(times))

    def pause(self, longest_s: float) -> None:
        """A random moment."""
        time.sleep(float(self.rng.uniform(0.0, longest_s)))

    def heard_of(self, name: str, since: int) -> bool:
        """Whether a node has spoken on /diagnostics since so many messages."""
        return any(status.name == f'/{name}' for array in self.diagnostics[since:] for status in array.status)


@contextmanager
def private_graph() -> Iterator[Graph]:
    """A graph in a ROS domain of its own, outside of pytest too; complains when a process had to be forced."""
    with reserve.ros_domain() as domain:
        os.environ.update(
            ROS_DOMAIN_ID=str(domain), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST', FASTDDS_BUILTIN_TRANSPORTS='UDPv4',
            PYTHONUNBUFFERED='1',
        )
        graph = Graph(domain, os.environ)
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
            rig.fly()
            yield rig
        finally:
            rig.proxy.close()
            for process in rig.processes.values():
                process.expected_to_end = True
