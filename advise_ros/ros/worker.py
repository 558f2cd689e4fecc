"""Long work beside the executor: one thread, whose results come back on the executor's own thread."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple


class Finished(NamedTuple):
    """What became of a job: its value, or the exception that ended it; and how long it ran."""

    value: Any
    error: Exception | None
    seconds: float


Job = Callable[[], Any]
Done = Callable[[Finished], None]


class Worker:
    """Runs jobs in the order of `submit` in one daemon thread.

    The solvers release Python's interpreter lock, so a thread leaves the executor responsive, without
    the memory and the start-up of a process. The thread is a daemon: a solve that is still running does
    not hold up the end of the process.
    """

    def __init__(self, wake: Callable[[], object]) -> None:
        """`wake` is called from the worker's thread when there is something to deliver; it must be thread-safe."""
        self._wake = wake
        self._jobs: queue.SimpleQueue[tuple[Job, Done]] = queue.SimpleQueue()
        self._finished: queue.SimpleQueue[tuple[Done, Finished]] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._closed = False
        self._thread: threading.Thread | None = None

    def submit(self, job: Job, done: Done) -> None:
        """Queue a job; `deliver` will call `done` with what became of it."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name='worker', daemon=True)
            self._thread.start()
        self._jobs.put((job, done))

    def deliver(self) -> None:
        """Call `done` of every finished job; to be called on the executor's thread."""
        while not self._finished.empty():
            done, finished = self._finished.get()
            done(finished)

    def close(self) -> None:
        """No wake-ups from now on."""
        with self._lock:
            self._closed = True

    def _run(self) -> None:
        while True:
            job, done = self._jobs.get()
            self._finished.put((done, _run(job)))
            with self._lock:
                if self._closed:
                    return
                self._wake()


def _run(job: Job) -> Finished:
    begin = time.monotonic()
    try:
        value, error = job(), None
    except Exception as problem:  # noqa: BLE001  the executor's thread decides what a failure means.
        value, error = None, problem
    return Finished(value, error, time.monotonic() - begin)
