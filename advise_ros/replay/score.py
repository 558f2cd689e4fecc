"""What is to be done, in order, to live through a recorded session again: the inputs, and what to wait for."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

from advise_msgs.msg import VehicleStatus
from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.demonstrations.demonstration import EndReason
from advise_ros.core.units import NS
from advise_ros.recording.codec import Codec
from advise_ros.recording.messages import Bag, Message
from advise_ros.replay.demonstrations import is_flown
from advise_ros.replay.flight_parts import RecordedFlight, flights_of
from advise_ros.replay.flights import FROM_OUTSIDE
from advise_ros.replay.session import (
    ADVICE_TYPE,
    COMMAND_TYPE,
    DEMONSTRATION_TYPE,
    FLIGHT_TYPE,
    POLICY_TYPE,
    RecordedMessage,
    RecordedSession,
)
from advise_ros.ros import convert, convert_advice
from advise_ros.ros.cdr import to_cdr

POSE_TYPES = ('geometry_msgs/msg/PoseStamped', 'nav_msgs/msg/Odometry')
STATUS_TYPE = 'advise_msgs/msg/VehicleStatus'
INPUTS = (*POSE_TYPES, COMMAND_TYPE, STATUS_TYPE, DEMONSTRATION_TYPE, ADVICE_TYPE, POLICY_TYPE, FLIGHT_TYPE)

OUTPUT_TOPICS = ('demonstration', 'advise/advice_log', 'advise/policy', 'policy/status')


class Publish(NamedTuple):
    """Send a message; where it is a pose of a policy's flight, wait for the command with its stamp."""

    message: Message
    command_stamp_ns: int = 0


class Demonstrated(NamedTuple):
    """Wait for a demonstration of the recorder."""

    recorded: RecordedMessage


class Stop(NamedTuple):
    """Call recorder/stop."""


class Advise(NamedTuple):
    """Give an answer, or take one back."""

    record: AdviceRecord


class Learnt(NamedTuple):
    """Wait for a policy."""

    recorded: RecordedMessage


class Fly(NamedTuple):
    """Begin a flight of a policy; `pose` is the last one before it."""

    flight: RecordedFlight
    pose: Message | None


class End(NamedTuple):
    """End the flight from outside, if it is still under way."""


Step: TypeAlias = Publish | Demonstrated | Stop | Advise | Learnt | Fly | End


class Score(NamedTuple):
    """Steps with the clock that the bag shows for each, and what could not be taken over."""

    steps: tuple[tuple[int, Step], ...]
    topics: dict[str, str]
    notes: tuple[str, ...]


def score_of(session: RecordedSession, pose_source: str) -> Score:
    """The steps of a session whose recorder took positions from the topic `pose_source`."""
    return _Writer(session, pose_source).score()


