"""STATECLUSTERING in any domain: the paper's, its extremes, and ideal clusters with states displaced (figure 6)."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from advise_ros.core.clusters import NO_CLUSTER, canonical, k_means
from advise_ros.core.numerics import Floats, Ints
from advise_ros.domains.domain import Domain


class Clustering(NamedTuple):
    """What a clustering may look at.

    Attributes:
        distribution: (n, n_actions) the demonstrator's, smoothed.
        clusters: k.
        features: weight of the states' structure.
        quality: share of the states that stay in their ideal cluster.
        seed: of k-means++.
        rng: of displacements.
    """

    domain: Domain
    distribution: Floats
    clusters: int
    features: float
    quality: float
    seed: int
    rng: np.random.Generator


def _k_means(given: Clustering) -> Ints:
    points = given.distribution[given.domain.acting]
    if given.features > 0.0:
        points = np.hstack([points, given.features * given.domain.features[given.domain.acting]])
    return k_means(points, given.clusters, given.seed)


def _states(given: Clustering) -> Ints:
    return np.arange(len(given.domain.acting))


def _ideal(given: Clustering) -> Ints:
    """States with the same optimal action; `1 - quality` of them displaced into another cluster, drawn evenly."""
    kinds, labels = np.unique(given.domain.habit[given.domain.acting], return_inverse=True)
    displaced = given.rng.permutation(len(labels))[: round((1.0 - given.quality) * len(labels))]
    labels[displaced] = (labels[displaced] + given.rng.integers(1, len(kinds), len(displaced))) % len(kinds)
    return labels


# The cluster of each acting state.
CLUSTERINGS: dict[str, Callable[[Clustering], Ints]] = {'k_means': _k_means, 'states': _states, 'ideal': _ideal}


def cluster(name: str, given: Clustering) -> Ints:
    """(n,) labels, numbered by the lowest state of each cluster; NO_CLUSTER where the task has ended."""
    labels = np.full(given.domain.mdp.n_states, NO_CLUSTER)
    labels[given.domain.acting] = canonical(CLUSTERINGS[name](given))
    return labels


def quality(domain: Domain, labels: Ints) -> float:
    """Section 4's: the share of states for which the plurality's action of their cluster is optimal."""
    votes = np.array([domain.optimal[labels == label].sum(axis=0) for label in range(labels.max() + 1)])
    return float(votes.max(axis=1).sum()) / len(domain.acting)
