"""Trials on routes as units that are spread over processes, stored by what they depend on, and measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from threadpoolctl import threadpool_limits

from advise_ros.experiments.routes.cases import RouteCase, trial_of
from advise_ros.experiments.routes.two import agreement
from advise_ros.experiments.routes.ways import SECOND_WAYS, WAYS
from advise_ros.experiments.store import Store, key_of
from advise_ros.recording.code_digest import core_digest

# Beside the ways: whether the flights are said to be one person's.
AGREEMENT = 'agreement'
# Where Linux tells and forgets the most memory that a process had at once.
STATUS, FORGET = Path('/proc/self/status'), Path('/proc/self/clear_refs')
PEAK, FORGET_PEAK = 'VmHWM:', '5'


class RouteTask(NamedTuple):
    """One trial of some ways.

    Attributes:
        methods: names of WAYS, or AGREEMENT.
    """

    case: RouteCase
    methods: tuple[str, ...]
    seed: int

    def keys(self) -> list[tuple[str, int]]:
        """Where the results of the ways are stored; other code of the learner, other keys."""
        return [(route_key(self.case, way), self.seed) for way in self.methods]

    def perform(self) -> list[Any]:
        """The outcome of each way as a mapping, None where the site has no second route; one thread."""
        with threadpool_limits(1):
            return [_measured(self.case, way, self.seed) for way in self.methods]


def route_key(case: RouteCase, way: str) -> str:
    """Of the results of a way in a case."""
    return key_of('routes', core_digest(), case, way)


def outcomes(store: Store, case: RouteCase, way: str, seeds: range) -> list[dict[str, Any]]:
    """The results that there are, in the order of their seeds."""
    found = (store[route_key(case, way), seed] for seed in seeds)
    return [one for one in found if one is not None]


def _measured(case: RouteCase, way: str, seed: int) -> dict[str, Any] | None:
    trial = trial_of(case, seed)
    if case.second and trial.other is None:
        return None
    if way == AGREEMENT:
        return agreement(trial)._asdict()
    FORGET.write_text(FORGET_PEAK, encoding='ascii')
    outcome = (SECOND_WAYS if case.second else WAYS)[way](trial)
    return {**outcome._asdict(), 'mb': _peak_mb()}


def _peak_mb() -> float:
    line = next(line for line in STATUS.read_text(encoding='ascii').splitlines() if line.startswith(PEAK))
    return round(float(line.split()[1]) / 1024.0, 1)
