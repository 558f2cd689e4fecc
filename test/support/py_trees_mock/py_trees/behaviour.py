"""MOCK: see the package."""

from __future__ import annotations

from py_trees.common import Status


class Behaviour:
    """Begins by `initialise`, goes on by `update`, ends by `terminate`."""

    def __init__(self, name: str) -> None:
        self.name, self.status, self.feedback_message = name, Status.INVALID, ''

    def initialise(self) -> None: ...

    def update(self) -> Status:
        raise NotImplementedError

    def terminate(self, new_status: Status) -> None: ...

    def tick_once(self) -> None:
        if self.status is not Status.RUNNING:
            self.initialise()
        status = self.update()
        if status is not Status.RUNNING:
            self.stop(status)
        self.status = status

    def stop(self, new_status: Status) -> None:
        self.terminate(new_status)
        self.status = new_status
