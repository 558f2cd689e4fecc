"""Stage 0: whether the bag holds every message that was written into it."""

from __future__ import annotations

from advise_ros.replay.session import RecordedSession, at
from advise_ros.replay.stage import Comparison, Stage


def completeness_stages(session: RecordedSession, comparison: Comparison) -> list[Stage]:
    """The logger numbers the messages of each topic; a jump is a lost or removed message."""
    if comparison.what_if:
        return []
    stage = Stage('messages kept', checked=session.bag.count, equal=session.bag.count, notes=list(session.bag.notes))
    for gap in session.bag.gaps:
        stage.count(f'{gap.topic} at log time {at(gap.log_time_ns)}: {gap.missing} messages before it are missing')
    return [stage]
