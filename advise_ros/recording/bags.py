"""ROS 2 bags (rosbag2 directories with MCAP or sqlite3, and bare .mcap files) -> samples of a flight."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_typestore

from advise_ros.core.errors import LogError
from advise_ros.core.samples import CommandSamples, PoseSamples, Recording, VehicleEvent

NS = 1_000_000_000
MAP_FRAME = 'map'
POSE_TYPES = (
    'geometry_msgs/msg/PoseStamped', 'nav_msgs/msg/Odometry', 'geometry_msgs/msg/PoseWithCovarianceStamped',
)
COMMAND_TYPE = 'geometry_msgs/msg/TwistStamped'
STATUS_TYPE = 'advise_msgs/msg/VehicleStatus'
POLICY_TYPE = 'advise_msgs/msg/FlightStatus'
POLICY_FLIES = (1, 2)  # FlightStatus.TO_START, FLYING
NEVER_NS = int(np.iinfo(np.int64).max)

Vectors = npt.NDArray[np.float64]
ProgressCallback = Callable[[int, int], None]


class BagTopics(NamedTuple):
    """Names of the topics to read: a name without leading '/' is found in any namespace.

    `required` names those besides the positions that the bag must have: 'command', 'status'.
    """

    pose: tuple[str, ...] = ('pose', 'odom')
    command: str = 'cmd_vel'
    status: str = 'vehicle_status'
    policy: str = 'policy/status'
    required: tuple[str, ...] = ()


DEFAULT_TOPICS = BagTopics()


class _Topics(NamedTuple):
    """What the names stand for in one bag; '' where it has none."""

    pose: str
    command: str
    status: str
    policy: str


def read_bag(
    path: str | Path, topics: BagTopics = DEFAULT_TOPICS, progress: ProgressCallback | None = None,
) -> Recording:
    """The samples of one vehicle in a bag, in the bag's order, stamped by their headers.

    Args:
        path: a rosbag2 directory or an .mcap file.
        topics: where positions, commands and states are.
        progress: called now and then with messages read and messages in all.

    Raises:
        LogError: the bag can't be read, has no such positions, or has them in another frame than 'map'.
    """
    with open_bag(path) as reader:
        found = _resolve(path, reader, topics)
        collected = _Collected(path, found)
        connections = [c for c in reader.connections if c.topic in found and c.msgtype in reader.typestore.fielddefs]
        total = sum(connection.msgcount for connection in connections)
        for count, (connection, _, raw) in enumerate(reader.messages(connections)):
            collected.take(connection, reader.deserialize(raw, connection.msgtype))
            if progress is not None and count % 1000 == 0:
                progress(count, total)
    return collected.recording()


@contextmanager
def open_bag(path: str | Path) -> Iterator[AnyReader]:
    """A reader of a whole bag; what goes wrong while it is used becomes one sentence.

    Raises:
        LogError: the path is no bag, or the bag is damaged or cut off.
    """
    bag = Path(path)
    if not bag.exists():
        raise LogError(f'{path}: there is no such file; name a bag directory or an .mcap file')
    if bag.is_dir() and not (bag / 'metadata.yaml').is_file():
        inside = ', '.join(sorted(file.name for file in bag.glob('*.mcap')))
        remedy = f'name the file inside it: {inside}' if inside else 'name a bag directory or an .mcap file'
        raise LogError(f'{path} is not a bag: it has no metadata.yaml; {remedy}')
    try:
        with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
            yield reader
    except LogError:
        raise
    except Exception as problem:  # rosbags lets many types through for damaged files
        reason = str(problem).splitlines()[0].rstrip('.') if str(problem) else type(problem).__name__
        hint = 'if its recording was cut off, the tool `mcap recover` saves what is whole'
        raise LogError(f'{path} is not a whole bag ({reason}); {hint}') from problem


# -- topics ----------------------------------------------------------------------------------------
def _resolve(path: str | Path, reader: AnyReader, topics: BagTopics) -> _Topics:
    types = {connection.topic: connection.msgtype for connection in reader.connections}
    pose = _pose_topic(path, types, topics)
    others = (
        _beside(pose, name, [topic for topic, msgtype in types.items() if msgtype == wanted])
        for name, wanted in ((topics.command, COMMAND_TYPE), (topics.status, STATUS_TYPE), (topics.policy, POLICY_TYPE))
    )
    found = _Topics(pose, *others)
    for kind in topics.required:
        if not getattr(found, kind):
            name, wanted = getattr(topics, kind), {'command': COMMAND_TYPE, 'status': STATUS_TYPE}[kind]
            raise LogError(
                f"{path} has no {wanted} on a topic '{name}'; it has {_listed(types)}: name the right one (--{kind}-topic)"
            )
    return found


def _listed(types: dict[str, str]) -> str:
    return ', '.join(f'{topic} ({msgtype})' for topic, msgtype in sorted(types.items())) or 'no topics'


def _pose_topic(path: str | Path, types: dict[str, str], topics: BagTopics) -> str:
    for name in topics.pose:
        matches = [topic for topic in types if types[topic] in POSE_TYPES and _is_named(topic, name)]
        exact = [topic for topic in matches if topic == '/' + name.lstrip('/')]
        if len(matches) > 1 and not exact:
            several = ', '.join(sorted(matches))
            raise LogError(f'{path} has positions on {several}; name one of them in full (--pose-topic)')
        if matches:
            return (exact or matches)[0]
    wanted = ' or '.join(f"'{name}'" for name in topics.pose)
    raise LogError(f'{path} has no positions on a topic {wanted}; it has {_listed(types)}: name the right one (--pose-topic)')


def _is_named(topic: str, name: str) -> bool:
    return topic == name or (not name.startswith('/') and topic.endswith('/' + name))


def _beside(pose: str, name: str, candidates: list[str]) -> str:
    """The topic of that name in the namespace of the positions or nearest around it, '' if there is none."""
    matches = [topic for topic in candidates if _is_named(topic, name)]
    namespace = pose.rsplit('/', 1)[0]
    while namespace:
        if f'{namespace}/{name}' in matches:
            return f'{namespace}/{name}'
        namespace = namespace.rsplit('/', 1)[0]
    exact = '/' + name.lstrip('/')
    if exact in matches:
        return exact
    return matches[0] if len(matches) == 1 else ''


# -- samples ---------------------------------------------------------------------------------------
def _stamp_ns(header: Any) -> int:
    return int(header.stamp.sec) * NS + int(header.stamp.nanosec)


class _Collected:
    """Samples as they come out of the bag."""

    def __init__(self, path: str | Path, topics: _Topics) -> None:
        self._path, self._topics = path, topics
        self._poses: list[tuple[int, tuple[float, float, float]]] = []
        self._commands: list[tuple[int, tuple[float, float, float]]] = []
        self._events: list[VehicleEvent] = []
        self._policy_ns: list[tuple[int, int]] = []
        self._other_frames: Counter[str] = Counter()

    def take(self, connection: Connection, message: Any) -> None:
        take = {
            self._topics.pose: self._pose,
            self._topics.command: self._command,
            self._topics.status: self._status,
            self._topics.policy: self._policy,
        }[connection.topic]
        take(message)

    def _pose(self, message: Any) -> None:
        if message.header.frame_id != MAP_FRAME:
            raise LogError(
                f"{self._path}: the positions on {self._topics.pose} are in frame '{message.header.frame_id}', "
                f"not '{MAP_FRAME}' (ENU); record positions in frame '{MAP_FRAME}'"
            )
        pose = message.pose if hasattr(message.pose, 'position') else message.pose.pose
        self._poses.append((_stamp_ns(message.header), (pose.position.x, pose.position.y, pose.position.z)))

    def _command(self, message: Any) -> None:
        if message.header.frame_id != MAP_FRAME:
            self._other_frames[message.header.frame_id] += 1
            return
        linear = message.twist.linear
        self._commands.append((_stamp_ns(message.header), (linear.x, linear.y, linear.z)))

    def _status(self, message: Any) -> None:
        state = (bool(message.armed), bool(message.in_air))
        if not self._events or self._events[-1][1:] != state:
            self._events.append(VehicleEvent(_stamp_ns(message.header), *state))

    def _policy(self, message: Any) -> None:
        stamp_ns = _stamp_ns(message.header)
        flying = message.phase in POLICY_FLIES
        open_ns = self._policy_ns[-1] if self._policy_ns and self._policy_ns[-1][1] == NEVER_NS else None
        if flying and open_ns is None:
            self._policy_ns.append((stamp_ns, NEVER_NS))
        elif not flying and open_ns is not None:
            self._policy_ns[-1] = (open_ns[0], stamp_ns)

    def recording(self) -> Recording:
        if not self._poses:
            raise LogError(f'{self._path} has no message on {self._topics.pose}; record a flight with positions')
        notes = [
            f"{count} commands in frame '{frame}' are not in '{MAP_FRAME}' and were not used"
            for frame, count in sorted(self._other_frames.items())
        ]
        return Recording(
            poses=PoseSamples(*_arrays(self._poses)),
            commands=CommandSamples(*_arrays(self._commands)),
            events=tuple(self._events),
            policy_ns=tuple(self._policy_ns),
            source=str(self._path),
            notes=tuple(notes),
        )


def _arrays(rows: list[tuple[int, tuple[float, float, float]]]) -> tuple[npt.NDArray[np.int64], Vectors]:
    stamps_ns = np.array([stamp_ns for stamp_ns, _ in rows], dtype=np.int64)
    return stamps_ns, np.array([vector for _, vector in rows], dtype=np.float64).reshape(-1, 3)
