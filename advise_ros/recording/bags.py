"""ROS 2 bags (rosbag2 directories with MCAP or sqlite3, and bare .mcap files) -> samples of a flight."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.samples import (
    Arrivals,
    CommandSamples,
    PolicyEvent,
    PoseSamples,
    Recording,
    VehicleEvent,
)
from advise_ros.core.errors import LogError
from advise_ros.core.units import MAP_FRAME
from advise_ros.recording import px4
from advise_ros.recording.blocks import Block, Channel, Integers
from advise_ros.recording.codec import Codec
from advise_ros.recording.columns import STRINGS, Growing, read, why_unlike
from advise_ros.recording.states import ADVISE, EVENT_OF, STATES, stamp_ns, status_names
from advise_ros.recording.storage import open_source

# ArduPilot's DDS sends positions east-north-up from its origin and calls their frame so all the same.
ARDUPILOT_POSES, ARDUPILOT_FRAME = ('ap/pose/filtered', 'ap/v1/pose/filtered'), 'base_link'
POSE_TYPES = (
    'geometry_msgs/msg/PoseStamped', 'nav_msgs/msg/Odometry', 'geometry_msgs/msg/PoseWithCovarianceStamped', *px4.TYPES,
)
COMMAND_TYPE = 'geometry_msgs/msg/TwistStamped'
POLICY_TYPE = 'advise_msgs/msg/FlightStatus'
POLICY_FLIES = (1, 2)  # FlightStatus.TO_START, FLYING

ProgressCallback = Callable[[int, int], None]
# Stamps, vectors and what they are in order of.
_Ordered = tuple[Integers, npt.NDArray[np.float64], Integers]
EventT = TypeVar('EventT', VehicleEvent, PolicyEvent)


class BagTopics(NamedTuple):
    """Names of the topics to read: a name without leading '/' is found in any namespace.

    The first name of `pose` that the bag has is taken; the defaults fit advise_ros, MAVROS and the DDS of ArduPilot and PX4.
    Without a `status` it is as recording/states.py says.
    `required` names those besides the positions that the bag must have: 'command', 'status'.
    """

    pose: tuple[str, ...] = (
        '/pose', 'local_position/pose', 'pose', 'local_position/odom', 'odom', *ARDUPILOT_POSES, *px4.TOPICS,
    )
    command: str = 'cmd_vel'
    status: str = ''
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
    """The samples of one vehicle in a bag, stamped by their headers.

    They are in the order of their log times; in a bag by our logger, which keeps the order of arrival, in that of
    the file. What is cut off or damaged is left out and mentioned in the notes.

    Args:
        path: a rosbag2 directory or an .mcap file.
        topics: where positions, commands and states are.
        progress: called now and then with what is read and what there is in all.

    Raises:
        LogError: the bag can't be read, has no such positions, or has them in another frame than 'map'.
    """
    source = open_source(path)
    collected = _Collected(path, topics)
    for block in source.blocks(progress):
        collected.take(block)
    return collected.recording(source.topics, tuple(source.notes), numbered=source.numbered)


# -- topics ----------------------------------------------------------------------------------------
def _resolve(path: str | Path, types: dict[str, str], topics: BagTopics) -> _Topics:
    pose = _pose_topic(path, types, topics)
    others = (
        _beside(pose, name, [topic for topic, msgtype in types.items() if msgtype == wanted])
        for name, wanted in ((topics.command, COMMAND_TYPE), (topics.policy, POLICY_TYPE))
    )
    command, policy = others
    found = _Topics(pose, command, _status_topic(pose, types, topics.status), policy)
    for kind in topics.required:
        if not getattr(found, kind):
            name, wanted = getattr(topics, kind), {'command': COMMAND_TYPE, 'status': ADVISE}[kind]
            raise LogError(
                f"{path} has no {wanted} on a topic '{name}'; it has {_listed(types)}: name the right one (--{kind}-topic)"
            )
    return found


def _status_topic(pose: str, types: dict[str, str], name: str) -> str:
    """The topic named, of any type with the vehicle's state, or the first of STATES that is beside the positions."""
    wanted = [(kind, name) for kind in EVENT_OF] if name else STATES
    found = (_beside(pose, of, [topic for topic, msgtype in types.items() if msgtype == kind]) for kind, of in wanted)
    return next(filter(None, found), '')


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
class _Stretch:
    """The vectors of one topic, as they come out of the bag."""

    def __init__(self, channel: Channel) -> None:
        self.problem = why_unlike(channel)
        self._px4: px4.MessageLayout | None = None
        if channel.type_name in px4.TYPES and not self.problem:
            self._px4 = px4.layout(channel)
            self.problem = '' if self._px4 else f'the bag does not say where {channel.type_name} has its stamp and position'
        self.strings = STRINGS.get(channel.type_name, 0)
        self.frames = frozenset((MAP_FRAME,))
        if channel.topic.endswith(tuple(f'/{name}' for name in ARDUPILOT_POSES)):
            self.frames |= {ARDUPILOT_FRAME}
        self.others: Counter[str] = Counter()
        self.unfit = 0
        self._stamps_ns, self._log_ns, self._places = (Growing(np.int64) for _ in range(3))
        self._vectors = Growing(np.float64, 3)

    def take(self, block: Block, rows: Integers, first: int) -> None:
        """Messages of a block whose first message is the bag's message number `first`."""
        if self.problem:
            return
        column = px4.read(block, rows, self._px4) if self._px4 else read(block, rows, self.strings, self.frames)
        self._stamps_ns.add(column.stamps_ns)
        self._vectors.add(column.vectors)
        self._log_ns.add(column.log_ns)
        self._places.add(first + column.rows)
        self.others += column.others
        self.unfit += column.unfit

    def vectors(self, *, in_file_order: bool) -> _Ordered:
        """Stamps, vectors and what they are in order of (number in the file, or log time); to be asked once."""
        grown = (self._log_ns, self._stamps_ns, self._vectors, self._places)
        log_ns, stamps_ns, vectors, places = (one.whole() for one in grown)
        if in_file_order:
            return stamps_ns, vectors, places
        if (log_ns[1:] < log_ns[:-1]).any():
            order = np.argsort(log_ns, kind='stable')
            return stamps_ns[order], vectors[order], log_ns[order]
        return stamps_ns, vectors, log_ns


