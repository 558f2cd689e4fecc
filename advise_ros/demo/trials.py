"""The demo's success rates: many seeds on the grid model, computed beside the flights."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor

from advise_ros.config import AdviseConfig, ExpertConfig, PilotConfig, PolicyConfig
from advise_ros.core.grid import Grid
from advise_ros.core.trial import TrialResult, TrialSettings, run_trial
from advise_ros.demo.options import DemoOptions, node_config
from advise_ros.parent import die_with_parent
from advise_ros.settings import learn_settings

NICENESS = 5


def trial_settings(options: DemoOptions) -> TrialSettings:
    """A trial with the parameters that the nodes of the demo fly and learn with.

    Raises:
        InputError: a parameter in the demo's parameter file is unknown or out of range.
    """
    pilot = node_config(options.params_file, 'pilot', PilotConfig)
    expert = node_config(options.params_file, 'expert', ExpertConfig)
    return TrialSettings(
        learn=learn_settings(node_config(options.params_file, 'advise', AdviseConfig)),
        flights=options.flights, answers=options.answers,
        noise_rate=pilot.noise_rate, mistake_share=pilot.mistake_share, max_moves=pilot.max_moves,
        prefer=expert.prefer, avoid=expert.avoid, error_rate=expert.error_rate, skip_rate=expert.skip_rate,
        step_budget_factor=node_config(options.params_file, 'policy', PolicyConfig).step_budget_factor,
    )


class TrialPool:
    """Runs trials in one polite process of its own; the flights keep the other cores."""

    def __init__(self) -> None:
        spawn = multiprocessing.get_context('spawn')
        self._pool = ProcessPoolExecutor(1, mp_context=spawn, initializer=_be_polite, initargs=(os.getpid(),))
        self._futures: list[Future[TrialResult]] = []

    def start(self, grid: Grid, settings: TrialSettings, seeds: Sequence[int]) -> None:
        # The process inherits this: Ctrl-C reaches the whole terminal, and only the parent is to answer it.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        self._futures = [self._pool.submit(run_trial, grid, settings, seed) for seed in seeds]
        signal.pthread_sigmask(signal.SIG_SETMASK, before)

    @property
    def done(self) -> int:
        return sum(future.done() for future in self._futures)

    def results(self) -> list[TrialResult]:
        """All results in the order of the seeds; waits for the last."""
        return [future.result() for future in self._futures]

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
