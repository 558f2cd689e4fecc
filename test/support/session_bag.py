"""A whole session made by the cores alone, as the messages of its bag: fast, and free to be tampered with."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped
from rcl_interfaces.msg import ParameterEvent
from rclpy.parameter import Parameter

from advise_msgs.msg import FlightStatus, VehicleStatus
from advise_ros.config import AdviseConfig, PolicyConfig, RecorderConfig
from advise_ros.core.advice.advice import Answer
from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.demonstrations.discretise import discretise
from advise_ros.core.demonstrations.recorded_flights import split
from advise_ros.core.demonstrations.samples import CommandSamples, PoseSamples, Recording, VehicleEvent
from advise_ros.core.flight.leg_follower import Pose
from advise_ros.core.flight.policy_flight import FlightPlan, PolicyFlight
from advise_ros.core.grid.grid import Grid, optimal_actions
from advise_ros.core.learning.learner import Learned
from advise_ros.core.learning.session import Session
from advise_ros.recording import platform
from advise_ros.recording.definitions import definition
from advise_ros.recording.writer import BagWriter
from advise_ros.replay.session import READ_AT
from advise_ros.ros import convert, convert_advice, qos
from advise_ros.ros.cdr import to_cdr
from advise_ros.ros.flying import velocity_command
from advise_ros.ros.subscriptions import as_recorded
from advise_ros.settings import learn_settings
from support.learning import taken_back

GRID = Grid(2.0, 3, 3, (-1.0, -1.0), 3.0, (2, 8, 0))
TICK_NS = 100_000_000
SOURCE = 'topic /pose'
# What the nodes offer; all else is latched.
OFFERED = {
    '/pose': qos.SENSOR, '/cmd_vel': qos.COMMAND, '/demonstration': qos.DEMONSTRATIONS, '/advise/advice_log': qos.ADVICE_LOG,
}

Entry = tuple[str, int, Any]  # Topic, log time [ns], message.


@dataclass
class SessionBag:
    """The messages of a session, in order, and the parameters of its nodes.

    `write` makes a bag of them; what is changed before shows in the replay.
    """

    recorder: RecorderConfig = RecorderConfig()
    advise: AdviseConfig = AdviseConfig(acquisition='occupancy', clusters=4)
    policy: PolicyConfig = PolicyConfig()
    nodes: tuple[str, ...] = ('recorder', 'advise', 'policy')
    entries: list[Entry] = field(default_factory=list)
    made_on: dict[str, str] = field(default_factory=platform.describe)
    now_ns: int = 10 * 1_000_000_000
    flights: int = 0
    restarts: list[tuple[str, dict[str, Any], int]] = field(default_factory=list)
    _poses: list[Pose] = field(default_factory=list)
    _commands: list[tuple[int, tuple[float, ...]]] = field(default_factory=list)
    _events: list[VehicleEvent] = field(default_factory=list)

    def put(self, topic: str, message: Any) -> None:
        self.entries.append((topic, self.now_ns, message))

    def set(self, node: str, **values: float | int | bool) -> None:
        """Parameters of a node are set while it runs."""
        self.now_ns += TICK_NS
        self.put('/parameter_events', ParameterEvent(node=f'/{node}', changed_parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()
        ]))
        setattr(self, node, replace(getattr(self, node), **values))
        self.now_ns += TICK_NS

    def parameters(self, node: str) -> dict[str, Any]:
        return asdict(getattr(self, node))

    def write(self, directory: Path, chunk_bytes: int = 768 * 1024, compression: str = 'zstd') -> Path:
        writer = BagWriter(directory, compression, chunk_bytes)
        writer.add_record('platform', self.made_on)
        for node in self.nodes:
            values = {name: json.dumps(value) for name, value in self.parameters(node).items()}
            writer.add_record(f'parameters /{node}', values)
        for node, values, read_at_ns in self.restarts:
            texts = {name: json.dumps(value) for name, value in {**values, READ_AT: read_at_ns}.items()}
            writer.add_record(f'parameters /{node}', texts)
        self.put_into(writer, self.entries)
        writer.close()
        return directory

    @staticmethod
    def put_into(writer: BagWriter, entries: Sequence[Entry]) -> None:
        channels: dict[str, int] = {}
        for sequence, (topic, log_time_ns, message) in enumerate(entries):
            module = type(message).__module__.split('.')
            if topic not in channels:
                kind = definition(f'{module[0]}/{module[1]}/{type(message).__name__}')
                channels[topic] = writer.add_topic(topic, kind, [as_recorded(OFFERED.get(topic, qos.latched()))])
            writer.write(channels[topic], log_time_ns, log_time_ns + sequence, to_cdr(message))

    def where(self, topic: str) -> list[int]:
        """Indices of a topic's messages in `entries`."""
        return [index for index, entry in enumerate(self.entries) if entry[0] == topic]

    # -- flying ------------------------------------------------------------------------------
    def status(self, *, flying: bool) -> None:
        message = VehicleStatus(connected=True, armed=flying, in_air=flying, commandable=flying)
        message.header.stamp = convert.stamp_from_ns(self.now_ns)
        self.put('/vehicle_status', message)
        self._events.append(VehicleEvent(self.now_ns, flying, flying))

    def fly(self, flight: PolicyFlight, policy_version: int = 0, ticks: int = 10_000) -> None:
        """Follow every command at once, from above the final waypoint until the flight is over, or its node dies."""
        at = np.array([*GRID.centre_enu_m(GRID.waypoints[-1]), GRID.altitude_m])
        self.status(flying=True)
        self.flights += bool(policy_version)
        self._tell(flight, policy_version)
        for _ in range(ticks):
            if flight.phase.over:
                break
            at = at + np.array(self._tick(flight, at, policy_version)) * TICK_NS / 1e9
        self.now_ns += TICK_NS
        self.status(flying=False)
        self.now_ns += TICK_NS

    def start_policy_again(self, policy: PolicyConfig) -> None:
        """Another policy node takes the place of one that was killed; it says that it is idle."""
        self.now_ns += 30 * TICK_NS
        self.restarts.append(('policy', asdict(policy), self.now_ns))
        self.flights = 0
        self.put('/policy/status', FlightStatus())
        self.now_ns += TICK_NS

    def begin_late(self, log_time_ns: int) -> None:
        """As a logger has it that came at a time: of what was before, what is latched."""
        before = [entry for entry in self.entries if entry[1] < log_time_ns]
        keep = {id(entry) for topic in ('/advise/policy', '/advise/query', '/policy/status', '/vehicle_status')
                for entry in [one for one in before if one[0] == topic][-1:]}
        latched = [one for one in before if id(one) in keep or one[0] in ('/demonstration', '/advise/advice_log')]
        after = [entry for entry in self.entries if entry[1] >= log_time_ns]
        self.entries = [(topic, log_time_ns, message) for topic, _, message in latched] + after

    def _tick(self, flight: PolicyFlight, at: Any, policy_version: int) -> tuple[float, float, float]:
        self.now_ns += TICK_NS
        pose = Pose(self.now_ns, (float(at[0]), float(at[1]), float(at[2])))
        self._poses.append(pose)
        message = PoseStamped()
        message.header.frame_id, message.header.stamp = 'map', convert.stamp_from_ns(pose.stamp_ns)
        message.pose.position.x, message.pose.position.y, message.pose.position.z = pose.position_enu_m
        self.put('/pose', message)
        before = flight.phase, flight.state, flight.steps
        velocity = flight.step(pose)
        self.put('/cmd_vel', velocity_command(velocity, pose.stamp_ns))
        self._commands.append((pose.stamp_ns, velocity))
        if before != (flight.phase, flight.state, flight.steps):
            self._tell(flight, policy_version)
        return velocity

    def _tell(self, flight: PolicyFlight, policy_version: int) -> None:
        """policy/status, for a policy's flight."""
        if not policy_version:
            return
        message = FlightStatus(
            phase=int(flight.phase), flight_id=self.flights, policy_version=policy_version,
            state=flight.state, steps=flight.steps,
            next_waypoint=GRID.next_waypoint(flight.state), step_budget=flight.step_budget, message=flight.message,
            start_cell=flight.plan.start_cell,
        )
        message.header.frame_id, message.header.stamp = 'map', convert.stamp_from_ns(self.now_ns)
        self.put('/policy/status', message)

    def recording(self) -> Recording:
        return Recording(
            poses=PoseSamples(
                np.array([pose.stamp_ns for pose in self._poses], dtype=np.int64),
                np.array([pose.position_enu_m for pose in self._poses], dtype=np.float64),
            ),
            commands=CommandSamples(
                np.array([stamp for stamp, _ in self._commands], dtype=np.int64),
                np.array([velocity for _, velocity in self._commands], dtype=np.float64),
            ),
            events=tuple(self._events), source=SOURCE,
        )

    def demonstrate(self, wrong_turns: Iterable[int], number: int = 0) -> Demonstration:
        """A flight that takes another way than the shortest in some states; with a number or the next one."""
        self.fly(PolicyFlight(FlightPlan(GRID, route(wrong_turns), step_budget=200), self.policy.seek_settings()))
        recording = self.recording()
        flight = split(GRID, recording, self.recorder.altitude_tolerance_m)[-1].flight
        number = number or len(self.where('/demonstration')) + 1
        demonstration = discretise(
            GRID, recording, flight.window_ns, self.recorder.discretise_settings(), f'flight-{number:03d}', flight.end_reason,
        )
        self.put('/demonstration', convert.demonstration_to_msg(demonstration))
        return demonstration

    def take_back(self, session: Session) -> None:
        """The last demonstration, as the recorder does."""
        self.now_ns += TICK_NS
        gone = taken_back(session.demonstrations[-1], self.now_ns)
        session.add(gone)
        self.put('/demonstration', convert.demonstration_to_msg(gone))

    # -- learning ----------------------------------------------------------------------------
    def learn(self, session: Session, grid: Grid = GRID) -> Learned:
        learned = session.learn()
        self.now_ns += TICK_NS
        self.put('/advise/policy', convert_advice.policy_to_msg(learned, self.now_ns))
        query = (
            convert_advice.query_to_msg(learned.query, grid, self.now_ns)
            if learned.query else convert_advice.no_query_to_msg(learned, session.budget_left, self.now_ns)
        )
        self.put('/advise/query', query)
        return learned

    def answer(self, session: Session, learned: Learned) -> None:
        """What a person who knows the way would say of the first state asked about."""
        assert learned.query is not None
        good = optimal_actions(GRID, learned.query.states[0])
        bad = tuple(action for action in range(4) if action not in good)
        outcome = session.submit(Answer(learned.query.query_id, 0, good[:1], bad))
        assert outcome.record is not None, outcome
        self.put('/advise/advice_log', convert_advice.advice_to_msg(outcome.record, self.now_ns))


