"""ROS 2 bags (rosbag2 directories with MCAP or sqlite3, and bare .mcap files) -> samples of a flight."""

from __future__ import annotations

import shlex
from collections import Counter
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.command_clock import Arrived, on_positions_clock
from advise_ros.core.demonstrations.known_states import changes, with_silences
from advise_ros.core.demonstrations.samples import (
    Arrivals,
    CommandSamples,
    PolicyEvent,
    PoseSamples,
    Recording,
)
from advise_ros.core.demonstrations.timeline import STEP_NS, STRAYS
from advise_ros.core.errors import LogError
from advise_ros.core.units import MAP_FRAME, NS
from advise_ros.recording import px4
from advise_ros.recording.blocks import Block, Channel, Integers
from advise_ros.recording.codec import Codec
from advise_ros.recording.columns import (
    NAVSAT_FIX,
    ON_EARTH,
    POSITION_TARGET,
    STRINGS,
    Column,
    Frames,
    Growing,
    read,
    why_unlike,
)
from advise_ros.recording.definitions import known_definition
from advise_ros.recording.place import Place
from advise_ros.recording.progress import ProgressCallback
from advise_ros.recording.states import ADVISE, EVENT_OF, PX4, stamp_ns, status_names
from advise_ros.recording.storage import open_source
from advise_ros.recording.topics import (
    ARDUPILOT_FRAME,
    ARDUPILOT_POSES,
    COMMAND_TYPES,
    COMMANDS,
    DEFAULT_TOPICS,
    FRAME_TYPE,
    POLICY_TYPE,
    POSE_TYPES,
    SETPOINT_TYPES,
    SETPOINTS,
    VEHICLE_FRAMES,
    WISHES,
    BagTopics,
    ChosenTopics,
    Held,
    choose_topics,
    full_name,
    is_named,
)
from advise_ros.recording.transforms import TF_TYPE, Edge, Moved, Placed, edges_of, parse_transforms, placed_in, stated

POLICY_FLIES = (1, 2)  # FlightStatus.TO_START, FLYING


class _Ordered(NamedTuple):
    """The vectors of a topic in order of arrival.

    Attributes:
        stamps_ns, log_ns: (n,) of the headers, and when they were recorded.
        vectors: (n, 3).
        places: (n,) what they are in order of: number in the file, or log time.
        on_earth: they were latitudes and longitudes, and lie on the axes of the grid now, not east and north.
    """

    stamps_ns: Integers
    vectors: npt.NDArray[np.float64]
    log_ns: Integers
    places: Integers
    on_earth: bool = False

    def at(self, rows: npt.NDArray[Any]) -> _Ordered:
        """Some of them."""
        return _Ordered(self.stamps_ns[rows], self.vectors[rows], self.log_ns[rows], self.places[rows])


NOTHING = _Ordered(np.empty(0, dtype=np.int64), np.empty((0, 3)), np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))


def read_bag(
    path: str | Path, topics: BagTopics = DEFAULT_TOPICS, progress: ProgressCallback | None = None, place: Place | None = None,
) -> Recording:
    """The samples of one vehicle in a bag, stamped by their headers.

    They are in the order of their log times; in a bag by our logger, which keeps the order of arrival, and where the log's
    clock was set back, in that of the file. Commands without a stamp, or with one of another clock, go by when they were
    recorded. What is cut off or damaged is left out and mentioned in the notes.

    Args:
        path: a rosbag2 directory or an .mcap file.
        topics: where positions, commands and states are.
        progress: called now and then with what is read and what there is in all.
        place: of the grid on the earth, for positions that are latitudes and longitudes.

    Raises:
        LogError: the bag can't be read, has no such positions, or has them in another frame than the map's.
    """
    source = open_source(path)
    collected = _Collected(path, topics, place)
    for block in source.blocks(progress):
        collected.take(block)
    return collected.recording(source.topics, tuple(source.notes), numbered=source.numbered)


