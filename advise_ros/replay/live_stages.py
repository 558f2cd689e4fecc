"""What the real nodes published, beside what the bag says was published."""

from __future__ import annotations

from typing import Any

from advise_ros.replay.decisions import decision
from advise_ros.replay.demonstrations import is_flown
from advise_ros.replay.flights import FROM_OUTSIDE, flights_of
from advise_ros.replay.live import Live, PublishedLive
from advise_ros.replay.session import RecordedMessage, RecordedSession
from advise_ros.replay.stage import Comparison, Stage
from advise_ros.ros import convert
from advise_ros.ros.private_domain import private_domain

# Positions are best effort, and what the middleware loses says nothing of the nodes.
MOST_AGAIN = 3


def live_stages(session: RecordedSession, *, speed: float, domain: int | None = None) -> tuple[Stage, ...]:
    """Have the nodes live through the session again and compare.

    Args:
        session: the recording.
        speed: recorded seconds a second, at most.
        domain: ROS domain; None: a private one.

    Raises:
        InputError, AdviseError: as Live and private_domain.
    """
    if domain is None:
        with private_domain() as found:
            return live_stages(session, speed=speed, domain=found)
    again: list[str] = []
    while True:
        with Live(session, speed=speed, domain=domain) as live:
            live.play()
            live.settle()
            stages = _compared(session, live.published)
        if not live.lost or len(again) == MOST_AGAIN:
            stages[0].notes.extend((*again, *live.score.notes, *live.late))
            return tuple(stages)
        again.append(f'{live.lost} messages were lost on their way to the recorder: the session was lived through again')


def _compared(session: RecordedSession, published: PublishedLive) -> list[Stage]:
    comparison = Comparison(session)
    return [
        _demonstrations(session, published, comparison),
        _in_order('policies', session.on('advise/policy'), published.policies, comparison),
        _in_order('queries', session.on('advise/query'), published.queries, comparison),
        _commands(session, published, comparison),
        _statuses(session, published),
    ]


def _demonstrations(session: RecordedSession, published: PublishedLive, comparison: Comparison) -> Stage:
    stage = Stage('demonstrations, live')
    found = {(one.demonstration_id, convert.stamp_to_ns(one.window_end)): one for one in published.demonstrations}
    for one in session.on('demonstration'):
        if is_flown(one.value):
            key = (one.value.demonstration_id, convert.stamp_to_ns(one.value.window_end))
            _count(stage, found.get(key), one, comparison)
    return stage


def _in_order(name: str, recorded: tuple[RecordedMessage, ...], published: list[Any], comparison: Comparison) -> Stage:
    """One by one; their stamps come from a clock and are taken as recorded."""
    stage = Stage(f'{name}, live')
    for index, one in enumerate(recorded):
        found = published[index] if index < len(published) else None
        if found is not None:
            found.header.stamp = convert.stamp_from_ns(one.stamp_ns)
        _count(stage, found, one, comparison)
    if len(published) > len(recorded):
        stage.notes.append(f'{len(published) - len(recorded)} more {name} than in the bag came live')
    return stage


def _commands(session: RecordedSession, published: PublishedLive, comparison: Comparison) -> Stage:
    stage = Stage('commands, live')
    poses = set(session.recording.poses.stamps_ns.tolist())
    for one in (command for flight in flights_of(session)[0] for command in flight.commands):
        if one.stamp_ns in poses:  # The others are the watchdog's, by the clock on the wall.
            _count(stage, published.commands.get(one.stamp_ns), one, comparison)
    return stage


def _statuses(session: RecordedSession, published: PublishedLive) -> Stage:
    stage = Stage('flight statuses, live')
    kind = 'advise_msgs/msg/FlightStatus'
    found = {(convert.stamp_to_ns(one.header.stamp), repr(decision(one, kind))) for one in published.statuses}
    for one in (status for flight in flights_of(session)[0] for status in flight.statuses):
        if one.value.phase not in FROM_OUTSIDE:
            there = (one.stamp_ns, repr(decision(one.value, kind))) in found
            stage.count('' if there else f'{one.where}: phase {one.value.phase} in state {one.value.state} did not come live')
    return stage


def _count(stage: Stage, found: Any | None, recorded: RecordedMessage, comparison: Comparison) -> None:
    if found is None:
        stage.count(f'{recorded.where}: nothing came live')
    else:
        comparison.count(stage, found, recorded)