def route(wrong_turns: Iterable[int] = ()) -> tuple[int, ...]:
    """Shortest ways, but in some states the last of the good actions instead of the first."""
    good = [optimal_actions(GRID, state) or (0,) for state in range(GRID.n_states)]
    return tuple(actions[-1 if state in set(wrong_turns) else 0] for state, actions in enumerate(good))


def session_bag(answers: int = 1, *, take_back: bool = False) -> SessionBag:
    """Two demonstrations (the second one taken back), an answer (or more), and a flight of the last policy."""
    bag = SessionBag()
    session = Session(GRID, learn_settings(bag.advise), bag.advise.budget)
    for wrong_turns in ((), range(GRID.n_states)):
        session.add(bag.demonstrate(wrong_turns))
        learned = bag.learn(session)
    if take_back:
        bag.take_back(session)
        learned = bag.learn(session)
    for _ in range(answers):
        bag.answer(session, learned)
        learned = bag.learn(session)
    plan = FlightPlan(GRID, tuple(int(action) for action in learned.greedy), start_cell=GRID.cell(1, 1))
    bag.now_ns += TICK_NS
    bag.fly(PolicyFlight(plan, bag.policy.seek_settings()), learned.version)
    bag.now_ns += 20 * TICK_NS
    bag.status(flying=False)
    return bag


__all__ = ['GRID', 'SessionBag', 'replace', 'session_bag']
