"""k-means that gives equal points one cluster, and cluster numbers that do not depend on the way they were found."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from threadpoolctl import ThreadpoolController

from advise_ros.core.numerics import Floats, Ints

# Equal shares must be equal points whatever the last bits of a division are.
DECIMALS = 9


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
