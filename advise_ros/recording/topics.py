"""Which topics of a bag hold one vehicle's positions, commands and state: chosen by what is on them, then by their names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from advise_ros.core.errors import LogError
from advise_ros.recording import px4
from advise_ros.recording.climbs import those_that_fly
from advise_ros.recording.columns import ON_EARTH, POSITION_TARGET
from advise_ros.recording.states import EVENT_OF, STATES

# ArduPilot's DDS sends positions east-north-up from its origin and calls their frame base_link all the same.
ARDUPILOT_POSES, ARDUPILOT_FRAME = ('ap/pose/filtered', 'ap/v1/pose/filtered'), 'base_link'
# A vehicle's frame among the transforms of a bag counts as a topic of its name, where there are no other positions.
FRAME_TYPE, VEHICLE_FRAMES = 'frame of tf', ('base_link', 'base_footprint')
POSE_TYPES = (
    'geometry_msgs/msg/PoseStamped', 'nav_msgs/msg/Odometry', 'geometry_msgs/msg/PoseWithCovarianceStamped',
    'geometry_msgs/msg/TransformStamped', *px4.TYPES, FRAME_TYPE, *ON_EARTH,
)
STAMPED, PLAIN = 'geometry_msgs/msg/TwistStamped', 'geometry_msgs/msg/Twist'
# Setpoints of MAVROS and PX4, where they ask for a velocity.
SETPOINT_TYPES = (POSITION_TARGET, px4.SETPOINT)
COMMAND_TYPES = (STAMPED, PLAIN, *SETPOINT_TYPES)
POLICY_TYPE = 'advise_msgs/msg/FlightStatus'
# Where positions are looked for: those of an earlier row before those of a later one.
POSITIONS = (
    ('/pose',),
    ('local_position/pose', 'local_position/odom'),
    ('pose', 'odom', *ARDUPILOT_POSES, *px4.TOPICS),
    ('global_position/global', 'geopose/filtered', 'navsat', 'fix'),
)
COMMANDS, SETPOINTS = ('cmd_vel', 'cmd_vel_unstamped'), ('setpoint_raw/local', 'fmu/in/trajectory_setpoint')
# Nodes that stand between a vehicle's namespace and its topics.
BRIDGES = ('mavros', 'uas')
# A topic so named says where something shall be, not where the vehicle is.
WISHES = re.compile(r'goal|target|setpoint|desired|reference|command|cmd|plan', re.IGNORECASE)


class BagTopics(NamedTuple):
    """The topics to read: a name without '/' in front is looked for in any namespace.

    Attributes:
        pose: of positions; () for those in POSITIONS, or else any topic with positions.
        command: of commanded velocities, '' for COMMANDS, or else SETPOINTS.
        status: of the vehicle's state, '' as recording/states.py says.
        policy: of a policy's flights.
        required: which of 'command' and 'status' the bag must have.
        vehicle: namespace of the vehicle, '' for any.
        frame: the frame of positions that is the grid's map, besides 'map'.
        frame_at: where that frame lies on the grid: east, north, up [m] and its yaw [deg], counter-clockwise; () for 0.
        as_stamped: believe the stamps of commands, as the recorder did.
    """

    pose: tuple[str, ...] = ()
    command: str = ''
    status: str = ''
    policy: str = 'policy/status'
    required: tuple[str, ...] = ()
    vehicle: str = ''
    frame: str = ''
    frame_at: tuple[float, ...] = ()
    as_stamped: bool = False


DEFAULT_TOPICS = BagTopics()


class Held(NamedTuple):
    """What is on a topic.

    Attributes:
        messages: how many.
        climb_m: of positions: the highest less the lowest.
    """

    type_name: str
    messages: int
    climb_m: float = 0.0


class ChosenTopics(NamedTuple):
    """One vehicle's topics; '' where the bag has none.

    Attributes:
        unused: topics with positions or commands that were not chosen.
    """

    pose: str
    command: str
    status: str
    policy: str
    unused: tuple[str, ...]

    def __str__(self) -> str:
        kinds = ('positions', self.pose), ('commands', self.command), ('state', self.status)
        return ', '.join(f'{kind} {topic or "none"}' for kind, topic in kinds)


class _Candidate(NamedTuple):
    """A topic with positions: the row and the place of its name in POSITIONS, and the vehicle's namespace."""

    row: int
    rank: int
    vehicle: str
    topic: str


