"""Stage 1: positions and commands -> demonstrations, and where the flights begin and end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from advise_ros.config import RecorderConfig
from advise_ros.core.demonstrations.demonstration import CLIMB_MISSED, Demonstration, EndReason, with_missed_climb
from advise_ros.core.demonstrations.discretise import discretise
from advise_ros.core.demonstrations.epochs import divide
from advise_ros.core.demonstrations.recorded_flights import Flown, demonstration_of, split, why_not
from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.messages import Bag
from advise_ros.replay.session import RecordedMessage, RecordedSession, at
from advise_ros.replay.stage import Comparison, Stage
from advise_ros.ros import convert
from advise_ros.ros.receivers import counted

# How the recorder names positions that it had from a topic.
TOPIC_SOURCE = 'topic '


def demonstration_stages(session: RecordedSession, comparison: Comparison) -> list[Stage]:
    """Rebuild each demonstration within its window, and the windows from the vehicle's state."""
    stage = Stage('demonstrations')
    recorded = session.on('demonstration')
    early = {id(one): lacks for one in recorded if is_flown(one.value) and (lacks := lacks_of(session, one))}
    stage.notes += early.values()
    flown = [one for one in recorded if is_flown(one.value) and id(one) not in early]
    config = session.config(RecorderConfig, 'recorder') if flown else RecorderConfig()
    for one in recorded:
        if is_flown(one.value) and id(one) not in early:
            _compare(stage, session, comparison, config, one)
        else:
            comparison.rebuilt.demonstrations.append(_taken(session, one))
    taken_back = sum(not len(one.value.states) for one in recorded)
    if taken_back:
        stage.notes.append(f'{taken_back} demonstration{" was" if taken_back == 1 else "s were"} taken back by recorder/discard')
    elsewhere = len(recorded) - len(flown) - len(early) - taken_back
    if elsewhere:
        stage.notes.append(f'{elsewhere} demonstrations were not flown in this bag and are taken as they are')
    if comparison.what_if:
        return [stage]
    if not stage.agrees:
        stage.notes += commands_missed(session, flown)
    return [stage, *([_windows(session, config, flown)] if flown and config.split == 'flights' else [])]


def is_flown(value: Any) -> bool:
    """It was made from topics, not on the grid model or from a file, and is not the taking back of another."""
    return str(value.source).startswith(TOPIC_SOURCE) and value.audit.samples > 0


def lacks_of(session: RecordedSession, one: RecordedMessage) -> str:
    """What the bag lacks of a flight that began before its first pose, which it has from a recorder that keeps it."""
    start_ns, end_ns = (convert.stamp_to_ns(stamp) for stamp in (one.value.window_start, one.value.window_end))
    stamps_ns = session.recording.poses.stamps_ns
    begin_ns = session.first_pose_ns
    if begin_ns is not None and start_ns >= begin_ns:
        return ''
    held = int(((stamps_ns >= start_ns) & (stamps_ns <= end_ns)).sum())
    upto_ns = end_ns if begin_ns is None else min(end_ns, begin_ns)
    return (
        f'{one.value.demonstration_id} was flown before the recording began and is taken as it is: the bag lacks '
        f'{one.value.audit.samples - held} messages on {session.pose_topic}, and those on {session.namespace}/cmd_vel, '
        f'from {at(start_ns)} to {at(upto_ns)}'
    )


def _taken(session: RecordedSession, one: RecordedMessage) -> Demonstration | None:
    """One that is not rebuilt, as it is; None where no learner would take it, or it lies on another grid."""
    try:
        published = convert.demonstration_from_msg(one.value)
        grid = session.grid(published.grid)
    except (InputError, ValueError):
        return None
    if grid == published.grid or not published.states:
        return replace(published, grid=grid)
    return None


def _compare(
    stage: Stage, session: RecordedSession, comparison: Comparison, config: RecorderConfig, one: RecordedMessage,
) -> None:
    try:
        rebuilt = _rebuilt(session, config, one.value)
    except (InputError, ValueError) as problem:  # An index or an enum that no recorder would publish.
        comparison.rebuilt.demonstrations.append(None)
        stage.count(f'{one.where}: {problem}')
        return
    comparison.rebuilt.demonstrations.append(rebuilt)
    comparison.count(stage, convert.demonstration_to_msg(rebuilt), one)


def _rebuilt(session: RecordedSession, config: RecorderConfig, value: Any) -> Demonstration:
    published = convert.demonstration_from_msg(value)
    grid = session.grid(published.grid)
    window_ns, end_reason = published.window_ns, published.end_reason
    if session.overrides:  # Elsewhere the flight may end later: look at all of it.
        flights = [one.flight for one in _flights(session, config, grid)]
        whole = [flight for flight in flights if flight.window_ns[0] <= window_ns[1] and flight.window_ns[1] >= window_ns[0]]
        if whole and end_reason != EndReason.STOPPED:
            window_ns, end_reason = whole[0].window_ns, whole[0].end_reason
    found = discretise(
        grid,
        _part(session.recording, window_ns)._replace(source=published.source),
        window_ns,
        config.discretise_settings(),
        published.demonstration_id,
        end_reason,
    )
    # The bag may hold what the recorder did not receive.
    return with_missed_climb(found) if CLIMB_MISSED in published.audit.notes else found