# -- samples ---------------------------------------------------------------------------------------
class _Stretch:
    """The vectors of one topic, as they come out of the bag."""

    def __init__(self, channel: Channel) -> None:
        self.type_name, self.topic = channel.type_name, full_name(channel.topic)
        self.problem = why_unlike(channel)
        self._px4: px4.MessageLayout | None = None
        of_px4 = channel.type_name in (*px4.TYPES, px4.SETPOINT)
        self.undefined = of_px4 and not channel.definition
        kind = 'velocity' if channel.type_name == px4.SETPOINT else 'position'
        if of_px4 and not self.problem and not self.undefined:
            self._px4 = px4.layout(channel)
            self.problem = '' if self._px4 else f'the bag does not say where {channel.type_name} has its stamp and {kind}'
        self.strings = STRINGS.get(channel.type_name, 0)
        self.frames, self.count, self.unfit = Frames(), 0, 0
        self._stamps_ns, self._log_ns, self._places = (Growing(np.int64) for _ in range(3))
        self._frames, self._vectors = Growing(np.int32), Growing(np.float64, 3)
        self._lowest_m, self._highest_m = np.inf, -np.inf

    def take(self, block: Block, rows: Integers, first: int) -> None:
        """Messages of a block whose first message is the bag's message number `first`."""
        self.count += len(rows)
        if self.problem:
            return
        if self.undefined and self._px4 is None:
            self._px4 = px4.known_layout(self.type_name, int(block.ends[rows[0]] - block.starts[rows[0]]))
        if self._px4:
            column = px4.read(block, rows, self._px4, self.frames)
        else:
            kind = self.type_name if self.type_name in (NAVSAT_FIX, POSITION_TARGET) else ''
            column = read(block, rows, self.strings, self.frames, kind=kind)
        self.add(column._replace(rows=first + column.rows))

    def add(self, column: Column) -> None:
        """Vectors; their `rows` are their messages' numbers in the bag."""
        self._stamps_ns.add(column.stamps_ns)
        self._vectors.add(column.vectors)
        self._log_ns.add(column.log_ns)
        self._places.add(column.rows)
        self._frames.add(column.frames)
        self.unfit += column.unfit
        heights_m = column.vectors[np.isfinite(column.vectors[:, 2]), 2]
        self._lowest_m = min(self._lowest_m, heights_m.min(initial=np.inf))
        self._highest_m = max(self._highest_m, heights_m.max(initial=-np.inf))

    @property
    def held(self) -> Held:
        return Held(self.type_name, self.count, max(0.0, float(self._highest_m - self._lowest_m)))

    def begins_anew(self) -> bool:
        """Whether the clock of the log was set back in it, as in a looped playback recorded by simulated time.

        Parts that lie in another order than they were recorded in do not overlap. Nothing can be taken after.
        """
        log_ns = self._log_ns.whole()
        cuts = [0, *(np.flatnonzero(np.diff(log_ns) < -STEP_NS) + 1).tolist(), len(log_ns)]
        parts = sorted((int(log_ns[a:b].min()), int(log_ns[a:b].max())) for a, b in pairwise(cuts) if b - a > STRAYS)
        return any(after[0] < before[1] for before, after in pairwise(parts))

    def vectors(self, *, in_file_order: bool) -> tuple[_Ordered, Integers]:
        """The vectors, in the order of the file or of their log times, and the numbers of their frames.

        Nothing can be taken after.
        """
        grown = (self._stamps_ns, self._vectors, self._log_ns, self._places)
        stamps_ns, vectors, log_ns, places = (one.whole() for one in grown)
        found, frames = _Ordered(stamps_ns, vectors, log_ns, places if in_file_order else log_ns), self._frames.whole()
        if (found.places[1:] < found.places[:-1]).any():
            order = np.argsort(found.places, kind='stable')
            return found.at(order), frames[order]
        return found, frames


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

    def transforms(self) -> list[Moved]:
        """All of them, where these are messages of tf."""
        return [one for log_ns, place, data in self._found for one in parse_transforms(data, log_ns, place)]

    def decoded(self, *, in_file_order: bool) -> tuple[list[tuple[int, Any]], int]:
        """The messages in order, each with what it is in order of, and how many do not fit their definition.

        None where neither the bag nor we know the definition.
        """
        codec, channel = Codec(), self.channel
        if not channel.definition:
            encoding, text = known_definition(channel.type_name)
            if channel.type_name == PX4 and self._found:
                encoding, text = 'ros2msg', px4.known_status(len(self._found[0][2]))
            channel = channel._replace(encoding=encoding, definition=text)
        if not channel.definition or why_unlike(channel):
            return [], len(self._found)
        codec.learn(channel.type_name, channel.encoding, channel.definition)
        ordered = self._found if in_file_order else sorted(self._found, key=lambda entry: entry[0])
        values = [
            (place if in_file_order else log_ns, value) for log_ns, place, data in ordered
            if (value := codec.try_decode(data, self.channel.type_name))
        ]
        return values, len(ordered) - len(values)


