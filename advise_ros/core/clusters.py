"""STATECLUSTERING of algorithm 1: k-means over the demonstrator's action distributions (section 3.2)."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from sklearn.cluster import KMeans

from advise_ros.core.grid import Grid
from advise_ros.core.mdp import occurring
from advise_ros.core.numerics import Floats, Ints

NO_CLUSTER = -1
# Equal shares must be equal points whatever the last bits of a division are.
DECIMALS = 9


def cluster_states(grid: Grid, distribution: Floats, features: float, clusters: int, seed: int) -> Ints:
    """The cluster of each state.

    Args:
        grid: the grid of the states.
        distribution: (n, n_actions) smoothed action distributions.
        features: weight of position and waypoint beside the distribution; 0: the distribution only, as in the paper.
        clusters: k; fewer where there are fewer distinct points.
        seed: of k-means++.

    Returns:
        (n,) labels, numbered by the lowest state of each cluster; NO_CLUSTER for states in which no flight acts.
    """
    states = np.flatnonzero(occurring(grid))
    labels = np.full(grid.n_states, NO_CLUSTER)
    points = distribution[states]
    if features > 0.0:
        points = np.hstack([points, features * structure(grid)[states]])
    labels[states] = canonical(k_means(points, clusters, seed))
    return labels


def split(
    grid: Grid, labels: Ints, mixed: Iterable[tuple[int, ...]], seed: int, drawn: Iterable[tuple[int, ...]] = (),
) -> Ints:
    """Part each cluster of which a person said that its states need different actions.

    Args:
        grid: the grid of the states.
        labels: (n,) from `cluster_states`.
        mixed: ascending states of each cluster that is to be halved by position and waypoint; halves of halves may
            be among them.
        seed: of k-means++.
        drawn: ascending states of each part that a person cut off a cluster.

    The largest one that fits the clusters goes first, so that the order in which people spoke leaves no trace.
    """
    labels = labels.copy()
    said = [(states, True) for states in set(mixed)] + [(states, False) for states in set(drawn)]
    waiting = sorted(said, key=lambda one: (-len(one[0]), one))
    while (found := next((one for one in waiting if _fits(labels, *one)), None)) is not None:
        waiting.remove(found)
        members = np.array(found[0])
        apart = members[k_means(structure(grid)[members], 2, seed) == 1] if found[1] else members
        labels[apart] = labels.max() + 1
    acting = labels != NO_CLUSTER
    labels[acting] = canonical(labels[acting])
    return labels


def _fits(labels: Ints, states: tuple[int, ...], whole: bool) -> bool:
    """Whether states are a whole cluster, or some but not all states of one."""
    label = labels[states[0]]
    if label == NO_CLUSTER or (labels[list(states)] != label).any():
        return False
    return bool((np.count_nonzero(labels == label) == len(states)) == whole)


def structure(grid: Grid) -> Floats:
    """(n, 2 + n_layers): east and north in units of the grid's size, and the next waypoint.

    Two states that differ in the waypoint alone are as far apart as two opposite borders.
    """
    cells = np.tile(np.arange(grid.n_cells), grid.n_layers)
    layers = np.repeat(np.arange(grid.n_layers), grid.n_cells)
    east, north = cells % grid.width / max(1, grid.width - 1), cells // grid.width / max(1, grid.height - 1)
    waypoint = np.eye(grid.n_layers)[layers] / np.sqrt(2.0)
    return np.column_stack([east, north, waypoint])


def k_means(points: Floats, k: int, seed: int) -> Ints:
    """Cluster of each point; equal points share one, so no cluster is empty."""
    distinct, which, weight = np.unique(points.round(DECIMALS), axis=0, return_inverse=True, return_counts=True)
    if len(distinct) <= k:
        return which
    return np.array(_fit(distinct.tobytes(), tuple(weight.tolist()), k, seed))[which]


@lru_cache(maxsize=16)
def _fit(points: bytes, weights: tuple[int, ...], k: int, seed: int) -> tuple[int, ...]:
    """Remembered, because answers change neither the demonstrations nor their clusters."""
    rows = np.frombuffer(points).reshape(len(weights), -1)
    fitted = KMeans(k, n_init=4, random_state=seed).fit(rows, sample_weight=weights)
    return tuple(fitted.labels_.tolist())


def canonical(labels: Ints) -> Ints:
    """The same clusters, numbered in the order of their first members."""
    _, first, which = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[which]
