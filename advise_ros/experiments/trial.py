"""One trial: demonstrations of one person, then questions one after the other, by the learner that flies."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import NamedTuple
from zlib import crc32

import numpy as np

from advise_ros.core.advice.advice import AdviceRecord, Verdict
from advise_ros.core.advice.answer_beliefs import BELIEF
from advise_ros.core.advice.state import advice_state
from advise_ros.core.demonstrations.demonstration import Counts
from advise_ros.core.irl.program import Problem, Solution
from advise_ros.core.irl.reward import Solve
from advise_ros.core.learning.algorithm import improve, in_effect
from advise_ros.core.numerics import Ints, is_best
from advise_ros.core.people.simulated_demonstrator import demonstrate_task
from advise_ros.core.people.simulated_expert import reply
from advise_ros.core.questions.select import Selection, Situation
from advise_ros.domains.domain import Domain, split_ties
from advise_ros.experiments.clusterings import Clustering, quality
from advise_ros.experiments.method import METHODS, Method, Protocol
from advise_ros.experiments.optimum import optimum
from advise_ros.experiments.recorded import Recorded, domain_of

# What is kept of a value: what machines and numbers of threads differ in is far below.
DECIMALS = 6
Log = tuple[AdviceRecord, ...]


class Shown(NamedTuple):
    """What the demonstrator of a trial did."""

    domain: Domain
    protocol: Protocol
    seed: int
    counts: Counts

    def generator(self, purpose: str) -> np.random.Generator:
        """Random numbers for one purpose, the same whatever else is drawn in the trial."""
        return np.random.default_rng([self.seed, crc32(purpose.encode())])

    def clusters(self, method: Method) -> Ints:
        """(n,) labels of a method's clusters."""
        settings = self.protocol.settings(method, self.seed)
        return Clustering(self.domain, self.counts, settings, self.generator('displaced')).labels(method)

    def learn(self, method: Method, clusters: Ints, log: Log, solve: Solve) -> Situation:
        """What is learnt after the answers of a log.

        Args:
            method: how the learner asks.
            clusters: (n,) labels.
            log: answers.
            solve: finds an optimum of equation (1).
        """
        return improve(self.domain.process, self.protocol.settings(method, self.seed), self.counts, clusters, log, solve)

    def optimum(self, near: Solution | None = None) -> Solve:
        """The protocol's solver, which may begin at the optimum of a neighbouring problem."""
        return partial(optimum, solver=self.protocol.solver, near=near)

    def performance(self, situation: Situation) -> float:
        """Of the greedy policy, ties divided, in the unit of the domain's measure."""
        return round(self.domain.performance(split_ties(is_best(situation.inferred.q))), DECIMALS)

    def first(self) -> Solution:
        """The optimum without any answer, which all methods share."""
        method = METHODS['trajectories']
        return self.learn(method, np.full(self.domain.mdp.n_states, -1), (), self.optimum()).inferred.solution


def show(protocol: Protocol, seed: int) -> Shown:
    """The demonstrations of a trial."""
    domain, rng = domain_of(protocol.domain), np.random.default_rng([seed, crc32(b'demonstrator')])
    person = protocol.demonstrator
    counts = person.demonstrate(rng) if isinstance(person, Recorded) else demonstrate_task(domain, person, rng)
    return Shown(domain, protocol, seed, counts)


class Dialogue:
    """Questions of one method to one simulated expert.

    Args:
        shown: what is learnt from beside the answers.
        method: how the learner asks.
        first: the optimum without any answer.
        rng: of orders that draw; None: the learner's own.

    Attributes:
        log: answers so far.
        situation: what was learnt last.
        selection: of the next question.
        performance: of the newest policy, in the unit of the domain's measure.
    """

    def __init__(self, shown: Shown, method: Method, first: Solution, rng: np.random.Generator | None = None) -> None:
        self._shown, self._method, self._rng = shown, method, rng
        self._expert, self._clusters = shown.generator('expert'), shown.clusters(method)
        self.log: Log = ()
        self.situation: Situation
        self.selection: Selection
        self.performance: float
        self._learn(self._beginning(first))

    def _beginning(self, first: Solution) -> Solve:
        """Without answers only what is believed can differ from what all methods learn first."""
        shown = self._shown
        visits = shown.counts.visits[shown.domain.acting]
        if in_effect(self._method.acquisition, visits) == BELIEF:
            return shown.optimum(first)

        def same(_: Problem) -> Solution:
            return first

        return same

    @property
    def n_clusters(self) -> int:
        """How many there are to ask about."""
        return int(self._clusters.max()) + 1

    def ask(self) -> bool:
        """Ask the next question; False when none is left. The policy stays as it is until `learn`."""
        question = self.selection.question()
        if question is None:
            return False
        said = reply(self._shown.protocol.expert, self._shown.domain.optimal[question.states], self._expert)
        number, states = len(self.log) + 1, tuple(question.states.tolist())
        # Domains have no halves of clusters to ask about: whoever cannot answer for a cluster skips it.
        verdict = Verdict.ANSWER if said.verdict is Verdict.ANSWER else Verdict.SKIP
        self.log += (AdviceRecord(number, number, states, said.preferred, said.avoided, verdict),)
        taken = self._shown.counts.taken if self.situation.settings.confirms else None
        self.selection = Selection(replace(self.situation, advice=advice_state(self.log, taken)), self._rng)
        return True

    def learn(self) -> None:
        """Learn from all answers."""
        self._learn(self._shown.optimum(self.situation.inferred.solution))

    def _learn(self, solve: Solve) -> None:
        self.situation = self._shown.learn(self._method, self._clusters, self.log, solve)
        self.selection = Selection(self.situation, self._rng)
        self.performance = self._shown.performance(self.situation)


def curves(protocol: Protocol, methods: tuple[Method, ...], seed: int) -> dict[str, tuple[float, ...]]:
    """Performance at the protocol's points by each method, by its name, all on the same demonstrations."""
    shown = show(protocol, seed)
    first = shown.first()
    return {method.name: _curve(shown, method, first) for method in methods}


def cluster_quality(protocol: Protocol, method: Method, seed: int) -> float:
    """Quality of a method's clusters, 0 to 1; nothing is learnt for it."""
    shown = show(protocol, seed)
    return round(quality(shown.domain, shown.clusters(method)), DECIMALS)


def _curve(shown: Shown, method: Method, first: Solution) -> tuple[float, ...]:
    """It stays where it is when nothing is left to ask."""
    protocol = shown.protocol
    dialogue = Dialogue(shown, method, first, shown.generator(method.acquisition))
    values = {0: dialogue.performance}
    most = protocol.budget if method.budget is None else min(protocol.budget, method.budget)
    budget = min(most, dialogue.n_clusters) if method.acquisition else 0
    for asked in range(1, budget + 1):
        dialogue.ask()
        if not _is_blind(dialogue.situation) or asked in protocol.points or asked == budget:
            dialogue.learn()
            values[asked] = dialogue.performance
    last = dialogue.performance
    return tuple(values.get(asked, last) for asked in protocol.points)


def _is_blind(situation: Situation) -> bool:
    """Whether the choice of a question does not look at the policy, so that none has to be learnt for it."""
    settings = situation.settings
    return settings.acquisition == 'random' or (settings.acquisition == 'paper' and settings.w_p == 1.0)
