"""A line that keeps the order of what it carries, and is late: not at all, steadily, more and more, by jitter or stalls."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np

from support.delays import Delay, Queue, growing, stalling, steady

LONGEST_S = 10.0
KINDS = ('none', 'steady', 'growing', 'jitter', 'stalls')
# The longest delay grows within a minute.
GROWTH = LONGEST_S / 60.0


def wandering(longest_s: float, rng: np.random.Generator) -> Delay:
    """Another delay every 0.05 to 3 s."""
    drawn_s = until_s = 0.0

    def delay(since_s: float) -> float:
        nonlocal drawn_s, until_s
        if since_s >= until_s:
            drawn_s, until_s = float(rng.uniform(0.0, longest_s)), since_s + float(rng.uniform(0.05, 3.0))
        return drawn_s

    return delay


def delay_of(kind: str, longest_s: float, rng: np.random.Generator) -> Delay:
    """One of KINDS, of at most so many seconds."""
    if kind == 'jitter':
        return wandering(longest_s, rng)
    if kind == 'stalls':
        return stalling(longest_s + float(rng.uniform(0.0, LONGEST_S)), longest_s)
    return {'none': steady(0.0), 'steady': steady(longest_s), 'growing': growing(GROWTH, longest_s)}[kind]


class LateLine:
    """Hands on what it is given, in order.

    Args:
        rng: draws when a delay begins, and each delay of a line that jitters.
        kind: one of KINDS.
        base_s: of every message.
        longest_s: what comes to it at most.
        lasting_s: of the episode; a delay begins in its first half.
    """

    def __init__(self, rng: np.random.Generator, kind: str, base_s: float, longest_s: float, lasting_s: float) -> None:
        self.kind = kind
        self.longest_s = longest_s if kind != 'none' else 0.0
        self._base_s, self._begins_s = base_s, float(rng.uniform(0.0, lasting_s / 2.0))
        self._later = delay_of(kind, self.longest_s, rng)
        self._queue = Queue(steady(0.0), 0.0)
        self._waiting: deque[tuple[float, Any]] = deque()

    def put(self, what: Any, now_s: float) -> None:
        """It is sent now."""
        if self._queue.delay is not self._later and now_s >= self._begins_s:
            self._queue = self._queue.changed(self._later, now_s)
        self._waiting.append((self._queue.due_s(now_s + self._base_s), what))

    def take(self, now_s: float) -> list[tuple[float, Any]]:
        """What has arrived by now, each with the time when it did."""
        taken = []
        while self._waiting and self._waiting[0][0] <= now_s:
            taken.append(self._waiting.popleft())
        return taken
