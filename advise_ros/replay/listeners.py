"""Whether the recorder and the logger heard the same commands: a demonstration is made by one, checked by the other."""

from __future__ import annotations

from collections.abc import Sequence

from advise_ros.recording.messages import Bag
from advise_ros.replay.session import RecordedMessage, RecordedSession
from advise_ros.ros.hearing import counted

DIAGNOSTICS_TYPE = 'diagnostic_msgs/msg/DiagnosticArray'
# Commands that were on their way to one of them when the recorder told its count.
ON_THEIR_WAY = 10


def heard_otherwise(session: RecordedSession, demonstrations: Sequence[RecordedMessage]) -> list[str]:
    """A sentence on the first demonstration by which the recorder had counted other commands than the bag holds."""
    topic = f'{session.namespace}/cmd_vel'
    commands_ns = [message.log_time_ns for message in session.bag.on(topic)]
    told = _told(session, topic)
    for one in demonstrations:
        at_ns, heard = next((pair for pair in told if pair[0] >= one.message.log_time_ns), (0, 0))
        held = sum(time_ns <= at_ns for time_ns in commands_ns)
        if at_ns and abs(heard - held) > ON_THEIR_WAY:
            counts = f'the recorder had counted {heard} commands and the bag holds {held}'
            late = 'recorder' if heard < held else 'logger'
            why = f'the {late} did not hear them all, perhaps because it found their sender late'
            return [f'by the end of {one.value.demonstration_id} {counts}: {why}']
    return []


def _told(session: RecordedSession, topic: str) -> list[tuple[int, int]]:
    """Log time [ns] and the recorder's count, as often as it said it; only a difference makes us read that."""
    bag, recorder = Bag(session.bag.path, (DIAGNOSTICS_TYPE,)), f'{session.namespace}/recorder'
    return [
        (message.log_time_ns, counted(status, topic))
        for message in bag.on('/diagnostics') for status in bag.decode(message).status
        if status.name == recorder and any(pair.key == topic for pair in status.values)
    ]