class _Messages:
    """Messages of one topic, still as bytes; there are few of them."""

    def __init__(self, channel: Channel) -> None:
        self.channel = channel
        self._found: list[tuple[int, int, bytes]] = []

    def take(self, block: Block, rows: Integers, first: int) -> None:
        """As _Stretch.take."""
        for row in rows.tolist():
            data = block.data[int(block.starts[row]) : int(block.ends[row])]
            self._found.append((int(block.log_ns[row]), first + row, data))

    def decoded(self, *, in_file_order: bool) -> tuple[list[tuple[int, Any]], int]:
        """The messages in order, each with what it is in order of, and how many do not fit their definition.

        None where the bag has no definition.
        """
        codec = Codec()
        if not self.channel.definition or why_unlike(self.channel):
            return [], len(self._found)
        codec.learn(self.channel.type_name, self.channel.encoding, self.channel.definition)
        ordered = self._found if in_file_order else sorted(self._found, key=lambda entry: entry[0])
        values = [
            (place if in_file_order else log_ns, value) for log_ns, place, data in ordered
            if (value := codec.try_decode(data, self.channel.type_name))
        ]
        return values, len(ordered) - len(values)


class _Collected:
    """All that may be wanted, until it is known what the bag holds."""

    def __init__(self, path: str | Path, topics: BagTopics) -> None:
        self._path, self._topics = path, topics
        self._vectors: dict[str, _Stretch] = {}
        self._messages: dict[str, _Messages] = {}
        self._count = 0

    def take(self, block: Block) -> None:
        for number, channel in block.channels.items():
            taker = self._taker(channel)
            rows = block.where(number) if taker is not None else None
            if taker is not None and rows is not None and rows.size:
                taker.take(block, rows, self._count)
        self._count += len(block.starts)

    def _taker(self, channel: Channel) -> _Stretch | _Messages | None:
        topic, names = channel.topic, self._topics
        wanted = {
            COMMAND_TYPE: (names.command,), POLICY_TYPE: (names.policy,),
            **{kind: (names.status,) if names.status else status_names(kind) for kind in EVENT_OF},
            **dict.fromkeys(POSE_TYPES, names.pose),
        }.get(channel.type_name, ())
        if not any(_is_named(topic, name) for name in wanted):
            return None
        if channel.type_name not in STRINGS and channel.type_name not in px4.TYPES:
            return self._messages.setdefault(topic, _Messages(channel))
        if topic not in self._vectors:
            self._vectors[topic] = _Stretch(channel)
        return self._vectors[topic]

    def recording(self, types: dict[str, str], notes: tuple[str, ...], *, numbered: bool) -> Recording:
        found = _resolve(self._path, types, self._topics)
        stamps_ns, positions_enu_m, in_order_of = self._poses(found.pose, numbered=numbered)
        (commands_ns, velocities, commanded), said = self._commands(found.command, numbered=numbered)
        statuses, unfit = self._values(found.status, numbered=numbered)
        flights, lost = self._values(found.policy, numbered=numbered)
        counts = ((self._vectors[found.pose].unfit, found.pose), (unfit, found.status), (lost, found.policy))
        said += [_unfit(count, topic) for count, topic in counts if count]
        event_of = EVENT_OF.get(types.get(found.status, ''), EVENT_OF[ADVISE])
        events, changed = _changes([event_of(message) for _, message in statuses], [place for place, _ in statuses])
        policy, flew = _changes(
            [PolicyEvent(stamp_ns(message), message.phase in POLICY_FLIES) for _, message in flights],
            [place for place, _ in flights],
        )
        return Recording(
            PoseSamples(stamps_ns, positions_enu_m), CommandSamples(commands_ns, velocities), events, policy,
            source=str(self._path), notes=(*notes, *said),
            arrivals=Arrivals(*(np.searchsorted(in_order_of, of, side='right') for of in (commanded, changed, flew))),
        )

    def _poses(self, topic: str, *, numbered: bool) -> _Ordered:
        stretch = self._vectors.get(topic)
        if stretch is None:
            raise LogError(f'{self._path} has no message on {topic}; record a flight with positions')
        if stretch.problem:
            raise LogError(f'{self._path}, topic {topic}: {stretch.problem}')
        for frame in stretch.others:
            raise LogError(
                f"{self._path}: the positions on {topic} are in frame '{frame}', "
                f"not '{MAP_FRAME}' (ENU); record positions in frame '{MAP_FRAME}'"
            )
        poses = stretch.vectors(in_file_order=numbered)
        if not len(poses[0]):
            raise LogError(f'{self._path}: none of the {stretch.unfit} messages on {topic} fits its type; name another topic')
        return poses

    def _commands(self, topic: str, *, numbered: bool) -> tuple[_Ordered, list[str]]:
        stretch = self._vectors.get(topic)
        if stretch is None:
            return (np.empty(0, dtype=np.int64), np.empty((0, 3)), np.empty(0, dtype=np.int64)), []
        if stretch.problem:
            raise LogError(f'{self._path}, topic {topic}: {stretch.problem}')
        notes = [
            f"{count} commands in frame '{frame}' are not in '{MAP_FRAME}' and were not used"
            for frame, count in sorted(stretch.others.items())
        ]
        return stretch.vectors(in_file_order=numbered), notes + [_unfit(stretch.unfit, topic)] * bool(stretch.unfit)

    def _values(self, topic: str, *, numbered: bool) -> tuple[list[tuple[int, Any]], int]:
        messages = self._messages.get(topic)
        return messages.decoded(in_file_order=numbered) if messages else ([], 0)


def _unfit(count: int, topic: str) -> str:
    return f'{count} messages on {topic} do not fit their type and were not used'


def _changes(events: list[EventT], arrived: list[int]) -> tuple[tuple[EventT, ...], Integers]:
    """Each event that differs from the one before it, and what belongs to it."""
    kept = [row for row, event in enumerate(events) if not row or event[1:] != events[row - 1][1:]]
    return tuple(events[row] for row in kept), np.array([arrived[row] for row in kept], dtype=np.int64)
