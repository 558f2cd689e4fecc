"""STATECLUSTERING of algorithm 1 (section 3.2) in any process, by name."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import sparse

from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.planning.process import Mdp
from advise_ros.core.questions.evidence_clusters import TIGHTNESS, merge
from advise_ros.core.questions.kmeans import canonical, k_means


class Terrain(NamedTuple):
    """What a clustering may look at, a row for each of the m states that are to be clustered.

    Attributes:
        mdp: the process.
        states: (m,) ascending.
        taken: (m, n_actions) demonstrated actions.
        laplace: added to each count.
        structure: (m, f) features, in comparable units.
    """

    mdp: Mdp
    states: Ints
    taken: Ints
    laplace: float
    structure: Floats

    @property
    def distribution(self) -> Floats:
        """(m, n_actions) smoothed action distributions."""
        smoothed = self.taken + self.laplace
        return smoothed / smoothed.sum(axis=1, keepdims=True)


class Wanted(NamedTuple):
    """What kind of clusters.

    Attributes:
        clusters: k, 0: as many as 'evidence' finds.
        features: weight of the structure beside the action distribution; 0: the distribution only, as in the paper.
        seed: of k-means++.
    """

    clusters: int
    features: float
    seed: int


def _evidence(terrain: Terrain, wanted: Wanted) -> Ints:
    return merge(terrain.taken, terrain.structure, TIGHTNESS * wanted.features**2, wanted.clusters)


def _k_means(terrain: Terrain, wanted: Wanted) -> Ints:
    return k_means(_points(terrain, wanted), _number(terrain, wanted), wanted.seed)


def _connected(terrain: Terrain, wanted: Wanted) -> Ints:
    """Ward's clusters of states that moves lead between; nothing of one part of the process goes with another."""
    points, number = _points(terrain, wanted), _number(terrain, wanted)
    if number >= len(points):
        return np.arange(len(points))
    with warnings.catch_warnings():
        # Parts of a process that no move joins are joined where they are nearest, once their insides are.
        warnings.filterwarnings('ignore', message='the number of connected components', category=UserWarning)
        from sklearn.cluster import AgglomerativeClustering  # noqa: PLC0415 - a second to import, and most nodes never cluster

        fitted = AgglomerativeClustering(number, linkage='ward', connectivity=neighbours(terrain)).fit(points)
    return fitted.labels_.astype(np.int64)


def _points(terrain: Terrain, wanted: Wanted) -> Floats:
    if wanted.features == 0.0:
        return terrain.distribution
    return np.hstack([terrain.distribution, wanted.features * terrain.structure])


def _number(terrain: Terrain, wanted: Wanted) -> int:
    return wanted.clusters or len(np.unique(_evidence(terrain, wanted)))


def neighbours(terrain: Terrain) -> sparse.csr_array:
    """(m, m) ones between states that a single action may lead between."""
    states = terrain.states
    moves = [terrain.mdp.outcomes(states, np.full(len(states), action)) for action in range(terrain.mdp.n_actions)]
    reached = sum(moves[1:], start=moves[0])[:, states]
    either = (reached + reached.T).tocsr()
    either.data[:] = 1.0
    return either


# How many times as many clusters the finer ones have.
FINER = (1.5, 2.0, 3.0)

# (m,) cluster of each state.
CLUSTERINGS: dict[str, Callable[[Terrain, Wanted], Ints]] = {
    'k_means': _k_means,
    'connected': _connected,
    'evidence': _evidence,
}


def cluster(name: str, terrain: Terrain, wanted: Wanted) -> Ints:
    """(m,) labels by the named clustering, numbered by the lowest state of each cluster."""
    return canonical(CLUSTERINGS[name](terrain, wanted))


def finer(name: str, terrain: Terrain, wanted: Wanted) -> list[Ints]:
    """The named clustering (m,) with more and more clusters, for questions that may be about any of them."""
    number = len(np.unique(cluster(name, terrain, wanted)))
    return [cluster(name, terrain, wanted._replace(clusters=round(more * number))) for more in FINER]
