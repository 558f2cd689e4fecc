"""SELECTQUERY of algorithm 1: what a cluster is worth asking about, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from advise_ros.core.numerics import Bools, Floats, Ints, first_best

# The schedule 'mixed' asks where the policy goes for so many answers, then by the paper's score.
EARLY = 3
# A state that was seldom visited is worth this share of one whose demonstrations disagree as much, in 'disagreement'.
SCARCE = 0.02


class Ranking(NamedTuple):
    """What an order of clusters may look at.

    Attributes:
        labels: (n,) cluster of each state.
        state: (n,) U_s.
        occupancy: (n,) discounted visits that the policy is expected to pay to each state.
        score: 'mean' (definition 4) or 'sum' (algorithm 1).
        rng: for orders that draw.
        disagreement, scarcity: (n,) the two sources of F [nat].
        unexplained: (n,) margin that the learnt reward does not give to what was demonstrated.
        asked: questions answered so far.
    """

    labels: Ints
    state: Floats
    occupancy: Floats
    score: str
    rng: np.random.Generator
    disagreement: Floats = np.empty(0)
    scarcity: Floats = np.empty(0)
    unexplained: Floats = np.empty(0)
    asked: int = 0


def cluster_uncertainty(labels: Ints, state: Floats, score: str) -> Floats:
    """U_c of each cluster: the mean (definition 4) or the sum (algorithm 1) of U_s over its states."""
    members = labels >= 0
    total: Floats = np.bincount(labels[members], weights=state[members]).astype(np.float64)
    return total / np.maximum(np.bincount(labels[members]), 1) if score == 'mean' else total


def _paper(ranking: Ranking) -> Floats:
    return cluster_uncertainty(ranking.labels, ranking.state, ranking.score)


def _occupancy(ranking: Ranking) -> Floats:
    """Where the policy goes and is unsure."""
    return cluster_uncertainty(ranking.labels, ranking.state * ranking.occupancy, 'sum')


def _unexplained(ranking: Ranking) -> Floats:
    """Where the policy goes and the reward does not explain what was demonstrated."""
    return cluster_uncertainty(ranking.labels, ranking.unexplained * ranking.occupancy, 'sum')


def _mixed(ranking: Ranking) -> Floats:
    """Expected visits are worth most at the beginning and mislead at the end, when the policy goes everywhere right."""
    return _occupancy(ranking) if ranking.asked < EARLY else _paper(ranking)


def doubt(ranking: Ranking) -> Floats:
    """(n,) how much speaks against what a state's demonstrations show, apart from whether the policy goes there.

    Squared, because all demonstrations disagree a little: one clear disagreement outweighs many small ones.
    """
    doubts: Floats = ranking.disagreement**2 + SCARCE * ranking.scarcity**2
    return doubts


def _disagreement(ranking: Ranking) -> Floats:
    """Where the policy goes and the demonstrations contradict one another, scarcity aside."""
    return cluster_uncertainty(ranking.labels, doubt(ranking) * ranking.occupancy, 'sum')


def unexplained(q: Floats, favourite: Ints, cap: float) -> Floats:
    """(n,) how much of the margin `cap` the reward does not give to a* over the best other action; all of it without a*.

    Args:
        q: (n, n_actions) of the learnt reward.
        favourite: (n,) a*, -1 without a demonstration.
        cap: 0: none, 1 is taken.
    """
    seen = np.flatnonzero(favourite >= 0)
    others = q.copy()
    others[seen, favourite[seen]] = -np.inf
    margin = np.zeros(len(q))
    margin[seen] = q[seen, favourite[seen]] - others[seen].max(axis=1)
    return np.maximum((cap or 1.0) - margin, 0.0)


def _random(ranking: Ranking) -> Floats:
    worth: Floats = ranking.rng.random(ranking.labels.max() + 1)
    return worth


# What a cluster is worth asking about; the highest is asked first.
ACQUISITIONS: dict[str, Callable[[Ranking], Floats]] = {
    'paper': _paper,
    'occupancy': _occupancy,
    'unexplained': _unexplained,
    'mixed': _mixed,
    'disagreement': _disagreement,
    'random': _random,
}


def select(acquisition: str, ranking: Ranking, open_clusters: Bools) -> int | None:
    """The open cluster that is worth most, ties to the lowest label; None when none is open."""
    if not open_clusters.any():
        return None
    worth = ACQUISITIONS[acquisition](ranking)
    candidates = np.flatnonzero(open_clusters)
    # Relative to the best, so that equal means the same for nats, visits and margins.
    scale = max(float(np.abs(worth[candidates]).max()), np.finfo(float).tiny)
    return int(candidates[first_best(worth[candidates] / scale)])
