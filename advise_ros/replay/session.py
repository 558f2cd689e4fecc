"""What a bag holds of one session: everything that replay rebuilds from, and what it compares with."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from rcl_interfaces.msg import ParameterEvent
from rclpy.parameter import parameter_value_to_python
from rclpy.serialization import deserialize_message

from advise_ros import config
from advise_ros.core.demonstrations.samples import PoseSamples, Recording
from advise_ros.core.errors import InputError, LogError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.site.prior import SitePrior
from advise_ros.core.units import MAP_FRAME, NS
from advise_ros.recording import platform
from advise_ros.recording.bagrecords import RECORDS_TOPIC
from advise_ros.recording.bags import read_bag
from advise_ros.recording.codec import Codec
from advise_ros.recording.definitions import definition
from advise_ros.recording.messages import Bag, Message
from advise_ros.recording.platform import PARAMETERS_RECORD, PLATFORM_RECORD, READ_AT
from advise_ros.recording.sitefile import load_site, site_of_text
from advise_ros.recording.storage import open_source
from advise_ros.recording.topics import BagTopics
from advise_ros.replay.overrides import GRID, Overrides, other_grid

COMMAND_TYPE = 'geometry_msgs/msg/TwistStamped'
DEMONSTRATION_TYPE = 'advise_msgs/msg/Demonstration'
POLICY_TYPE = 'advise_msgs/msg/Policy'
QUERY_TYPE = 'advise_msgs/msg/AdviceQuery'
ADVICE_TYPE = 'advise_msgs/msg/Advice'
FLIGHT_TYPE = 'advise_msgs/msg/FlightStatus'
TEXT_TYPE = 'std_msgs/msg/String'
EVENT_TYPE = 'rcl_interfaces/msg/ParameterEvent'
TYPES = (COMMAND_TYPE, DEMONSTRATION_TYPE, POLICY_TYPE, QUERY_TYPE, ADVICE_TYPE, FLIGHT_TYPE, TEXT_TYPE, EVENT_TYPE)
EVENTS_TOPIC = '/parameter_events'

# What replay cannot do without; other fields that a bag of another version lacks are not compared.
NEEDED: Mapping[str, tuple[str, ...]] = {
    DEMONSTRATION_TYPE: (
        'demonstration_id', 'source', 'grid', 'states', 'actions', 'stamps', 'window_start', 'window_end', 'end_reason', 'audit',
    ),
    POLICY_TYPE: ('version', 'grid', 'demonstrations', 'log_length', 'greedy'),
    QUERY_TYPE: ('query_id', 'states'),
    ADVICE_TYPE: ('advice_id', 'query_id', 'states', 'preferred', 'avoided', 'verdict', 'expert_id', 'comment', 'retracted'),
    TEXT_TYPE: ('data',),
    FLIGHT_TYPE: ('phase', 'policy_version', 'state', 'next_waypoint', 'steps', 'step_budget', 'start_cell'),
    'advise_msgs/msg/GridMap': ('info', 'altitude_m', 'waypoints', 'blocked'),
    'advise_msgs/msg/DiscretisationAudit': ('samples', 'notes'),
}
SITE_PRIOR_TOPIC = 'advise/site_prior'
# Either of these makes a session: on a site that is known a policy needs no demonstration.
SESSION_TOPICS: Mapping[str, str] = {DEMONSTRATION_TYPE: 'demonstration', POLICY_TYPE: 'advise/policy'}
# Parameters that bags of earlier versions do not hold, with what was done before there were any.
EARLIER: Mapping[str, Mapping[str, Any]] = {
    'AdviseConfig': {'confirm': False},
    'PolicyConfig': {'centre_first': False},
}
# Parameters that there are no more, with the only value that this version still has.
REMOVED: Mapping[str, Mapping[str, Any]] = {
    'AdviseConfig': {'clustering': 'k_means', 'method': 'own', 'cluster_score': 'mean'},
}


class NodeParameters(NamedTuple):
    """What a node was started with; `read_at_ns` by the logger's clock, 0 where the bag does not say."""

    values: Mapping[str, Any]
    read_at_ns: int