class _Collected:
    """All that may be wanted, until it is known what the bag holds."""

    def __init__(self, path: str | Path, topics: BagTopics, place: Place | None) -> None:
        self._path, self._asked, self._place = path, topics, place
        self._said: list[str] = []
        self._vectors: dict[str, _Stretch] = {}
        self._messages: dict[str, _Messages] = {}
        self._counts: Counter[tuple[str, str]] = Counter()
        self._read = 0
        self._moved_frames: set[str] = set()

    def take(self, block: Block) -> None:
        counts = np.bincount(block.channel_ids, minlength=1) if len(block.channel_ids) else np.zeros(1, dtype=np.int64)
        for number, channel in block.channels.items():
            count = int(counts[number]) if number < len(counts) else 0
            if not count:
                continue
            self._counts[full_name(channel.topic), channel.type_name] += count
            taker = self._taker(channel)
            if taker is not None:
                taker.take(block, block.where(number), self._read)
        self._read += len(block.starts)

    def _taker(self, channel: Channel) -> _Stretch | _Messages | None:
        topic, kind = full_name(channel.topic), channel.type_name
        if kind == TF_TYPE:
            return self._messages.setdefault(topic, _Messages(channel))
        if kind in POSE_TYPES:
            wanted = not self._asked.pose or any(is_named(topic, name) for name in self._asked.pose)
        else:
            wanted = any(is_named(topic, name) for name in self._names(kind))
        if not wanted:
            return None
        if kind not in STRINGS and kind not in px4.TYPES and kind != px4.SETPOINT:
            return self._messages.setdefault(topic, _Messages(channel))
        if topic not in self._vectors:
            self._vectors[topic] = _Stretch(channel)
        return self._vectors[topic]

    def _names(self, kind: str) -> tuple[str, ...]:
        """Those by which messages of a type may be wanted, where they are not positions."""
        asked = self._asked
        if kind in COMMAND_TYPES:
            return (asked.command,) if asked.command else (*COMMANDS, *SETPOINTS)
        if kind in EVENT_OF:
            return (asked.status,) if asked.status else status_names(kind)
        return (asked.policy,) if kind == POLICY_TYPE else ()

    def recording(self, types: dict[str, str], notes: tuple[str, ...], *, numbered: bool) -> Recording:
        """All that was collected.

        Args:
            types: of all topics, also of silent ones.
            notes: on the reading.
            numbered: the file is in order of arrival.
        """
        held = {full_name(topic): Held(kind, 0) for topic, kind in types.items()}
        held |= {topic: Held(kind, count) for (topic, kind), count in self._counts.items()}
        held |= {topic: one.held for topic, one in self._vectors.items()}
        held |= self._vehicle_frames(held)
        found = choose_topics(self._path, held, self._asked)
        in_file_order = numbered or self._stretch(found.pose).begins_anew()
        poses = self._poses(found.pose, in_file_order=in_file_order)
        commands, said = self._commands(found.command, poses, in_file_order=in_file_order)
        statuses, unfit = self._values(found.status, in_file_order=in_file_order)
        flights, lost = self._values(found.policy, in_file_order=in_file_order)
        said += [
            f'the bag does not define {held[topic].type_name}: it was read as px4_msgs 1.13 to 1.18 have it'
            for topic in (found.pose, found.command) if topic and self._vectors[topic].undefined
        ]
        counts = ((self._vectors[found.pose].unfit, found.pose), (unfit, found.status), (lost, found.policy))
        said += self._said + [_unfit(count, topic) for count, topic in counts if count] + _unused(found, held)
        event_of = EVENT_OF.get(held[found.status].type_name if found.status else '', EVENT_OF[ADVISE])
        states = [event_of(message) for _, message in statuses], _before(poses, _places(statuses)).tolist()
        if found.status and held[found.status].type_name != ADVISE:  # Ours goes on as long as its bridge, as positions do.
            states = with_silences(*states, poses.stamps_ns)
        events, changed = changes(*states)
        policy, flew = changes(
            [PolicyEvent(stamp_ns(message), message.phase in POLICY_FLIES) for _, message in flights],
            _before(poses, _places(flights)).tolist(),
        )
        return Recording(
            PoseSamples(poses.stamps_ns, poses.vectors), CommandSamples(commands.stamps_ns, commands.vectors), events, policy,
            source=f'{self._path} ({found})', notes=(*notes, *said),
            arrivals=Arrivals(_before(poses, commands.places), changed, flew),
        )

    # -- frames --------------------------------------------------------------------------------
    @cached_property
    def _transforms(self) -> list[Moved]:
        return [
            one for messages in self._messages.values() if messages.channel.type_name == TF_TYPE for one in messages.transforms()
        ]

    @cached_property
    def _edges(self) -> dict[str, Edge]:
        return edges_of(self._transforms)

    def _vehicle_frames(self, held: dict[str, Held]) -> dict[str, Held]:
        """Frames of vehicles that move, as topics with positions, where there are no others or they were named."""
        asked = self._asked.pose
        local = set(POSE_TYPES) - set(ON_EARTH)
        if any(one.type_name in local and one.messages and not WISHES.search(topic) for topic, one in held.items()):
            return {}
        found = {}
        for child, edge in self._edges.items():
            topic = full_name(child)
            wanted = any(is_named(topic, name) for name in asked) if asked else child.rsplit('/', 1)[-1] in VEHICLE_FRAMES
            if wanted and len(edge.stamps_ns) > STRAYS:
                own = [one for one in self._transforms if one.child == child and one.parent == edge.parent]
                stretch = self._vectors[topic] = _Stretch(Channel(topic, FRAME_TYPE, '', ''))
                stamps_ns, log_ns, places = np.array([(one.stamp_ns, one.log_ns, one.place) for one in own], dtype=np.int64).T
                frames = np.full(len(own), stretch.frames.number(edge.parent), dtype=np.int64)
                stretch.add(Column(stamps_ns, np.array([one.translation_m for one in own]), log_ns, frames, 0, places))
                stretch.count = len(own)
                found[topic] = stretch.held
        return found

    def _placed(self, frame: str, accepted: set[str], stamps_ns: Integers) -> Placed | bool:
        """Where a frame lies on the grid at each stamp; True: it is the grid's, False: nobody knows."""
        asked = self._asked.frame.strip('/') or MAP_FRAME
        if frame == asked and self._asked.frame_at:
            return stated(*self._asked.frame_at)
        if frame in accepted:
            return True
        placed = placed_in(self._edges, asked, frame, stamps_ns)
        return False if placed is None else placed

    def _poses(self, topic: str, *, in_file_order: bool) -> _Ordered:
        stretch = self._stretch(topic)
        asked = self._asked.frame.strip('/')
        accepted = {MAP_FRAME, asked} if asked else {MAP_FRAME}
        if asked == MAP_FRAME:
            accepted.add('')
        if topic.endswith(tuple(f'/{name}' for name in ARDUPILOT_POSES)):
            accepted.add(ARDUPILOT_FRAME)
        poses, frames = stretch.vectors(in_file_order=in_file_order)
        if stretch.type_name in ON_EARTH and len(poses.stamps_ns):
            return self._on_earth(topic, poses)
        for frame, number in stretch.frames.items():
            rows = np.flatnonzero(frames == number)
            placed = self._placed(frame, accepted, poses.stamps_ns[rows]) if rows.size else True
            if placed is False:
                raise LogError(
                    f"{self._path}: the positions on {topic} are in frame '{frame}', not '{MAP_FRAME}' (ENU), and no tf connects "
                    f'the two; if its axes are east, north and up, pass --frame {shlex.quote(frame or MAP_FRAME)}; if it '
                    'lies elsewhere on the grid, say where: --frame-at=EAST,NORTH,UP,YAW'
                )
            if isinstance(placed, Placed):
                poses.vectors[rows] = placed.move(poses.vectors[rows])
                self._moved_frames.add(frame)
        if not len(poses.stamps_ns):
            raise LogError(f'{self._path}: none of the {stretch.unfit} messages on {topic} fits its type; name another topic')
        return poses

    def _on_earth(self, topic: str, poses: _Ordered) -> _Ordered:
        """Positions of latitudes, longitudes and altitudes; their frame is the receiver's, which says nothing."""
        if self._place is None:
            raise LogError(
                f'{self._path}: the positions on {topic} are places on the earth; '
                "add the grid's place to the grid file: origin_wgs84: [latitude, longitude]"
            )
        try:
            vectors, ground_m = self._place.fixes(poses.vectors)
        except LogError as problem:
            raise LogError(f'{self._path}, topic {topic}: {problem}') from None
        self._said.append(f'heights on {topic} count from {ground_m:.1f} m, the lower one of where the recording begins and ends')
        return poses._replace(vectors=vectors, on_earth=True)

    def _stretch(self, topic: str) -> _Stretch:
        stretch = self._vectors[topic]
        if stretch.problem:
            raise LogError(f'{self._path}, topic {topic}: {stretch.problem}')
        return stretch

    def _commands(self, topic: str, poses: _Ordered, *, in_file_order: bool) -> tuple[_Ordered, list[str]]:
        """The commands, on the clock of the positions; and what is to be said about them."""
        if not topic:
            return NOTHING, []
        stretch = self._stretch(topic)
        commands, frames = stretch.vectors(in_file_order=in_file_order)
        commands, notes = self._usable(stretch, commands, frames)
        if self._place is not None and poses.on_earth:
            commands = commands._replace(vectors=self._place.turned(commands.vectors))
        notes += [_unfit(stretch.unfit, topic)] * bool(stretch.unfit)
        if '' in stretch.frames and len(commands.stamps_ns):
            notes.append(f'commands on {topic} name no frame; they were taken as velocities to the east and north')
        if self._asked.as_stamped:
            return commands, notes
        own, where = Arrived(commands.stamps_ns, commands.log_ns), Arrived(poses.stamps_ns, poses.log_ns)
        on_clock = on_positions_clock(own, where, _before(poses, commands.places))
        if on_clock.ahead_ns:
            notes.append(
                f'the stamps of {topic} are of another clock, {on_clock.ahead_ns / NS:.1f} s ahead of that of the positions: '
                'commands count from when they were recorded'
            )
        elif on_clock.unstamped:
            notes.append(f'{on_clock.unstamped} commands on {topic} have no stamp: they count from when they were recorded')
        return commands._replace(stamps_ns=on_clock.stamps_ns), notes

    def _usable(self, stretch: _Stretch, commands: _Ordered, frames: Integers) -> tuple[_Ordered, list[str]]:
        """Those that ask for a velocity in a known frame, on the axes of the map; and what is to be said about the others."""
        kept, notes = np.ones(len(frames), dtype=np.bool_), list[str]()
        if stretch.type_name in SETPOINT_TYPES:
            kept &= np.isfinite(commands.vectors[:, :2]).all(axis=1)
            commands.vectors[np.isnan(commands.vectors[:, 2]), 2] = 0.0
            if lost := int(np.count_nonzero(~kept)):
                notes.append(f'{lost} of {len(kept)} setpoints on {stretch.topic} ask for no velocity and were not used')
        for frame, number in sorted(stretch.frames.items()):
            rows = np.flatnonzero((frames == number) & kept)
            placed = self._command_placed(frame, commands.stamps_ns[rows])
            if placed is False and rows.size:
                kept[rows] = False
                notes.append(f"{rows.size} commands in frame '{frame}' are not in '{MAP_FRAME}' and were not used")
            if isinstance(placed, Placed):
                commands.vectors[rows] = placed.turn(commands.vectors[rows])
        return commands.at(kept), notes

    def _command_placed(self, frame: str, stamps_ns: Integers) -> Placed | bool:
        """As _placed, for velocities: only of the map and of the positions' own frames is it known how they are meant.

        MAVROS does not look at the frame of a command, and most people leave it empty: it is that of the positions.
        """
        if not frame and len(self._moved_frames) == 1:
            (frame,) = self._moved_frames
        if frame in self._moved_frames:
            return self._placed(frame, set(), stamps_ns)
        return frame in (MAP_FRAME, self._asked.frame.strip('/'), '')

    def _values(self, topic: str, *, in_file_order: bool) -> tuple[list[tuple[int, Any]], int]:
        messages = self._messages.get(topic)
        return messages.decoded(in_file_order=in_file_order) if messages else ([], 0)


def _places(messages: list[tuple[int, Any]]) -> Integers:
    return np.array([place for place, _ in messages], dtype=np.int64)


def _before(poses: _Ordered, places: Integers) -> Integers:
    """How many positions had arrived before what lies at each place."""
    return np.searchsorted(poses.places, places, side='right')


def _unused(found: ChosenTopics, held: dict[str, Held]) -> list[str]:
    """One sentence on topics that might have been meant."""
    said = []
    for topic in found.unused:
        option = '--pose-topic' if held[topic].type_name in POSE_TYPES else '--command-topic'
        said.append(f'{held[topic].messages} {held[topic].type_name} on {topic} ({option} {topic})')
    return [f'not used: {", ".join(said)}'] if said else []


def _unfit(count: int, topic: str) -> str:
    return f'{count} messages on {topic} do not fit their type and were not used'
