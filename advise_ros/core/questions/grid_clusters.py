"""STATECLUSTERING of algorithm 1 on the drone's grid, and parts of clusters that a person tells apart."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from advise_ros.core.demonstrations.action_counts import Counts
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.planning.process import mdp_of, occurring
from advise_ros.core.questions.clusterings import Terrain, Wanted, cluster, finer
from advise_ros.core.questions.kmeans import canonical, k_means

__all__ = ['NO_CLUSTER', 'canonical', 'cluster_states', 'finer_clusters', 'k_means', 'split', 'structure']

NO_CLUSTER = -1


def cluster_states(grid: Grid, counts: Counts, settings: LearnSettings) -> Ints:
    """The cluster of each state.

    Args:
        grid: the grid of the states.
        counts: what the demonstrations did.
        settings: names and constants of the clustering.

    Returns:
        (n,) labels, numbered by the lowest state of each cluster; NO_CLUSTER for states in which no flight acts.
    """
    states, labels = _acting(grid)
    labels[states] = cluster(settings.clustering, _terrain(grid, counts, settings), _wanted(settings))
    return labels


def finer_clusters(grid: Grid, counts: Counts, settings: LearnSettings) -> list[Ints]:
    """The same clustering with more clusters, several times: the cluster of each state in each, as `cluster_states`."""
    partitions = []
    for found in finer(settings.clustering, _terrain(grid, counts, settings), _wanted(settings)):
        states, labels = _acting(grid)
        labels[states] = found
        partitions.append(labels)
    return partitions


def _acting(grid: Grid) -> tuple[Ints, Ints]:
    """States in which a flight acts, and labels (n,) without a cluster."""
    return np.flatnonzero(occurring(grid)), np.full(grid.n_states, NO_CLUSTER)


def _terrain(grid: Grid, counts: Counts, settings: LearnSettings) -> Terrain:
    states, _ = _acting(grid)
    return Terrain(
        mdp_of(grid, settings.slip, settings.gamma), states, counts.taken[states], settings.laplace,
        structure(grid)[states],
    )


def _wanted(settings: LearnSettings) -> Wanted:
    return Wanted(settings.clusters, settings.cluster_features, settings.seed)


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