class SetParameter(NamedTuple):
    """A parameter that was set while its node ran.

    Attributes:
        log_time_ns: by the logger's clock.
        publish_time_ns: by the node's machine, as what the node published before and after.
    """

    name: str
    value: Any
    log_time_ns: int
    publish_time_ns: int


ConfigT = TypeVar('ConfigT')


@dataclass(frozen=True)
class RecordedMessage:
    """A message with its decoded value."""

    message: Message
    value: Any

    @property
    def stamp_ns(self) -> int:
        """Of the header."""
        return int(self.value.header.stamp.sec) * NS + int(self.value.header.stamp.nanosec)

    @property
    def where(self) -> str:
        """Topic and header stamp, for people."""
        return f'{self.message.topic} at {at(self.stamp_ns)}'


def at(stamp_ns: int) -> str:
    """A stamp as seconds with all its digits.

    Args:
        stamp_ns: any.
    """
    return f'{stamp_ns // NS}.{stamp_ns % NS:09d}'


@dataclass(frozen=True)
class RecordedSession:
    """One namespace of a bag.

    Attributes:
        bag: the bag; its codec decodes by the definitions that were recorded.
        namespace: '' or '/name'.
        recording: poses, commands, vehicle events and the policy's flights as samples.
        parameters: of each node, as often as it was started.
        changes: of parameters of each node, in the order in which they were made.
        same_platform: the bag was made by these package versions on this kind of machine.
        overrides: what is to be otherwise than it was.
        missing: fields that the bag's messages, of another version, do not have.
    """

    bag: Bag
    namespace: str
    recording: Recording
    parameters: Mapping[str, tuple[NodeParameters, ...]]
    made_on: Mapping[str, str]
    same_platform: bool
    overrides: Overrides = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    changes: Mapping[str, tuple[SetParameter, ...]] = field(default_factory=dict)
    _cache: dict[str, tuple[RecordedMessage, ...]] = field(default_factory=dict, repr=False)

    def on(self, name: str) -> tuple[RecordedMessage, ...]:
        """Decoded messages of a topic of the session, in the order in which they were recorded."""
        if name not in self._cache:
            found = self.bag.on(f'{self.namespace}/{name}')
            self._cache[name] = tuple(RecordedMessage(message, self.bag.decode(message)) for message in found)
        return self._cache[name]

    @property
    def same_cores(self) -> bool:
        """It was made by these sources: a digest over all parameters can be compared."""
        return self.made_on.get('core') == platform.describe()['core']

    @property
    def seconds(self) -> float:
        """From the first message to the last, by the logger's clock."""
        return (self.bag.last_ns - self.bag.first_ns) / NS

    @property
    def first_pose_ns(self) -> int | None:
        """The lowest stamp of a pose; None where there are none."""
        stamps_ns = self.recording.poses.stamps_ns
        return int(stamps_ns.min()) if stamps_ns.size else None

    @property
    def began_late(self) -> bool:
        """Whether the logger came when others had published already: their latched messages are older than the bag's poses."""
        begin_ns = self.first_pose_ns
        flown = (one for one in self.on('demonstration') if one.value.audit.samples)
        latched = (*flown, *self.on('advise/policy'))
        return begin_ns is None or any(one.stamp_ns < begin_ns for one in latched)

    @property
    def pose_topic(self) -> str:
        """Where the poses come from."""
        started = self.parameters.get(f'{self.namespace}/recorder')
        return f'{self.namespace}/{started[-1].values.get("pose_source", "pose") if started else "pose"}'

    def config(
        self, config_class: type[ConfigT], node: str, begun_ns: int | None = None, until_ns: int | None = None,
    ) -> ConfigT:
        """The parameters of a node, as they stood when it published something.

        The logger reads them soon after, or, as a node publishes late, soon before its first message.

        Args:
            config_class: of the node.
            node: its name in the session's namespace.
            begun_ns: when it began, by the logger's clock; None: the last node of that name.
            until_ns: when it published what they are wanted for; what was set later does not count. None: as it was started.

        Raises:
            LogError: the bag does not hold them, or they are not those of this version.
        """
        started = self.parameters.get(f'{self.namespace}/{node}')
        if started is None:
            raise LogError(
                f'{self.bag.path} does not hold the parameters of {self.namespace}/{node}; '
                + (
                    'start the logger before that node ends and record again' if self.parameters else
                    f'of no node does it: if it was converted, replay the original, or convert {RECORDS_TOPIC} with it '
                    '(bags of earlier versions do not have that topic)'
                )
            )
        chosen = started[-1] if begun_ns is None else min(started, key=lambda one: abs(one.read_at_ns - begun_ns))
        try:
            return _config(config_class, {**chosen.values, **self._set(node, chosen, until_ns), **self.overrides.get(node, {})})
        except InputError as problem:
            raise LogError(f'{self.bag.path}, parameters of {self.namespace}/{node}: {problem}') from problem

    def _set(self, node: str, started: NodeParameters, until_ns: int | None) -> dict[str, Any]:
        """What was set after the logger read a node's parameters, and before the node published something."""
        if until_ns is None or not started.read_at_ns:
            return {}
        return {
            change.name: change.value for change in self.changes.get(f'{self.namespace}/{node}', ())
            if change.log_time_ns > started.read_at_ns and change.publish_time_ns <= until_ns
        }

    def site_prior(self, recorded: Grid, until_ns: int) -> SitePrior:
        """What a learner had been given of the site, or what it is to be given; nothing where its cells are to be others.

        Args:
            recorded: grid of the learner.
            until_ns: when it published what it had learnt.

        Raises:
            InputError: what it was given is damaged, or the overrides name a file that cannot be read or make no grid.
        """
        grid, other = self.grid(recorded), str(self.overrides.get('advise', {}).get('site_map_file', ''))
        if other:
            return load_site(other, grid).prior
        given = [one for one in self.on(SITE_PRIOR_TOPIC) if one.message.publish_time_ns <= until_ns]
        return site_of_text(str(given[-1].value.data), grid.n_cells) if given and grid == recorded else SitePrior()

    def grid(self, recorded: Grid) -> Grid:
        """The grid as it is to be.

        Raises:
            InputError: the overrides make no grid of it.
        """
        return other_grid(recorded, self.overrides.get(GRID, {}))


