"""Algorithm 1 in any domain, one answer after the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.advice.advice import Preference
from advise_ros.core.demonstrations.action_counts import Counts
from advise_ros.core.irl.program import Evidence, Solution, pose
from advise_ros.core.numerics import Bools, Floats, Ints, is_best
from advise_ros.core.planning.process import boltzmann, occupancy, plan
from advise_ros.core.questions.acquisition import Ranking, select, unexplained
from advise_ros.core.questions.uncertainty import sources, uncertainty
from advise_ros.domains.domain import Domain, split_ties
from advise_ros.domains.people import Advice
from advise_ros.experiments.method import Method, Protocol
from advise_ros.experiments.optimum import optimum


class Fitted(NamedTuple):
    """The policy that follows from the evidence.

    Attributes:
        q: (n, n_actions).
        probabilities: (n, n_actions) Boltzmann policy.
        performance: of the greedy policy, ties divided.
        solution: of equation (1).
    """

    q: Floats
    probabilities: Floats
    performance: float
    solution: Solution


def fit(
    domain: Domain, protocol: Protocol, counts: Counts, advice: dict[int, Preference], near: Solution | None = None
) -> Fitted:
    """IRL of algorithm 1 and the performance of what it learnt."""
    return fit_to(domain, protocol, Evidence(counts.favourite(), advice), near)


def fit_to(domain: Domain, protocol: Protocol, evidence: Evidence, near: Solution | None = None) -> Fitted:
    """The same from any evidence."""
    problem = pose(domain.mdp, evidence, protocol.terms)
    solution = optimum(problem, protocol.solver, near)
    q = plan(domain.mdp, solution.reward, solution.value).q
    return Fitted(q, boltzmann(q, protocol.temperature), domain.performance(split_ties(is_best(q))), solution)


def preference(advice: Advice) -> Preference:
    """An answer as the program reads it, for each of its states."""
    return Preference(advice.preferred, tuple((a, b) for a in advice.preferred for b in advice.avoided))


class Asking(NamedTuple):
    """What the choice of a question rests on.

    Attributes:
        labels: (n,) clusters.
        counts: what was demonstrated.
        rng: for orders that draw.
    """

    domain: Domain
    protocol: Protocol
    method: Method
    labels: Ints
    counts: Counts
    rng: np.random.Generator

    @property
    def blind(self) -> bool:
        """Whether the choice does not look at the policy."""
        return self.method.acquisition == 'random' or (self.method.acquisition == 'paper' and self.protocol.w_p == 1.0)

    def choose(self, fitted: Fitted, asked: Bools) -> int | None:
        """SELECTQUERY: the cluster to ask about next, each once; None when all were."""
        protocol, mdp = self.protocol, self.domain.mdp
        distribution = self.counts.distribution(protocol.laplace)
        # What does not look at the policy is not kept waiting for its visits.
        visits = np.empty(0) if self.blind else occupancy(mdp, fitted.probabilities, self.domain.start)
        ranking = Ranking(
            self.labels, uncertainty(distribution, fitted.probabilities, protocol.w_p).state, visits, protocol.score,
            self.rng, *sources(self.counts.taken, protocol.laplace),
            unexplained(fitted.q, self.counts.favourite(), protocol.terms.margin_cap), int(asked.sum()),
        )
        return select(self.method.acquisition, ranking, ~asked)