def full_name(topic: str) -> str:
    """The one form of a topic's name: 'pose' and '/pose/' are '/pose'."""
    return '/' + topic.strip('/')


def is_named(topic: str, name: str) -> bool:
    """Whether a topic (in its one form) goes by a name; see BagTopics."""
    return topic == full_name(name) or (not name.startswith('/') and topic.endswith('/' + name.strip('/')))


def choose_topics(path: object, held: Mapping[str, Held], asked: BagTopics) -> ChosenTopics:
    """The topics to take.

    Silent topics are passed over. Positions: of the vehicles that fly; of those the first of POSITIONS, or else any
    topic with positions whose name does not say that it is a goal. What goes with them lies in the namespace of the
    positions or nearest around it, or is the only one of that vehicle: never one of another vehicle.

    Args:
        path: of the bag, for people.
        held: by the topics' names in their one form.
        asked: what people named.

    Raises:
        LogError: there are no positions, several vehicles fly, or a required topic is missing.
    """
    candidates = _candidates(held, asked)
    pose = _positions(path, held, asked, candidates)
    others = {one.vehicle for one in candidates if one.vehicle} - {pose.vehicle}

    def beside(names: Sequence[str], kinds: Iterable[str]) -> str:
        there = {topic: one.messages for topic, one in held.items() if one.type_name in kinds and one.messages}
        return _beside(pose, names, there, others)

    commands = ((asked.command,),) if asked.command else (COMMANDS, SETPOINTS)
    command = next(filter(None, (beside(names, COMMAND_TYPES) for names in commands)), '')
    states = [((asked.status,), EVENT_OF)] if asked.status else [((name,), (kind,)) for kind, name in STATES]
    status = next(filter(None, (beside(*state) for state in states)), '')
    for kind, topic in (('command', command), ('status', status)):
        if kind in asked.required and not topic:
            wanted = ' or '.join(COMMAND_TYPES if kind == 'command' else EVENT_OF)
            raise LogError(
                f"{path} has no {wanted} on a topic '{getattr(asked, kind)}'; it has {_listed(held)}: "
                f'name the right one (--{kind}-topic)'
            )
    unused = tuple(
        topic for topic, one in sorted(held.items()) if one.messages and _is_worth_naming(one, topic, pose.topic, command)
    )
    return ChosenTopics(pose.topic, command, status, beside((asked.policy,), (POLICY_TYPE,)), unused)


def _is_worth_naming(held: Held, topic: str, pose: str, command: str) -> bool:
    if held.type_name in COMMAND_TYPES:
        return topic != command and (not command or topic.rsplit('/', 1)[-1] in COMMANDS)
    return held.type_name in POSE_TYPES and held.type_name not in ON_EARTH and topic != pose


# -- positions -------------------------------------------------------------------------------------
def _candidates(held: Mapping[str, Held], asked: BagTopics) -> list[_Candidate]:
    """Topics whose names are looked for, or else all with positions."""
    rows = (asked.pose,) if asked.pose else POSITIONS
    names = [(row, name) for row, several in enumerate(rows) for name in several]
    found = []
    for topic, one in held.items():
        rank = next((rank for rank, (_, name) in enumerate(names) if is_named(topic, name)), None)
        if one.type_name in POSE_TYPES and rank is not None:
            row, name = names[rank]
            found.append(_Candidate(row, rank, _vehicle_of(topic, name), topic))
    found = [one for one in found if _is_of(one.topic, asked.vehicle)]
    if asked.pose or any(held[one.topic].messages for one in found):
        return found
    return [
        _Candidate(len(rows), len(names), _vehicle_of(topic, topic.rsplit('/', 1)[-1]), topic)
        for topic, one in held.items()
        if one.type_name in POSE_TYPES and not WISHES.search(topic) and _is_of(topic, asked.vehicle)
    ]


