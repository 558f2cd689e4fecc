"""MOCK: see the package."""

from __future__ import annotations

import time

from py_trees.behaviour import Behaviour
from py_trees.common import Status


class Timeout(Behaviour):
    """Ticks its child for some seconds at most."""

    def __init__(self, name: str, child: Behaviour, duration: float) -> None:
        super().__init__(name)
        self.decorated, self._duration, self._end_s = child, duration, 0.0

    def initialise(self) -> None:
        self._end_s = time.monotonic() + self._duration

    def update(self) -> Status:
        self.decorated.tick_once()
        late = self.decorated.status is Status.RUNNING and time.monotonic() > self._end_s
        return Status.FAILURE if late else self.decorated.status

    def stop(self, new_status: Status) -> None:
        if self.decorated.status is Status.RUNNING:
            self.decorated.stop(Status.INVALID)
        super().stop(new_status)
