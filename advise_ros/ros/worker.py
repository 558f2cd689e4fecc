"""Long work beside the executor: one thread, whose results come back on the executor's own thread."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple


class Finished(NamedTuple):
    """What became of a job: its value, or the exception that ended it; and how long it ran."""

    value: Any
    error: Exception | None
    seconds: float


class Superseded(Exception):  # noqa: N818 - it is no error
    """A newer job took the place of this one before it began."""


Job = Callable[[], Any]
Done = Callable[[Finished], None]


class Worker:
    """Runs jobs in one daemon thread: those of `submit` first, in their order, then the newest of `submit_newest`, and when
    nothing else is left to do the newest of `submit_idle`.

    The solvers release Python's interpreter lock, so a thread leaves the executor responsive, without
    the memory and the start-up of a process. The thread is a daemon: a solve that is still running does
    not hold up the end of the process.
    """

    def __init__(self, wake: Callable[[], object]) -> None:
        """`wake` is called from the worker's thread when there is something to deliver; it must be thread-safe."""
        self._wake = wake
        self._jobs: deque[tuple[Job, Done]] = deque()
        self._newest: tuple[Job, Done] | None = None
        self._idle: tuple[Job, Done] | None = None
        self._finished: deque[tuple[Done, Finished]] = deque()
        self._changed = threading.Condition()
        self._closed = False
        self._thread: threading.Thread | None = None

    def submit(self, job: Job, done: Done) -> None:
        """Queue a job; `deliver` will call `done` with what became of it."""
        with self._changed:
            self._jobs.append((job, done))
            self._changed.notify()
        self._start()

    def submit_newest(self, job: Job, done: Done) -> None:
        """Run a job when nothing else is left to do; one that still waits to run gives way and ends as `Superseded`."""
        with self._changed:
            replaced, self._newest = self._newest, (job, done)
            self._changed.notify()
        self._start()
        if replaced is not None:
            self._finished.append((replaced[1], Finished(None, Superseded('a newer one took its place'), 0.0)))
            self._wake()

    def submit_idle(self, job: Job, done: Done) -> None:
        """Run a job when no other waits; one that still waits to run gives way and is forgotten."""
        with self._changed:
            self._idle = (job, done)
            self._changed.notify()
        self._start()

    def deliver(self) -> None:
        """Call `done` of every finished job; to be called on the executor's thread."""
        while self._finished:
            done, finished = self._finished.popleft()
            done(finished)

    def close(self) -> None:
        """No wake-ups from now on."""
        with self._changed:
            self._closed = True

    def _start(self) -> None:
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name='worker', daemon=True)
            self._thread.start()

    def _run(self) -> None:
        while True:
            job, done = self._next()
            self._finished.append((done, _run(job)))
            with self._changed:
                if self._closed:
                    return
                self._wake()

    def _next(self) -> tuple[Job, Done]:
        with self._changed:
            while True:
                if self._jobs:
                    return self._jobs.popleft()
                if self._newest is not None:
                    newest, self._newest = self._newest, None
                    return newest
                if self._idle is not None:
                    idle, self._idle = self._idle, None
                    return idle
                self._changed.wait()


def _run(job: Job) -> Finished:
    begin = time.monotonic()
    try:
        value, error = job(), None
    except Exception as problem:  # noqa: BLE001  the executor's thread decides what a failure means.
        value, error = None, problem
    return Finished(value, error, time.monotonic() - begin)
