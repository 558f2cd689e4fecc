"""Which trials the figures consist of, and their rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from advise_ros.core.errors import InputError
from advise_ros.core.numerics import Floats
from advise_ros.experiments.method import METHODS, Method, Protocol
from advise_ros.experiments.statistics import Estimate, estimate
from advise_ros.experiments.store import Store, key_of
from advise_ros.experiments.work import Task

# Shares of the states that stay in their ideal cluster, in figure 6.
QUALITIES = (1.0, 0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.6, 0.5)
CLUSTERED = METHODS['clustered']


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


class Row6(NamedTuple):
    """One point of figure 6: performance relative to that with ideal clusters."""

    domain: str
    quality: float
    mean: float
    ci95: float
    trials: int


class Slope(NamedTuple):
    """The slope of figure 6: relative performance lost with each 1 % of the states displaced, in per cent."""

    domain: str
    mean: float
    ci95: float
    trials: int


class QualityRow(NamedTuple):
    """Quality of a domain's clusters [%], beside the paper's and the least possible."""

    domain: str
    mean: float
    ci95: float
    trials: int
    paper: float | None
    least: float


def tasks(kind: str, protocol: Protocol, methods: tuple[Method, ...], trials: Trials) -> list[Task]:
    """One a trial."""
    return [Task(kind, protocol, methods, seed) for seed in trials.seeds]


def stored(store: Store, kind: str, protocol: Protocol, method: Method, trials: Trials) -> Floats:
    """(trials, ...) results, in the order of their seeds."""
    key = key_of(kind, protocol, method)
    return np.array([store[key, seed] for seed in trials.seeds])


def figure5_rows(store: Store, name: str, protocol: Protocol, methods: tuple[Method, ...], trials: Trials) -> list[Row5]:
    """Performance after each number of questions, method by method."""
    rows = []
    for method in methods:
        points = zip(protocol.points, stored(store, 'curves', protocol, method, trials).T, strict=True)
        rows += [Row5(name, method.name, asked, *_rounded(estimate(values))) for asked, values in points]
    return rows


def table5(rows: Sequence[Row5]) -> str:
    """The points of figure 5 as Markdown, a table for each domain and a column for each method."""
    return '\n'.join(_table_of([row for row in rows if row.domain == name]) for name in dict.fromkeys(row.domain for row in rows))


def _table_of(rows: Sequence[Row5]) -> str:
    methods, asked = (list(dict.fromkeys(part)) for part in zip(*((row.method, row.queries) for row in rows), strict=True))
    cells = {(row.method, row.queries): f'{row.mean:.4g} ± {row.ci95:.2g}' for row in rows}
    lines = [[str(number), *(cells[method, number] for method in methods)] for number in asked]
    head = [f'{rows[0].domain}, {rows[0].trials} trials: questions', *methods]
    return '\n'.join(f'| {" | ".join(line)} |' for line in (head, ['---'] * len(head), *lines)) + '\n'


def perturbed(quality: float) -> Method:
    """Ideal clusters of which so many states stay where they belong."""
    return Method(f'ideal {quality:g}', clustering='ideal', quality=quality)


FIGURE6_METHODS = tuple(perturbed(quality) for quality in QUALITIES)


def figure6_rows(store: Store, name: str, protocol: Protocol, trials: Trials) -> tuple[list[Row6], Slope]:
    """What is left of the ideal clusters' performance when all clusters were asked about, and how steeply it falls.

    Raises:
        InputError: nothing can be relative to ideal clusters that reach no goal.
    """
    last = np.array([stored(store, 'curves', protocol, method, trials)[:, -1] for method in FIGURE6_METHODS])
    if not last[0].any():
        raise InputError(f"ideal clusters never reach the goal of domain '{name}', so nothing can be relative to them")
    relative = last / last[0].mean()
    rows = [Row6(name, quality, *_rounded(estimate(values))) for quality, values in zip(QUALITIES, relative, strict=True)]
    of_trials = np.polyfit(QUALITIES, relative, 1)[0]
    return rows, Slope(name, *_rounded(estimate(of_trials)))


# Section 4 of the paper.
PAPERS_QUALITY = {'wumpus': 94.2, 'sailing': 91.3, 'traffic': 69.58}


def quality_row(store: Store, name: str, protocol: Protocol, n_actions: int, trials: Trials) -> QualityRow:
    """Of k-means clusters."""
    found = 100.0 * stored(store, 'quality', protocol, CLUSTERED, trials)
    return QualityRow(name, *_rounded(estimate(found)), PAPERS_QUALITY.get(protocol.domain), round(100.0 / n_actions, 2))


def _rounded(given: Estimate) -> Estimate:
    return Estimate(round(given.mean, 6), round(given.ci95, 6), given.trials)
