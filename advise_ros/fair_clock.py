"""Waiting on a busy machine: what counts is what the processes could do, not what the clock on the wall says."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from advise_ros.core.units import NS

TICKS_PER_S = os.sysconf('SC_CLK_TCK')
# The processes are looked at this often; each look reads a small file for every thread.
LOOK_S = 1.0
# Of a second on the wall at least this much counts, however busy the machine: every wait comes to an end.
LEAST_SHARE = 0.05


def queued_s(pid: int) -> dict[tuple[int, str], float]:
    """Seconds that each thread of a process was ready to run and had no processor, since it began (Linux, schedstat)."""
    found = {}
    for task in Path(f'/proc/{pid}/task').glob('*/schedstat'):
        with contextlib.suppress(OSError, IndexError, ValueError):
            found[pid, task.parent.name] = int(task.read_text().split()[1]) / NS
    return found


def cpu_s(pid: int) -> float:
    """Processor seconds that a process and its ended children have used; 0 when it is gone."""
    try:
        fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    except OSError:
        return 0.0
    return sum(map(int, fields[11:15])) / TICKS_PER_S


class FairClock:
    """Seconds in which every watched process could run: time that one of them waited for a processor does not count.

    Args:
        pids: the processes to watch, asked for at every look; this process is watched too.
        wall: steady time [s].
        queued: thread -> seconds that it waited for a processor, of one process.
    """

    def __init__(
        self, pids: Callable[[], Iterable[int]], wall: Callable[[], float] = time.monotonic,
        queued: Callable[[int], dict[tuple[int, str], float]] = queued_s,
    ) -> None:
        self._pids, self._wall, self._queued = pids, wall, queued
        self._looked_s = wall()
        self._waited: dict[tuple[int, str], float] = {}
        self._owed_s = 0.0
        self._s = 0.0

    def __call__(self) -> float:
        """Fair seconds since the start."""
        passed = self._wall() - self._looked_s
        if passed >= LOOK_S:
            self._looked_s += passed
            self._count(passed)
        return self._s

    def _count(self, passed: float) -> None:
        """The kernel books a wait when it is over, so what it says may be longer than the time since the last look."""
        before = self._waited
        self._waited = {thread: s for pid in {os.getpid(), *self._pids()} for thread, s in self._queued(pid).items()}
        self._owed_s += max((s - before.get(thread, s) for thread, s in self._waited.items()), default=0.0)
        starved = min(self._owed_s, passed * (1.0 - LEAST_SHARE))
        self._owed_s -= starved
        self._s += passed - starved
