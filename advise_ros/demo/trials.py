"""The demo's success rates: many seeds on the grid model, computed beside the flights."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor

from advise_ros.core.grid import Grid
from advise_ros.core.trial import TrialResult, TrialSettings, run_trial

NICENESS = 5


class TrialPool:
    """Runs trials in one polite process of its own; the flights keep the other cores."""

    def __init__(self) -> None:
        self._pool = ProcessPoolExecutor(1, mp_context=multiprocessing.get_context('spawn'), initializer=_be_polite)
        self._futures: list[Future[TrialResult]] = []

    def start(self, grid: Grid, settings: TrialSettings, seeds: Sequence[int]) -> None:
        self._futures = [self._pool.submit(run_trial, grid, settings, seed) for seed in seeds]

    @property
    def done(self) -> int:
        return sum(future.done() for future in self._futures)

    def results(self) -> list[TrialResult]:
        """All results in the order of the seeds; waits for the last."""
        return [future.result() for future in self._futures]

    def close(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)


def _be_polite() -> None:
    os.nice(NICENESS)