class _Writer:
    def __init__(self, session: RecordedSession, pose_source: str) -> None:
        self._session, self._space = session, session.namespace
        self._pose = f'{self._space}/{pose_source}'
        self._flights = flights_of(session)[0]
        self._flown = [_flown(flight, session) for flight in self._flights]
        self._commanded = {one.stamp_ns for flight in self._flights for one in flight.commands}
        self._outputs = {_place(one.message): one for name in OUTPUT_TOPICS for one in session.on(name)}
        self._waiting = list(self._flights)
        flown = [one for one in session.on('demonstration') if is_flown(one.value)]
        self._stops = [
            convert.stamp_to_ns(one.value.window_end) for one in flown if one.value.end_reason == EndReason.STOPPED
        ]
        self._skipped = 0
        self._cut_off = False
        self._last: Message | None = None
        self._steps: list[tuple[int, Step]] = []

    def score(self) -> Score:
        bag = Bag(self._session.bag.path, INPUTS)
        topics = {self._pose: bag.topics.get(self._pose, ''), f'{self._space}/cmd_vel': COMMAND_TYPE}
        topics |= {f'{self._space}/vehicle_status': STATUS_TYPE, f'{self._space}/demonstration': DEMONSTRATION_TYPE}
        for message in bag.messages:
            if message.topic == self._pose:
                self._add_pose(message, stamp_ns_of(message))
            elif message.topic == f'{self._space}/cmd_vel':
                self._add_command(message)
            elif message.topic == f'{self._space}/vehicle_status':
                self._add_status(message, bag.codec)
            else:
                self._add_output(message)
        notes = [f'{self._skipped} positions that the policy did not fly by were left out'] * bool(self._skipped)
        return Score(tuple(self._steps), {topic: kind for topic, kind in topics.items() if kind}, tuple(notes))

    def _add_pose(self, message: Message, stamp_ns: int) -> None:
        at = message.log_time_ns
        while self._waiting and stamp_ns > self._waiting[0].statuses[0].stamp_ns:
            if self._cut_off:  # Its node was killed; the one that lives through it again is to end it.
                self._steps.append((at, End()))
            self._cut_off = self._waiting[0].cut_off
            self._steps.append((at, Fly(self._waiting.pop(0), self._last)))
        self._last = message
        if stamp_ns in self._commanded:
            self._steps.append((at, Publish(message, stamp_ns)))
        elif any(first_ns < stamp_ns <= last_ns for first_ns, last_ns in self._flown):
            self._skipped += 1
        else:
            self._steps.append((at, Publish(message)))
        while self._stops and stamp_ns >= self._stops[0]:
            self._stops.pop(0)
            self._steps.append((at, Stop()))

    def _add_status(self, message: Message, codec: Codec) -> None:
        """An older version's status has fewer fields than today's nodes read."""
        data = in_installed_form(message.data, STATUS_TYPE, VehicleStatus, codec)
        self._steps.append((message.log_time_ns, Publish(message._replace(data=data))))

    def _add_command(self, message: Message) -> None:
        if stamp_ns_of(message) not in self._commanded:
            self._steps.append((message.log_time_ns, Publish(message)))

    def _add_output(self, message: Message) -> None:
        recorded = self._outputs.get(_place(message))
        if recorded is None:
            return
        kind = message.type_name
        step: Step | None = None
        if kind == DEMONSTRATION_TYPE:
            step = Demonstrated(recorded) if is_flown(recorded.value) else Publish(message)
        elif kind == ADVICE_TYPE:
            step = Advise(convert_advice.advice_from_msg(recorded.value))
        elif kind == POLICY_TYPE:
            step = Learnt(recorded)
        elif recorded.value.phase in FROM_OUTSIDE:
            step = End()
        if step is not None:
            self._steps.append((message.log_time_ns, step))


def _flown(flight: RecordedFlight, session: RecordedSession) -> tuple[int, int]:
    """Stamps of the last position before a flight and of the last one that it was flown by.

    Zero velocity after a flight bears the stamp of a clock, which may lag behind the positions'.
    """
    poses = set(session.recording.poses.stamps_ns.tolist())
    begin_ns = flight.statuses[0].stamp_ns
    return begin_ns, max((one.stamp_ns for one in flight.commands if one.stamp_ns in poses), default=begin_ns)


def _place(message: Message) -> tuple[str, int, int]:
    return message.topic, message.publish_time_ns, message.log_time_ns


def stamp_ns_of(message: Message) -> int:
    """Of the header, which each of the INPUTS begins with."""
    seconds = int.from_bytes(message.data[4:8], 'little', signed=True)
    return seconds * NS + int.from_bytes(message.data[8:12], 'little')


def in_installed_form(data: bytes, type_name: str, kind: type[Any], codec: Codec) -> bytes:
    """Bytes of a recorded message as today's definition of its type has them; fields that it lacks keep their defaults.

    Args:
        data: CDR bytes by the definition that `codec` knows.
        kind: the installed message class.

    Raises:
        LogError: the bytes do not fit their own definition.
    """
    recorded = codec.decode(data, type_name)
    message = kind()
    _fill(message, recorded)
    return to_cdr(message)


def _fill(message: Any, recorded: Any) -> None:
    """Take over each plain field by its name, and those of nested messages likewise."""
    for name in message.get_fields_and_field_types():
        value = getattr(recorded, name, None)
        if value is None:
            continue
        if hasattr(getattr(message, name), 'get_fields_and_field_types'):
            _fill(getattr(message, name), value)
        else:
            setattr(message, name, value)
