"""Which trials a figure consists of, and its rows."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from advise_ros.experiments.method import Method, Protocol
from advise_ros.experiments.statistics import Estimate, estimate
from advise_ros.experiments.store import Store, key_of
from advise_ros.experiments.work import Task


class Trials(NamedTuple):
    """How many, and the seed of the first; the others follow."""

    number: int
    seed: int

    @property
    def seeds(self) -> range:
        """One a trial."""
        return range(self.seed, self.seed + self.number)


class Row5(NamedTuple):
    """One point of figure 5."""

    domain: str
    method: str
    queries: int
    mean: float
    ci95: float
    trials: int


def tasks(kind: str, protocol: Protocol, methods: tuple[Method, ...], trials: Trials) -> list[Task]:
    """One a trial."""
    return [Task(kind, protocol, methods, seed) for seed in trials.seeds]


def stored(store: Store, kind: str, protocol: Protocol, method: Method, trials: Trials) -> np.ndarray[Any, Any]:
    """Results of all trials, in the order of their seeds."""
    key = key_of(kind, protocol, method)
    return np.array([store[key, seed] for seed in trials.seeds])


def figure5_rows(store: Store, name: str, protocol: Protocol, methods: tuple[Method, ...], trials: Trials) -> list[Row5]:
    """Performance after each number of questions, method by method."""
    rows = []
    for method in methods:
        points = stored(store, 'curves', protocol, method, trials).T
        rows += [Row5(name, method.name, queries, *_rounded(estimate(point))) for queries, point in enumerate(points)]
    return rows


def _rounded(given: Estimate) -> Estimate:
    return Estimate(round(given.mean, 6), round(given.ci95, 6), given.trials)
