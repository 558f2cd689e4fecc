"""STATECLUSTERING of algorithm 1 (section 3.2) in any process, and parts of clusters that a person tells apart."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from threadpoolctl import ThreadpoolController

from advise_ros.core.demonstrations.demonstration import Counts
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.planning.process import FiniteProcess

NO_CLUSTER = -1
# How many times as many clusters the finer ones have.
FINER = (1.5, 2.0, 3.0)
# Equal shares must be equal points whatever the last bits of a division are.
DECIMALS = 9


def cluster_states(process: FiniteProcess, counts: Counts, settings: LearnSettings, clusters: int | None = None) -> Ints:
    """The cluster of each state: k-means over action distributions, with the states' features beside them.

    Args:
        process: with m states in which an action is chosen.
        counts: what was demonstrated.
        settings: constants of the clustering; `cluster_features` 0: the distributions only, as in the paper.
        clusters: how many; None: as the settings say.

    Returns:
        (n,) labels, numbered by the lowest state of each cluster; NO_CLUSTER for states in which no action is chosen.
    """
    points = counts.distribution(settings.laplace)[process.acting]
    if settings.cluster_features:
        points = np.hstack([points, settings.cluster_features * process.features[process.acting]])
    labels = np.full(process.mdp.n_states, NO_CLUSTER)
    number = settings.clusters if clusters is None else clusters
    labels[process.acting] = canonical(k_means(points, number, settings.seed))
    return labels


def finer_clusters(process: FiniteProcess, counts: Counts, settings: LearnSettings) -> list[Ints]:
    """The same with more and more clusters, for questions that may be about any of them; arguments as `cluster_states`."""
    number = cluster_states(process, counts, settings).max() + 1
    return [cluster_states(process, counts, settings, round(more * number)) for more in FINER]


def split(
    features: Floats, labels: Ints, mixed: Iterable[tuple[int, ...]], seed: int, drawn: Iterable[tuple[int, ...]] = (),
) -> Ints:
    """Divide each cluster of which a person said that its states need different actions.

    Args:
        features: (n, f) of the states.
        labels: (n,) from `cluster_states`.
        mixed: ascending states of each cluster that is to be halved by its features; halves of halves may
            be among them.
        seed: of k-means++.
        drawn: ascending states of each part that a person cut off a cluster.

    The largest one that fits the clusters goes first, so that the order in which people spoke leaves no trace.
    """
    labels = labels.copy()
    wanted = [(states, True) for states in set(mixed)] + [(states, False) for states in set(drawn)]
    waiting = sorted(wanted, key=lambda part: (-len(part[0]), part))
    while (fitting := next((part for part in waiting if _fits(labels, *part)), None)) is not None:
        waiting.remove(fitting)
        members = np.array(fitting[0])
        apart = members[k_means(features[members], 2, seed) == 1] if fitting[1] else members
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
    from sklearn.cluster import KMeans  # noqa: PLC0415 - a second to import, and most nodes never cluster

    # Threads that wait for each other take fifty times the time of one where other programs are at work too.
    with _threads().limit(limits=1, user_api='openmp'):
        fitted = KMeans(k, n_init=4, random_state=seed).fit(rows, sample_weight=weights)
    return tuple(fitted.labels_.tolist())


@lru_cache(maxsize=1)
def _threads() -> ThreadpoolController:
    """Looking for the libraries that have threads takes longer than a small fit."""
    return ThreadpoolController()


def canonical(labels: Ints) -> Ints:
    """The same clusters, numbered in the order of their first members."""
    _, first, which = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[which]