def _vehicle_of(topic: str, name: str) -> str:
    """The namespace of the vehicle whose topic goes by a name."""
    parts = topic.removesuffix(full_name(name)).split('/')
    return '/'.join(parts[:-1] if parts[-1] in BRIDGES else parts)


def _is_of(topic: str, vehicle: str) -> bool:
    return not vehicle or topic.startswith(full_name(vehicle) + '/')


def _positions(path: object, held: Mapping[str, Held], asked: BagTopics, candidates: list[_Candidate]) -> _Candidate:
    left = [one for one in candidates if held[one.topic].messages]
    if not left and asked.pose and candidates:
        raise LogError(f'{path} has no message on {candidates[0].topic}; it has {_listed(held)}: name another (--pose-topic)')
    if not left:
        wanted = ' or '.join(f"'{name}'" for name in asked.pose or [name for row in POSITIONS for name in row])
        of = f' of vehicle {asked.vehicle}' if asked.vehicle else ''
        raise LogError(
            f'{path} has no positions{of} on a topic {wanted}; it has {_listed(held)}: name the right one (--pose-topic)'
        )
    left = those_that_fly(left, lambda one: held[one.topic].climb_m)
    row = min(one.row for one in left)
    left = [one for one in left if one.row == row]
    left = [one for one in left if not any(_stands_for(other, one) for other in left)]
    exact = [one for one in left if one.topic in map(full_name, asked.pose)] or left
    if len(exact) == 1:
        return exact[0]
    several = ', '.join(sorted(one.topic for one in left))
    vehicles = sorted(one.vehicle.strip('/') for one in left if one.vehicle)
    or_vehicle = f', or its vehicle (--vehicle {" or ".join(vehicles)})' if vehicles else ''
    raise LogError(f'{path} has positions on {several}; name one of them in full (--pose-topic){or_vehicle}')


def _stands_for(one: _Candidate, other: _Candidate) -> bool:
    """Both are of one vehicle, and its name comes first."""
    inside = other.vehicle == one.vehicle or (one.vehicle != '' and other.vehicle.startswith(one.vehicle + '/'))
    return inside and (one.rank, one.topic) < (other.rank, other.topic)


# -- what goes with them ---------------------------------------------------------------------------
def _beside(pose: _Candidate, names: Sequence[str], there: Mapping[str, int], others: set[str]) -> str:
    """The topic of those names in the namespace of the positions or nearest around it, or the busiest of the vehicle."""
    matches = {topic: count for topic, count in there.items() if any(is_named(topic, name) for name in names)}
    namespace = pose.topic
    while namespace:
        namespace = namespace.rsplit('/', 1)[0]
        for name in names:
            if namespace + full_name(name) in matches:
                return namespace + full_name(name)
    if any(name.startswith('/') for name in names):
        return max(matches, default='')
    inside = [topic for topic in matches if topic.startswith(pose.vehicle + '/') and not _is_others(topic, pose.vehicle, others)]
    return max(sorted(inside), key=lambda topic: matches[topic], default='')


def _is_others(topic: str, vehicle: str, others: set[str]) -> bool:
    """It lies in the namespace of another vehicle, or in one that is named like one of several."""
    first = topic[len(vehicle) + 1 :].split('/', maxsplit=1)[0]
    return any(topic.startswith(other + '/') for other in others) or (not vehicle and first[-1:].isdigit())


def _listed(held: Mapping[str, Held]) -> str:
    topics = (f'{topic} ({one.type_name}{"" if one.messages else ", silent"})' for topic, one in sorted(held.items()))
    return ', '.join(topics) or 'no topics'
