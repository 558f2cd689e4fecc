"""Goals that lack something which may still come."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from rclpy.task import Future

from advise_msgs.action import Fly

# A goal waits this long for a policy or a pose before it is refused.
START_PATIENCE_S = 1.0


class _Waiting(NamedTuple):
    goal: Fly.Goal
    until_s: float
    over: Future


class GoalPatience:
    """Lets goals wait a little; `look` must be called meanwhile.

    Args:
        missing: what a goal lacks now, '' if nothing.
    """

    def __init__(self, missing: Callable[[Fly.Goal], str]) -> None:
        self._missing = missing
        self._waiting: list[_Waiting] = []

    @property
    def waits(self) -> bool:
        """Some goal does."""
        return bool(self._waiting)

    async def wait(self, goal: Fly.Goal) -> None:
        """Until nothing is missing any more, or for START_PATIENCE_S of steady time."""
        waiting = _Waiting(goal, time.monotonic() + START_PATIENCE_S, Future())
        self._waiting.append(waiting)
        await waiting.over

    def look(self, now_s: float) -> None:
        """End the waits that are over."""
        for waiting in self._waiting:
            if now_s > waiting.until_s or not self._missing(waiting.goal):
                waiting.over.set_result(None)
        self._waiting = [waiting for waiting in self._waiting if not waiting.over.done()]

    def give_up(self) -> None:
        """End all waits now."""
        for waiting in self._waiting:
            waiting.over.set_result(None)
        self._waiting.clear()