def _windows(session: RecordedSession, config: RecorderConfig, flown: list[RecordedMessage]) -> Stage:
    """Each demonstration must be one of the flights that the vehicle's state and altitude show."""
    stage = Stage('flight windows')
    try:
        grid = convert.grid_from_msg(flown[0].value.grid)
    except InputError as problem:
        stage.count(f'{flown[0].where}: {problem}')
        return stage
    flights = _flights(session, config, grid)
    cut = [demonstration_of(grid, one.part, one.flight, config.discretise_settings(), '') for one in flights]
    windows = {demonstration.window_ns[0]: demonstration for demonstration in cut}
    stopped = [one for one in flown if one.value.end_reason == EndReason.STOPPED]
    missed = [one for one in flown if CLIMB_MISSED in one.value.audit.notes and one not in stopped]
    for one in flown:
        if one not in stopped and one not in missed:
            stage.count(_window_difference(one, windows, flights))
    if stopped:
        windows_were = '1 window was' if len(stopped) == 1 else f'{len(stopped)} windows were'
        stage.notes.append(f'{windows_were} ended by recorder/stop and taken as recorded: a call is an input')
    if missed:
        windows_begin = '1 window begins' if len(missed) == 1 else f'{len(missed)} windows begin'
        stage.notes.append(f'{windows_begin} in mid-flight, where the recorder began, and taken as recorded')
    without = sum(not why_not(one, of.flight, manual=False) for one, of in zip(cut, flights, strict=True)) - len(flown)
    if without > 0:
        flights_have = 'flight along the route has' if without == 1 else 'flights along the route have'
        stage.notes.append(f'{without} {flights_have} no demonstration: discarded, or begun before the recorder')
    return stage


def _flights(session: RecordedSession, config: RecorderConfig, grid: Grid) -> tuple[Flown, ...]:
    return split(grid, session.recording, config.altitude_tolerance_m, policy_flights=config.policy_flights)


def _part(recording: Recording, window_ns: tuple[int, int]) -> Recording:
    """The part of one clock that has a position at the beginning of a window."""
    parts = divide(recording).parts
    return next((part for part in reversed(parts) if window_ns[0] in part.poses.stamps_ns), parts[-1])


def _window_difference(one: RecordedMessage, windows: dict[int, Demonstration], flights: tuple[Flown, ...]) -> str:
    start_ns, end_ns = (convert.stamp_to_ns(stamp) for stamp in (one.value.window_start, one.value.window_end))
    rebuilt = windows.get(start_ns)
    if rebuilt is None:
        begins = ', '.join(at(one.flight.window_ns[0]) for one in flights) or 'none'
        return f'{one.where}: window_start is {at(start_ns)}, expected the beginning of a flight ({begins})'
    if rebuilt.window_ns[1] != end_ns:
        return f'{one.where}: window_end is {at(end_ns)}, expected {at(rebuilt.window_ns[1])}'
    if int(rebuilt.end_reason) != one.value.end_reason:
        return f'{one.where}: end_reason is {one.value.end_reason}, expected {rebuilt.end_reason.name}'
    return ''


DIAGNOSTICS_TYPE = 'diagnostic_msgs/msg/DiagnosticArray'
# Commands that were on their way to one of them when the recorder published its count.
ON_THEIR_WAY = 10


def commands_missed(session: RecordedSession, demonstrations: Sequence[RecordedMessage]) -> list[str]:
    """A sentence on the first demonstration by which the recorder had counted other commands than the bag holds."""
    topic = f'{session.namespace}/cmd_vel'
    commands_ns = [message.log_time_ns for message in session.bag.on(topic)]
    reports = _recorder_counts(session, topic)
    for one in demonstrations:
        at_ns, received = next((pair for pair in reports if pair[0] >= one.message.log_time_ns), (0, 0))
        held = sum(time_ns <= at_ns for time_ns in commands_ns)
        if at_ns and abs(received - held) > ON_THEIR_WAY:
            counts = f'the recorder had counted {received} commands and the bag holds {held}'
            late = 'recorder' if received < held else 'logger'
            why = f'the {late} did not receive them all, perhaps because it found their sender late'
            return [f'by the end of {one.value.demonstration_id} {counts}: {why}']
    return []


def _recorder_counts(session: RecordedSession, topic: str) -> list[tuple[int, int]]:
    """Log time [ns] and the recorder's count, as often as it said it; only a difference makes us read that."""
    bag, recorder = Bag(session.bag.path, (DIAGNOSTICS_TYPE,)), f'{session.namespace}/recorder'
    return [
        (message.log_time_ns, counted(status, topic))
        for message in bag.on('/diagnostics') for status in bag.decode(message).status
        if status.name == recorder and any(pair.key == topic for pair in status.values)
    ]
