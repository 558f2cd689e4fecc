"""The answers so far and what each has bought, over restarts of the learner."""

from __future__ import annotations

from typing import Any

from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.recording.sessionfile import LogEntry


class AdviceHistory:
    """The advice log as it was heard, in order.

    A learner that is started again sends the whole log again, or another one: what is known is not taken twice, and
    an entry that contradicts what is known begins the log of another session.

    Attributes:
        entries: those of the session.
        since: entries of the log that the first policy heard here was learnt from; what they bought is not known.
        gains: what the entries after that have bought, by the number of the newest that a policy was learnt from.
    """

    def __init__(self) -> None:
        self.entries: list[LogEntry] = []
        self.since: int | None = None
        self.gains: dict[int, dict[str, Any]] = {}

    def add(self, record: AdviceRecord, stamp_ns: int) -> bool:
        """Take an entry; False when it is known."""
        before = {(one.record.advice_id, one.record.retracted): one.stamp_ns for one in self.entries}
        known_ns = before.get((record.advice_id, record.retracted))
        if known_ns == stamp_ns:
            return False
        if known_ns is not None:
            self.clear()
        self.entries.append(LogEntry(record, stamp_ns))
        return True

    def clear(self) -> None:
        """Another session has begun."""
        self.entries.clear()
        self.gains.clear()
        self.since = None

    def begin(self, log_length: int) -> None:
        """A policy is heard; what the log had bought by the first one is not known here."""
        if self.since is None:
            self.since = log_length

    def learnt(self, log_length: int, changed: int, outlook: dict[str, Any]) -> None:
        """A policy was learnt from so much of the log, `changed` states act otherwise than before."""
        self.gains[log_length] = {'entry': log_length, 'changed': changed, **outlook}

    def view(self) -> dict[str, Any]:
        """What the page shows of it."""
        return {'since': self.since or 0, 'gains': [self.gains[entry] for entry in sorted(self.gains)]}
