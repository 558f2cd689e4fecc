"""STATECLUSTERING in any domain: the learner's, its extremes, and ideal clusters with states displaced (figure 6)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.demonstrations.demonstration import Counts
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.numerics import Ints
from advise_ros.core.questions.clusters import NO_CLUSTER, canonical, cluster_states
from advise_ros.domains.domain import Domain
from advise_ros.experiments.method import Method


class Clustering(NamedTuple):
    """What a clustering may look at.

    Attributes:
        counts: what was demonstrated.
        settings: of the learner's clustering.
        rng: of displacements.
    """

    domain: Domain
    counts: Counts
    settings: LearnSettings
    rng: np.random.Generator

    def labels(self, method: Method) -> Ints:
        """(n,) labels, numbered by the lowest state of each cluster; NO_CLUSTER where the task has ended."""
        acting = self.domain.acting
        if method.clustering not in ('states', 'ideal'):
            return cluster_states(self.domain.process, self.counts, self.settings)
        labels = np.full(self.domain.mdp.n_states, NO_CLUSTER)
        labels[acting] = np.arange(len(acting)) if method.clustering == 'states' else canonical(self._ideal(method.quality))
        return labels

    def _ideal(self, quality: float) -> Ints:
        """States with the same optimal action; `1 - quality` of them displaced into another cluster, drawn evenly."""
        kinds, labels = np.unique(self.domain.habit[self.domain.acting], return_inverse=True)
        displaced = self.rng.permutation(len(labels))[: round((1.0 - quality) * len(labels))]
        labels[displaced] = (labels[displaced] + self.rng.integers(1, len(kinds), len(displaced))) % len(kinds)
        return labels


def quality(domain: Domain, labels: Ints) -> float:
    """Section 4's: the share of states for which the plurality's action of their cluster is optimal."""
    votes = np.array([domain.optimal[labels == label].sum(axis=0) for label in range(labels.max() + 1)])
    return float(votes.max(axis=1).sum()) / len(domain.acting)
