"""Clusters by evidence: states are joined while their demonstrations speak for one behaviour and they lie together.

Joining two groups of states costs, in nat,

    log L(i) + log L(j) - log L(i and j)  +  tightness |i||j| / (|i| + |j|) (distance of their centres)^2

L is the Dirichlet-multinomial likelihood of a group's pooled counts (all its states have one unknown action
distribution, prior Dirichlet(PRIOR)); the second part is Ward's cost in the structure of the states. The cheapest pair
is joined first, ties to the lowest states, until the cheapest costs more than LIMIT: so the demonstrations and the
structure say how many clusters there are. Where moves are few the counts say little about a state, and less of what
they say is the kind of states it belongs to: below SETTLED moves a state their part is scaled down.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.special import gammaln

from advise_ros.core.numerics import Floats, Ints, first_best

# All four were chosen on seeds of their own; docs/method.md tells what they are worth.
PRIOR = 0.3
LIMIT = 10.0
SETTLED = 40.0
TIGHTNESS = 3.0
# Joining looks at all pairs; of more states, groups of neighbours with like moves are joined instead.
MOST = 1000


class _Groups(NamedTuple):
    """What is known of each group; the arrays are changed in place, the row of a joined group is dead.

    Attributes:
        taken: (m, n_actions) pooled counts.
        centre: (m, f) mean structure.
        size: (m,) states.
        likelihood: (m,) log L.
        dead: (m,) whether a group was joined to another.
    """

    taken: Floats
    centre: Floats
    size: Floats
    likelihood: Floats
    dead: Floats

    def costs(self, i: int, counted: float, tightness: float) -> Floats:
        """(m,) of joining group i with each other; infinite with itself and the dead."""
        pooled = self.likelihood[i] + self.likelihood - likelihood(self.taken[i] + self.taken)
        apart = ((self.centre - self.centre[i]) ** 2).sum(axis=1)
        costs: Floats = counted * pooled + tightness * self.size[i] * self.size / (self.size[i] + self.size) * apart
        costs = costs + self.dead
        costs[i] = np.inf
        return costs

    def join(self, i: int, j: int) -> None:
        """Group j becomes part of group i."""
        both = self.size[i] + self.size[j]
        self.centre[i] = (self.size[i] * self.centre[i] + self.size[j] * self.centre[j]) / both
        self.taken[i] += self.taken[j]
        self.size[i] = both
        self.likelihood[i] = likelihood(self.taken[i])
        self.dead[j] = np.inf


def likelihood(taken: Floats) -> Floats:
    """Log Dirichlet-multinomial likelihood of counts (..., n_actions) as one behaviour, without the orderings."""
    prior = PRIOR * taken.shape[-1]
    whole: Floats = gammaln(prior) - gammaln(prior + taken.sum(axis=-1))
    return whole + (gammaln(PRIOR + taken) - gammaln(PRIOR)).sum(axis=-1)


def merge(taken: Ints, structure: Floats, tightness: float, clusters: int) -> Ints:
    """The cluster of each state; remembered, because answers change neither the demonstrations nor their clusters.

    Args:
        taken: (m, n_actions) how often each action was demonstrated.
        structure: (m, f) features of the states, in comparable units.
        tightness: weight of the structure, TIGHTNESS where nothing else is known.
        clusters: how many, 0: as many as the evidence tells apart.

    Returns:
        (m,) labels: the lowest state of each cluster, or with more than MOST states that of its lowest group.
    """
    shape = (len(taken), taken.shape[1])
    merged = _merged(taken.astype(np.int64).tobytes(), structure.astype(float).tobytes(), shape, (tightness, clusters))
    return np.frombuffer(merged, dtype=np.int64)


@lru_cache(maxsize=16)
def _merged(taken: bytes, structure: bytes, shape: tuple[int, int], wanted: tuple[float, int]) -> bytes:
    counts = np.frombuffer(taken, dtype=np.int64).reshape(shape).astype(np.float64)
    features = np.frombuffer(structure).reshape(len(counts), -1)
    if len(counts) <= MOST:
        return _join(_alone(counts, features.copy()), *wanted).tobytes()
    group = _grouped(counts, features)
    return _join(_pooled(counts, features, group), *wanted)[group].tobytes()


def _alone(counts: Floats, structure: Floats) -> _Groups:
    return _Groups(counts, structure, np.ones(len(counts)), likelihood(counts), np.zeros(len(counts)))


def _grouped(counts: Floats, structure: Floats) -> Ints:
    """(m,) small groups, numbered without a gap."""
    points = np.hstack([(counts + 1.0) / (counts + 1.0).sum(axis=1, keepdims=True), structure])
    from sklearn.cluster import MiniBatchKMeans  # noqa: PLC0415 - a second to import, and most nodes never cluster

    fitted = MiniBatchKMeans(MOST // 2, n_init=1, batch_size=4096, random_state=0).fit(points)
    _, group = np.unique(fitted.labels_, return_inverse=True)
    return group.astype(np.int64)


def _pooled(counts: Floats, structure: Floats, group: Ints) -> _Groups:
    size = np.bincount(group).astype(np.float64)
    pooled: Floats = np.stack([np.bincount(group, weights=column) for column in counts.T], axis=1).astype(np.float64)
    centre = np.stack([np.bincount(group, weights=column) for column in structure.T], axis=1) / size[:, None]
    return _Groups(pooled, centre, size, likelihood(pooled), np.zeros(len(size)))


def _join(groups: _Groups, tightness: float, clusters: int) -> Ints:
    """Each group's label: the lowest that it was joined with."""
    m = len(groups.size)
    counted = min(1.0, float(groups.taken.sum()) / float(groups.size.sum()) / SETTLED)
    labels = np.arange(m)
    costs = np.array([groups.costs(i, counted, tightness) for i in range(m)])
    cheapest = costs.argmin(axis=1)
    for _ in range(m - max(clusters, 1)):
        i = int(first_best(-_finite(costs[np.arange(m), cheapest])))
        j = int(cheapest[i])
        if not clusters and costs[i, j] > LIMIT:
            break
        i, j = min(i, j), max(i, j)
        groups.join(i, j)
        labels[labels == j] = i
        _update(costs, cheapest, groups.costs(i, counted, tightness), (i, j))
    return labels


def _finite(costs: Floats) -> Floats:
    """Costs that can be compared by tolerance."""
    top = costs[np.isfinite(costs)].max(initial=0.0)
    return np.minimum(costs, 2.0 * top + 1.0)


def _update(costs: Floats, cheapest: Ints, joined: Floats, pair: tuple[int, int]) -> None:
    """New costs of the joined group, none of the one that is gone, and who is cheapest for whom."""
    i, j = pair
    costs[j], costs[:, j] = np.inf, np.inf
    costs[i], costs[:, i] = joined, joined
    stale = (cheapest == i) | (cheapest == j)
    stale[[i, j]] = True
    better = joined < costs[np.arange(len(costs)), cheapest]
    cheapest[better] = i
    cheapest[stale] = costs[stale].argmin(axis=1)
