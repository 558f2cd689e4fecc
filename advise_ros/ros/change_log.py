"""Logs each change of a node's condition once: when it begins, when its reason changes, and when it ends."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import Protocol

# A condition that comes back within this is the same one still; its end is not logged.
QUIET_S = 1.0
# One that has to last before it is logged may pause for this long meanwhile.
PAUSE_S = 0.2
# Conditions of normal flight (a speed that is limited) are logged when they last for this long.
LASTING_S = 2.0
# Figures in a sentence change all the time and are no news.
FIGURES = re.compile(r'-?\d[\d.]*')


class MessageLog(Protocol):
    """What is needed of a node's logger."""

    def info(self, message: str) -> object: ...

    def warning(self, message: str) -> object: ...


@dataclass
class Condition:
    """What is known of one condition.

    Attributes:
        since_s: it has been there since; inf while it is not.
        seen_s: it was there last.
        logged: sentences of this time, without their figures.
    """

    since_s: float = math.inf
    seen_s: float = -math.inf
    logged: set[str] = field(default_factory=set)


class ChangeLog:
    """Writes changes to a node's log; call `note` as often as you like. Times are steady.

    Example:
        log.note('doubt', verdict.reason, now_s)    # '' when there is none
    """

    def __init__(self, logger: MessageLog) -> None:
        self._to = logger
        self._conditions: dict[str, Condition] = {}

    def note(self, name: str, sentence: str, now_s: float, *, lasting_s: float = 0.0, calm: bool = False) -> bool:
        """Log a condition that begins or changes by its sentence, and its end.

        Returns:
            Whether it is there and was logged, so that it may be shown as a warning without flicker.

        Args:
            name: of the condition, as its end is logged: 'NAME is over after 3.2 s'.
            sentence: what it is now; '' when there is none. Another figure in it is no change.
            lasting_s: it is logged when it lasts for this long.
            calm: whether it is normal (INFO) and no WARN.
        """
        condition = self._conditions.setdefault(name, Condition())
        if sentence:
            self._begin(condition, sentence, now_s, lasting_s, calm=calm)
        elif condition.since_s < math.inf and now_s - condition.seen_s >= QUIET_S:
            if condition.logged:
                self._to.info(f'{name} is over after {condition.seen_s - condition.since_s:.1f} s')
            self._conditions[name] = condition = Condition()
        return bool(condition.logged)

    def _begin(self, condition: Condition, sentence: str, now_s: float, lasting_s: float, *, calm: bool) -> None:
        paused = not condition.logged and now_s - condition.seen_s > PAUSE_S
        condition.since_s = now_s if lasting_s > 0.0 and paused else min(condition.since_s, now_s)
        condition.seen_s = now_s
        what = FIGURES.sub('#', sentence)
        if now_s - condition.since_s < lasting_s or what in condition.logged:
            return
        condition.logged.add(what)
        if calm:
            self._to.info(sentence)
        else:
            self._to.warning(sentence)

    def now(self, name: str, sentence: str, *, calm: bool = True) -> None:
        """Log something that happens at one moment if it differs from the last of its name ('owner', 'link')."""
        condition = self._conditions.setdefault(name, Condition())
        if sentence in condition.logged or not sentence:
            return
        condition.logged = {sentence}
        if calm:
            self._to.info(sentence)
        else:
            self._to.warning(sentence)