def _config(config_class: type[ConfigT], values: Mapping[str, Any]) -> ConfigT:
    for name, kept in REMOVED.get(config_class.__name__, {}).items():
        if values.get(name, kept) != kept:
            raise InputError(f"'{name}' was '{values[name]}', which this version lacks; replay with the version of the bag")
    known = {spec.name for spec in fields(config_class)}  # type: ignore[arg-type]
    told = {**EARLIER.get(config_class.__name__, {}), **values}
    return config.build(config_class, {name: value for name, value in told.items() if name in known})


def read_session(path: str | Path, namespace: str | None = None, overrides: Overrides | None = None) -> RecordedSession:
    """Read one session.

    Args:
        path: a bag by `logger`.
        namespace: of the session; None where the bag holds one only.
        overrides: parameters that are to be otherwise.

    Raises:
        LogError: no readable bag, no demonstrations in it, or several sessions and no namespace named.
    """
    bag = Bag(path, TYPES)
    missing = _missing_fields(bag)
    where = _namespace(bag, namespace)
    if not bag.on(f'{where}/demonstration') and not _needs_none(bag, where):
        raise LogError(f'{path} holds no demonstrations; record a session with the logger from its beginning')
    parameters = _parameters(bag)
    recorders = parameters.get(f'{where}/recorder')
    recording = _samples(bag, where, recorders[-1].values if recorders else {})
    made_on = next((record.values for record in bag.records if record.name == PLATFORM_RECORD), {})
    same = not missing and made_on == platform.describe()
    return RecordedSession(bag, where, recording, parameters, made_on, same, overrides or {}, missing, _changes(bag))


def _needs_none(bag: Bag, where: str) -> bool:
    """Whether a policy was learnt without any demonstration, from what was known of the site."""
    return any(bag.decode(one).demonstrations == 0 for one in bag.on(f'{where}/{SESSION_TOPICS[POLICY_TYPE]}'))


def holds_session(path: str | Path) -> bool:
    """Whether a bag has demonstrations or policies; of one that cannot be read, True: replay says what is wrong with it."""
    try:
        source = open_source(path)
        return any(not SESSION_TOPICS.keys().isdisjoint(source.topics.values()) for _ in source.blocks())
    except LogError:
        return True


