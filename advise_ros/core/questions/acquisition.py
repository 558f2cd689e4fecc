"""SELECTQUERY of algorithm 1: what a cluster is worth asking about, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from advise_ros.core.numerics import Bools, Floats, Ints, first_best
from advise_ros.core.questions.uncertainty import Sources, cluster_uncertainty

# A state that was seldom visited is worth this share of one whose demonstrations disagree as much, in 'disagreement'.
SCARCE = 0.02


@dataclass(frozen=True, eq=False)
class Ranking:
    """What an order of clusters may look at.

    Attributes:
        labels: (n,) cluster of each state, -1 where nothing is asked.
        state: (n,) U_s [nat].
        score: U_c is the 'mean' (definition 4) or the 'sum' (algorithm 1) of U_s.
        visits: computes (n,) discounted visits that the policy is expected to pay; called only where they matter.
        sources: of F.
        rng: for orders that draw.
    """

    labels: Ints
    state: Floats
    score: str
    visits: Callable[[], Floats]
    sources: Sources
    rng: np.random.Generator

    @cached_property
    def occupancy(self) -> Floats:
        """(n,) discounted visits that the policy is expected to pay to each state."""
        return self.visits()

    @cached_property
    def doubt(self) -> Floats:
        """Of each cluster: how much its demonstrations contradict one another where the policy goes [visits nat^2]."""
        return cluster_uncertainty(self.labels, doubt(self.sources) * self.occupancy, 'sum')


def doubt(sources: Sources) -> Floats:
    """(n,) how much speaks against what a state's demonstrations show, apart from whether the policy goes there [nat^2].

    Squared, because all demonstrations disagree a little: one clear disagreement outweighs many small ones.
    """
    doubts: Floats = sources.disagreement**2 + SCARCE * sources.scarcity**2
    return doubts


def _paper(ranking: Ranking) -> Floats:
    return cluster_uncertainty(ranking.labels, ranking.state, ranking.score)


def _occupancy(ranking: Ranking) -> Floats:
    """Where the policy goes and is unsure."""
    return cluster_uncertainty(ranking.labels, ranking.state * ranking.occupancy, 'sum')


def _disagreement(ranking: Ranking) -> Floats:
    """Where the policy goes and the demonstrations contradict one another, scarcity aside."""
    return ranking.doubt


def _random(ranking: Ranking) -> Floats:
    worth: Floats = ranking.rng.random(ranking.labels.max() + 1)
    return worth


# What a cluster is worth asking about; the highest is asked first.
ACQUISITIONS: dict[str, Callable[[Ranking], Floats]] = {
    'paper': _paper,
    'occupancy': _occupancy,
    'disagreement': _disagreement,
    'random': _random,
}


def select(acquisition: str, ranking: Ranking, open_clusters: Bools) -> int | None:
    """The open cluster that is worth most, ties to the lowest label; None when none is open.

    Args:
        acquisition: a key of ACQUISITIONS.
        ranking: what is known.
        open_clusters: (clusters,) which may be asked about.
    """
    if not open_clusters.any():
        return None
    worth = ACQUISITIONS[acquisition](ranking)
    candidates = np.flatnonzero(open_clusters)
    # Relative to the best, so that equal means the same for nats and visits.
    scale = max(float(np.abs(worth[candidates]).max()), np.finfo(float).tiny)
    return int(candidates[first_best(worth[candidates] / scale)])
