"""The demo's success rates: many seeds on the grid model, computed beside the flights."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial

import numpy as np

from advise_ros.config import AdviseConfig, ExpertConfig, PilotConfig, PolicyConfig
from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.errors import AdviseError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.people.trial import TrialResult, TrialSettings, advised_trial, run_trial
from advise_ros.demo.options import DemoOptions, load_sites, node_config
from advise_ros.fair_clock import cpu_s
from advise_ros.parent import die_with_parent
from advise_ros.settings import learn_settings

NICENESS = 5


def trial_settings(options: DemoOptions) -> TrialSettings:
    """A trial with the parameters that the nodes of the demo fly and learn with, and what its simulated people know.

    Raises:
        InputError: a parameter in the demo's parameter file is unknown or out of range, or as load_sites.
    """
    sites = load_sites(options)
    pilot = node_config(options.params_file, 'pilot', PilotConfig)
    expert = node_config(options.params_file, 'expert', ExpertConfig)
    return TrialSettings(
        learn=learn_settings(node_config(options.params_file, 'advise', AdviseConfig)),
        flights=options.flights, answers=options.answers,
        noise_rate=pilot.noise_rate, mistake_share=pilot.mistake_share, max_moves=pilot.max_moves,
        prefer=expert.prefer, avoid=expert.avoid, error_rate=expert.error_rate, skip_rate=expert.skip_rate,
        step_budget_factor=node_config(options.params_file, 'policy', PolicyConfig).step_budget_factor,
        keep_out=tuple(np.flatnonzero(sites.shown.keep_out).tolist()),
        other=None if sites.other is None else sites.other.grid,
    )


class TrialPool:
    """Runs trials in one polite process of its own; the flights keep the other cores."""

    def __init__(self) -> None:
        spawn = multiprocessing.get_context('spawn')
        self._pool = ProcessPoolExecutor(1, mp_context=spawn, initializer=_be_polite, initargs=(os.getpid(),))
        self._futures: list[Future[TrialResult]] = []

    def start(
        self, grid: Grid, settings: TrialSettings, seeds: Sequence[int], log: tuple[AdviceRecord, ...] | None = None,
    ) -> None:
        """Begin the trials.

        Args:
            grid: the route.
            settings: of every trial.
            seeds: one trial each.
            log: the answers of a person, for every trial; None: the simulated expert answers in each.
        """
        # The process inherits this: Ctrl-C reaches the whole terminal, and only the parent is to answer it.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        one = partial(run_trial, grid, settings) if log is None else partial(advised_trial, grid, settings, log)
        self._futures = [self._pool.submit(one, seed) for seed in seeds]
        signal.pthread_sigmask(signal.SIG_SETMASK, before)

    @property
    def done(self) -> int:
        return sum(future.done() for future in self._futures)

    def progress(self) -> tuple[int, float]:
        """Trials done and processor seconds used: neither grows when nothing goes on any more."""
        return self.done, sum(cpu_s(process.pid or 0) for process in multiprocessing.active_children())

    def results(self) -> list[TrialResult]:
        """All results in the order of the seeds; waits for the last.

        Raises:
            AdviseError: the process that computes them has died.
        """
        try:
            return [future.result() for future in self._futures]
        except BrokenProcessPool:
            raise AdviseError('the process of the trials was killed (by the kernel, for want of memory?)') from None

    def close(self) -> None:
        """End the process, also in the middle of a trial: the interpreter would wait for it at its exit.

        The pool itself goes with it: the command leaves by `exit_now`, which runs no finaliser, and semaphores that
        still live then are reported as leaked.
        """
        for process in multiprocessing.active_children():
            process.terminate()
        self._pool.shutdown(wait=True, cancel_futures=True)
        del self._pool
        gc.collect()


def _be_polite(parent: int) -> None:
    os.nice(NICENESS)
    die_with_parent(parent)