def _samples(bag: Bag, where: str, recorder: Mapping[str, Any]) -> Recording:
    """Poses and what goes with them; none where the bag has no positions."""
    pose = f'{where}/{recorder.get("pose_source", "pose")}'
    if pose not in bag.topics:
        return Recording(PoseSamples(np.empty(0, dtype=np.int64), np.empty((0, 3))))
    frame = str(recorder.get('frame', MAP_FRAME))
    names = BagTopics(
        (pose,), f'{where}/cmd_vel', f'{where}/vehicle_status', f'{where}/policy/status', as_stamped=True,
        frame='' if frame == MAP_FRAME else frame,
    )
    return read_bag(bag.path, names)


def _namespace(bag: Bag, wanted: str | None) -> str:
    """Namespace of the session without a slash at the end."""
    found = sorted({
        topic.removesuffix(f'/{SESSION_TOPICS[kind]}') for topic, kind in bag.topics.items()
        if kind in SESSION_TOPICS and topic.endswith(f'/{SESSION_TOPICS[kind]}')
    })
    if wanted is not None:
        namespace = '/' + wanted.strip('/') if wanted.strip('/') else ''
        if namespace not in found:
            raise LogError(f'{bag.path} has no session in namespace {wanted!r}; it has {_listed(found)}')
        return namespace
    if not found:
        raise LogError(f'{bag.path} holds no demonstrations; record a session with the logger from its beginning')
    if len(found) > 1:
        raise LogError(f'{bag.path} holds several sessions; name one by --namespace: {_listed(found)}')
    return found[0]


def _listed(namespaces: list[str]) -> str:
    return ', '.join(name or '/' for name in namespaces) or 'none'


def _parameters(bag: Bag) -> dict[str, tuple[NodeParameters, ...]]:
    """Node -> its parameters, in the order in which it was started."""
    found: dict[str, tuple[NodeParameters, ...]] = {}
    for record in bag.records:
        if record.name.startswith(PARAMETERS_RECORD):
            node = record.name.removeprefix(PARAMETERS_RECORD)
            values = {name: _value(bag, node, name, text) for name, text in record.values.items()}
            read_at_ns = int(values.pop(READ_AT, 0))
            found[node] = (*found.get(node, ()), NodeParameters(values, read_at_ns))
    return found


def _changes(bag: Bag) -> dict[str, tuple[SetParameter, ...]]:
    """Node -> its parameters that were set while it ran, in order."""
    found: dict[str, list[SetParameter]] = {}
    for message in sorted(bag.on(EVENTS_TOPIC), key=lambda one: one.publish_time_ns):
        try:  # The middleware leaves more padding behind this type than rosbags allows for.
            event = deserialize_message(message.data, ParameterEvent)
        except Exception as problem:
            raise LogError(f'{bag.path}, topic {EVENTS_TOPIC}: a message is damaged; was it edited?') from problem
        for changed in event.changed_parameters:
            value = parameter_value_to_python(changed.value)
            found.setdefault(event.node, []).append(
                SetParameter(changed.name, value, message.log_time_ns, message.publish_time_ns)
            )
    return {node: tuple(changes) for node, changes in found.items()}


def _value(bag: Bag, node: str, name: str, text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        raise LogError(f'{bag.path}: parameter {name[:40]!r} of {node} is damaged ({text[:40]!r}); was it edited?') from None


def _missing_fields(bag: Bag) -> tuple[str, ...]:
    """Fields that this version compares and the bag's messages, of another version, do not have.

    Raises:
        LogError: replay cannot do without one of them.
    """
    installed, missing = Codec(), []
    for type_name in sorted(set(bag.topics.values()) & set(TYPES)):
        installed.learn(type_name, 'ros2msg', definition(type_name).text)
    all_held = bag.codec.fields()
    for type_name, wanted in installed.fields().items():
        for name in (name for name in wanted if name not in all_held.get(type_name, wanted)):
            if name in NEEDED.get(type_name, ()):
                raise LogError(
                    f'{bag.path} was made by another version: its {type_name} has no field {name!r}; '
                    'replay it with the version that made it'
                )
            missing.append(f'{type_name.rsplit("/", 1)[-1]}.{name}')
    return tuple(missing)
