"""STATECLUSTERING in any domain: the core's by name, its extremes, and ideal clusters with states displaced (figure 6)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.demonstrations.action_counts import Counts
from advise_ros.core.numerics import Ints
from advise_ros.core.questions import clusterings
from advise_ros.core.questions.clusterings import Terrain, Wanted
from advise_ros.core.questions.grid_clusters import NO_CLUSTER
from advise_ros.core.questions.kmeans import canonical
from advise_ros.domains.domain import Domain
from advise_ros.experiments.method import Method, Protocol


class Clustering(NamedTuple):
    """What a clustering may look at.

    Attributes:
        counts: what was demonstrated.
        seed: of k-means++.
        rng: of displacements.
    """

    domain: Domain
    protocol: Protocol
    counts: Counts
    seed: int
    rng: np.random.Generator

    def labels(self, method: Method) -> Ints:
        """(n,) labels, numbered by the lowest state of each cluster; NO_CLUSTER where the task has ended."""
        acting = self.domain.acting
        labels = np.full(self.domain.mdp.n_states, NO_CLUSTER)
        if method.clustering == 'states':
            labels[acting] = np.arange(len(acting))
        elif method.clustering == 'ideal':
            labels[acting] = canonical(self._ideal(method.quality))
        else:
            labels[acting] = self._found(method)
        return labels

    def partitions(self, method: Method) -> list[Ints]:
        """The labels (n,) of a method's clusters, and of finer ones."""
        partitions = [self.labels(method)]
        for found in clusterings.finer(method.clustering, self._terrain(), self._wanted(method)):
            labels = np.full(self.domain.mdp.n_states, NO_CLUSTER)
            labels[self.domain.acting] = found
            partitions.append(labels)
        return partitions

    def _ideal(self, quality: float) -> Ints:
        """States with the same optimal action; `1 - quality` of them displaced into another cluster, drawn evenly."""
        kinds, labels = np.unique(self.domain.habit[self.domain.acting], return_inverse=True)
        displaced = self.rng.permutation(len(labels))[: round((1.0 - quality) * len(labels))]
        labels[displaced] = (labels[displaced] + self.rng.integers(1, len(kinds), len(displaced))) % len(kinds)
        return labels

    def _found(self, method: Method) -> Ints:
        """By one of the core's clusterings."""
        return clusterings.cluster(method.clustering, self._terrain(), self._wanted(method))

    def _terrain(self) -> Terrain:
        domain, acting = self.domain, self.domain.acting
        return Terrain(domain.mdp, acting, self.counts.taken[acting], self.protocol.laplace, domain.features[acting])

    def _wanted(self, method: Method) -> Wanted:
        number = self.protocol.clusters if method.clusters is None else method.clusters
        return Wanted(number, method.features, self.seed)


def quality(domain: Domain, labels: Ints) -> float:
    """Section 4's: the share of states for which the plurality's action of their cluster is optimal."""
    votes = np.array([domain.optimal[labels == label].sum(axis=0) for label in range(labels.max() + 1)])
    return float(votes.max(axis=1).sum()) / len(domain.acting)
