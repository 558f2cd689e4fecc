"""The flights of a policy in a recording: which statuses and commands belong to each, and what the bag lacks of them."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

from advise_ros.core.flight.policy_flight import FlightPhase
from advise_ros.core.units import NS
from advise_ros.replay.session import RecordedMessage, RecordedSession, at

UNDER_WAY = (FlightPhase.TO_START, FlightPhase.FLYING)
# A policy node in flight is never silent for this long: it answers poses, and holds by zero velocity without them.
SILENCE_NS = 2 * NS


class RecordedFlight(NamedTuple):
    """One flight of a policy as the bag holds it.

    Attributes:
        statuses: from its beginning to its end, in order.
        commands: stamped after the last pose before it, up to the last pose of it.
        cut_off: its policy node or the recording ended in the middle of it.
        node_begun_ns: its policy node began about this time of the logger's clock; 0: not known.
        lacks: which messages the bag lacks to rebuild it, in one sentence; '' when it can be rebuilt.
    """

    statuses: tuple[RecordedMessage, ...]
    commands: tuple[RecordedMessage, ...]
    cut_off: bool = False
    node_begun_ns: int = 0
    lacks: str = ''


def flights_of(session: RecordedSession) -> tuple[list[RecordedFlight], int]:
    """The flights, and how many commands belong to none."""
    commands = session.on('cmd_vel')
    all_statuses = session.on('policy/status')
    flights = [
        _flight(session, statuses, commands, _node_begun_ns(all_statuses, statuses[0])) for statuses in _by_flight(all_statuses)
    ]
    return flights, len(commands) - sum(len(flight.commands) for flight in flights)


def _by_flight(statuses: tuple[RecordedMessage, ...]) -> list[tuple[RecordedMessage, ...]]:
    """Statuses of each flight, from the one that begins it to the last one of it."""
    found: list[list[RecordedMessage]] = []
    under_way = False
    for recorded in statuses:
        flies = recorded.value.phase in UNDER_WAY
        if flies and not (under_way and _goes_on(found[-1][-1], recorded)):
            found.append([])
        if flies or (under_way and _number(found[-1][-1]) == _number(recorded)):
            found[-1].append(recorded)
        under_way = flies
    return [tuple(flight) for flight in found]


def _goes_on(before: RecordedMessage, now: RecordedMessage) -> bool:
    """Whether a status is of the same flight as the one before it; a policy node that was started again counts anew."""
    back = before.value.phase == FlightPhase.FLYING and now.value.phase == FlightPhase.TO_START
    return _number(before) == _number(now) and before.value.steps <= now.value.steps and not back


def _number(status: RecordedMessage) -> int:
    return int(getattr(status.value, 'flight_id', 0))


def _node_begun_ns(statuses: tuple[RecordedMessage, ...], first: RecordedMessage) -> int:
    """When the node of a flight began: it is idle at first, and counts its flights from 1."""
    begun_ns = 0
    for earlier, later in pairwise(statuses[: statuses.index(first) + 1]):
        begins = later.value.phase in UNDER_WAY and not (earlier.value.phase in UNDER_WAY and _goes_on(earlier, later))
        if later.value.phase == FlightPhase.IDLE:
            begun_ns = later.message.log_time_ns
        elif _number(later) < _number(earlier) or (begins and _number(later) == _number(earlier)):
            begun_ns = earlier.message.log_time_ns
    return begun_ns


def _flight(
    session: RecordedSession, statuses: tuple[RecordedMessage, ...], commands: tuple[RecordedMessage, ...], node_begun_ns: int,
) -> RecordedFlight:
    first_ns, last_ns = statuses[0].stamp_ns, statuses[-1].stamp_ns
    cut_off = statuses[-1].value.phase in UNDER_WAY
    mine = tuple(one for one in commands if first_ns < one.stamp_ns and (cut_off or one.stamp_ns <= last_ns))
    if cut_off:
        mine = _until_death(mine, statuses[-1], session.on('policy/status'))
    return RecordedFlight(statuses, mine, cut_off, node_begun_ns, _lacks(session, statuses, mine))


def _until_death(
    commands: tuple[RecordedMessage, ...], last: RecordedMessage, statuses: tuple[RecordedMessage, ...],
) -> tuple[RecordedMessage, ...]:
    """The commands before the node of a flight died; those after a silence, or after a word of the next node, are another's.

    Args:
        commands: since the flight began, of whichever node.
        last: the last status of the flight.
        statuses: all of the recording.
    """
    heard_ns = last.message.publish_time_ns
    next_node_ns = min((one.message.publish_time_ns for one in statuses[statuses.index(last) + 1:]), default=math.inf)
    for index, command in enumerate(commands):
        published_ns = command.message.publish_time_ns
        if published_ns >= next_node_ns or published_ns - heard_ns > SILENCE_NS:
            return commands[:index]
        heard_ns = max(heard_ns, published_ns)
    return commands


def _lacks(session: RecordedSession, statuses: tuple[RecordedMessage, ...], commands: tuple[RecordedMessage, ...]) -> str:
    """A flight that was under way before the first pose of the bag began at an unknown position."""
    begin_ns, first = session.first_pose_ns, statuses[0]
    if begin_ns is None or first.stamp_ns >= begin_ns:
        return ''
    return (
        f'flight {_number(first)} was under way when the recording began and is not rebuilt, nor are its {len(commands)} '
        f'commands: the bag lacks {session.pose_topic} and {session.namespace}/cmd_vel from {at(first.stamp_ns)} or earlier '
        f'to {at(begin_ns)}'
    )
