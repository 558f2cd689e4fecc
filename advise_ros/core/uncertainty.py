"""UNCERTAINTY and SELECTQUERY of algorithm 1 (section 3.3), and two named alternatives to its order."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from advise_ros.core.numerics import Bools, Floats, Ints, entropy, first_best


class Uncertainty(NamedTuple):
    """Definition 3: F of the demonstrations, G of the policy, U_s = w_p F + (1 - w_p) G; each (n,) [nat]."""

    demonstrations: Floats
    policy: Floats
    state: Floats


class Ranking(NamedTuple):
    """What an order of clusters may look at.

    Attributes:
        labels: (n,) cluster of each state.
        state: (n,) U_s.
        occupancy: (n,) discounted visits that the policy is expected to pay to each state.
        score: 'mean' (definition 4) or 'sum' (algorithm 1).
        rng: for orders that draw.
    """

    labels: Ints
    state: Floats
    occupancy: Floats
    score: str
    rng: np.random.Generator


def uncertainty(demonstrated: Floats, policy: Floats, w_p: float) -> Uncertainty:
    """Definition 3 for every state, from two (n, n_actions) distributions."""
    f, g = entropy(demonstrated), entropy(policy)
    return Uncertainty(f, g, w_p * f + (1.0 - w_p) * g)


def cluster_uncertainty(labels: Ints, state: Floats, score: str) -> Floats:
    """U_c of each cluster: the mean (definition 4) or the sum (algorithm 1) of U_s over its states."""
    members = labels >= 0
    total: Floats = np.bincount(labels[members], weights=state[members]).astype(np.float64)
    return total / np.maximum(np.bincount(labels[members]), 1) if score == 'mean' else total


def _paper(ranking: Ranking) -> Floats:
    return cluster_uncertainty(ranking.labels, ranking.state, ranking.score)


def _occupancy(ranking: Ranking) -> Floats:
    return cluster_uncertainty(ranking.labels, ranking.state * ranking.occupancy, 'sum')


def _random(ranking: Ranking) -> Floats:
    worth: Floats = ranking.rng.random(ranking.labels.max() + 1)
    return worth


# What a cluster is worth asking about; the highest is asked first.
ACQUISITIONS: dict[str, Callable[[Ranking], Floats]] = {
    'paper': _paper,
    'occupancy': _occupancy,
    'random': _random,
}


def select(acquisition: str, ranking: Ranking, open_clusters: Bools) -> int | None:
    """The open cluster that is worth most, ties to the lowest label; None when none is open."""
    if not open_clusters.any():
        return None
    worth = ACQUISITIONS[acquisition](ranking)
    candidates = np.flatnonzero(open_clusters)
    return int(candidates[first_best(worth[candidates])])
