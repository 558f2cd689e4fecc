"""One trial of a way to ask: clusters, questions and answers, by the same code as the learner on the grid."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from advise_ros.core.advice.advice import AdviceRecord, Verdict
from advise_ros.core.advice.answer_beliefs import BELIEF, BY_WORTH
from advise_ros.core.advice.confirmation import agreed, unconfirmed
from advise_ros.core.advice.contradictions import advice_in, preferences
from advise_ros.core.advice.imitation import imitated
from advise_ros.core.irl.program import Evidence
from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.planning.process import boltzmann, greedy, occupancy
from advise_ros.core.questions.acquisition import Ranking, cluster_uncertainty, doubt, select, unexplained
from advise_ros.core.questions.expected_corrections import Known, Worth, in_effect, worth
from advise_ros.core.questions.uncertainty import sources, uncertainty
from advise_ros.domains.people import advise
from advise_ros.experiments.learner import Fitted, fit, fit_to
from advise_ros.experiments.method import Method, Protocol
from advise_ros.experiments.trial import DECIMALS, Shown, show

BUDGET = 10


@dataclass(frozen=True)
class Variant(Method):
    """A way to ask.

    Attributes:
        temperature: of the Boltzmann policy; None: the protocol's.
        confirm: whether doubtful answers are asked for again.
    """

    temperature: float | None = None
    confirm: bool = False


class Interview(NamedTuple):
    """What came of a trial.

    Attributes:
        performance: after 0, 1, ... questions.
        doubt: what the best open question was worth then, as `LearnerStatus.doubt_left`.
    """

    performance: tuple[float, ...]
    doubt: tuple[float, ...]


def interviews(protocol: Protocol, variants: tuple[Variant, ...], seed: int) -> list[Interview]:
    """Each variant on the same demonstrations."""
    shown = show(protocol, seed)
    first = fit(shown.domain, protocol, shown.counts, {})
    return [_interview(shown, variant, first) for variant in variants]


class _Stand(NamedTuple):
    """What is known after some answers, which clusters are open, and what questions are worth where that decides."""

    fitted: Fitted
    ranking: Ranking
    open: Bools
    worth: Worth | None

    @property
    def doubt_left(self) -> float:
        """As `core.queries.Asking`."""
        if self.worth is not None:
            return self.worth.most
        visits = self.ranking.occupancy
        worth: Floats = cluster_uncertainty(self.ranking.labels, doubt(self.ranking) * visits, 'sum')
        return float(worth[self.open].max(initial=0.0)) / float(visits[self.ranking.labels >= 0].sum())


def _interview(shown: Shown, variant: Variant, first: Fitted) -> Interview:
    visits = shown.counts.visits[shown.domain.acting]
    variant = replace(variant, acquisition=in_effect(variant.acquisition, visits))
    if variant.acquisition == BELIEF:
        first = _fitted(shown, variant, (), first)
    stands = list(_stands(shown, variant, first))
    performance = [round(stand.fitted.performance, DECIMALS) for stand in stands]
    doubts = [round(stand.doubt_left, DECIMALS) for stand in stands]
    missing = BUDGET + 1 - len(stands)
    return Interview((*performance, *performance[-1:] * missing), (*doubts, *[0.0] * missing))


def _stands(shown: Shown, variant: Variant, fitted: Fitted) -> Iterator[_Stand]:
    """Until the budget is spent or nothing is left to ask."""
    labels, expert = shown.clusters(variant), shown.generator('expert')
    asked = np.zeros(labels.max() + 1, dtype=np.bool_)
    log: tuple[AdviceRecord, ...] = ()
    for number in range(1, BUDGET + 2):
        ranking = _ranking(shown, variant, labels, (fitted, log))
        stand = _Stand(fitted, ranking, ~asked, _worth(shown, variant, ranking, (fitted, log)))
        yield stand
        states = _states(shown, variant, stand, log)
        if states is None:
            return
        asked[labels[states[0]]] = True
        log += (_answer(shown, states, number, expert),)
        fitted = _fitted(shown, variant, log, fitted)


def _ranking(
    shown: Shown, variant: Variant, labels: Ints, known: tuple[Fitted, tuple[AdviceRecord, ...]],
) -> Ranking:
    domain, counts, protocol = shown.domain, shown.counts, shown.protocol
    fitted, log = known
    probabilities = boltzmann(fitted.q, variant.temperature or protocol.temperature)
    return Ranking(
        labels,
        uncertainty(counts.distribution(protocol.laplace), probabilities, protocol.w_p).state,
        occupancy(domain.mdp, probabilities, domain.start),
        protocol.score,
        np.random.default_rng([shown.seed, len(log)]),
        *sources(counts.taken, protocol.laplace),
        unexplained(fitted.q, counts.favourite(), protocol.terms.margin_cap),
        len(advice_in(log)),
    )


def _worth(
    shown: Shown, variant: Variant, ranking: Ranking, known: tuple[Fitted, tuple[AdviceRecord, ...]],
) -> Worth | None:
    if variant.acquisition not in BY_WORTH:
        return None
    fitted, log = known
    held = _held(shown, variant, log)
    favourite, advice = imitated(variant.acquisition, shown.counts, held)
    so_far = Known(shown.counts.taken, favourite, greedy(fitted.q), ranking.occupancy, log, held, advice)
    return worth(shown.partitions(variant), so_far)


def _states(shown: Shown, variant: Variant, stand: _Stand, log: tuple[AdviceRecord, ...]) -> Ints | None:
    """What is asked about next."""
    again = unconfirmed(log, shown.counts.taken) if variant.confirm else None
    if again is not None:
        return np.array(again.states)
    if stand.worth is not None:
        return stand.worth.best()
    chosen = select(variant.acquisition, stand.ranking, stand.open)
    return None if chosen is None else np.flatnonzero(stand.ranking.labels == chosen)


def _answer(shown: Shown, states: Ints, number: int, expert: np.random.Generator) -> AdviceRecord:
    said = advise(shown.protocol.expert, shown.domain.optimal[states], expert)
    preferred, avoided = ((), ()) if said is None else said
    verdict = Verdict.SKIP if said is None else Verdict.ANSWER
    return AdviceRecord(number, number, tuple(states.tolist()), preferred, avoided, verdict)


def _fitted(shown: Shown, variant: Variant, log: tuple[AdviceRecord, ...], near: Fitted) -> Fitted:
    favourite, advice = imitated(variant.acquisition, shown.counts, _held(shown, variant, log))
    return fit_to(shown.domain, shown.protocol, Evidence(favourite, preferences(advice)), near.solution)


def _held(shown: Shown, variant: Variant, log: tuple[AdviceRecord, ...]) -> tuple[AdviceRecord, ...]:
    return agreed(advice_in(log), shown.counts.taken) if variant.confirm else advice_in(log)


def with_errors(protocol: Protocol, rate: float) -> Protocol:
    """The protocol with an expert who is wrong so often."""
    return replace(protocol, expert=replace(protocol.expert, error_rate=rate))
