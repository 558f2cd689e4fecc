"""A line that keeps the order of what it carries, and is late: not at all, steadily, more and more, or by jitter."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np

LONGEST_S = 10.0
KINDS = ('none', 'steady', 'growing', 'jitter')
# The longest delay grows within a minute.
GROWTH_S = 60.0


class LateLine:
    """Hands on what it is given, in order.

    Args:
        rng: draws when a steady delay begins, and each delay of a line that jitters.
        kind: one of KINDS.
        base_s: of every message.
        longest_s: what comes to it at most.
        lasting_s: of the episode; a steady delay begins in its first half.
    """

    def __init__(self, rng: np.random.Generator, kind: str, base_s: float, longest_s: float, lasting_s: float) -> None:
        self._rng, self._kind, self._base_s, self.longest_s = rng, kind, base_s, longest_s if kind != 'none' else 0.0
        self._begins_s = float(rng.uniform(0.0, lasting_s / 2.0))
        self._drawn_s, self._drawn_until_s = 0.0, 0.0
        self._last_s = 0.0
        self._waiting: deque[tuple[float, Any]] = deque()

    def put(self, what: Any, now_s: float) -> None:
        """It is sent now."""
        self._last_s = max(self._last_s, now_s + self._base_s + self._delay_s(now_s))
        self._waiting.append((self._last_s, what))

    def _delay_s(self, now_s: float) -> float:
        if self._kind == 'growing':
            return min(self.longest_s, LONGEST_S / GROWTH_S * max(0.0, now_s - self._begins_s))
        if self._kind == 'jitter':
            if now_s >= self._drawn_until_s:
                self._drawn_s = float(self._rng.uniform(0.0, self.longest_s))
                self._drawn_until_s = now_s + float(self._rng.uniform(0.05, 3.0))
            return self._drawn_s
        return self.longest_s if self._kind == 'steady' and now_s >= self._begins_s else 0.0

    def take(self, now_s: float) -> list[tuple[float, Any]]:
        """What has arrived by now, each with the time when it did."""
        taken = []
        while self._waiting and self._waiting[0][0] <= now_s:
            taken.append(self._waiting.popleft())
        return taken
