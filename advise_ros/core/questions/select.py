"""SELECTQUERY of algorithm 1: which cluster is asked about next, and the query for the person."""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from advise_ros.core.advice.advice import AdviceRecord, Query, Verdict, active
from advise_ros.core.advice.answer_beliefs import BY_WORTH
from advise_ros.core.advice.confirmation import agreed, support, unconfirmed
from advise_ros.core.advice.contradictions import advice_in
from advise_ros.core.advice.imitation import imitated
from advise_ros.core.demonstrations.action_counts import Counts
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.reward import Inferred
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.planning.process import Mdp, occupancy
from advise_ros.core.questions.acquisition import Ranking, cluster_uncertainty, doubt, select, unexplained
from advise_ros.core.questions.expected_corrections import Known, Worth, worth
from advise_ros.core.questions.grid_clusters import finer_clusters
from advise_ros.core.questions.uncertainty import Uncertainty, sources
from advise_ros.core.questions.wording import Asked, question

if TYPE_CHECKING:
    from advise_ros.core.site.belief import SiteBelief


class Situation(NamedTuple):
    """Everything that a question is made from."""

    grid: Grid
    settings: LearnSettings
    mdp: Mdp
    counts: Counts
    demonstrated: Floats
    inferred: Inferred
    unsure: Uncertainty
    clusters: Ints
    belief: SiteBelief | None = None


class Numbering(NamedTuple):
    """What the session counts: the policy's version, the next query's id and the budget (-1 unlimited)."""

    version: int
    query_id: int
    budget: int


class Asking(NamedTuple):
    """What is asked next.

    Attributes:
        query: the question, None when the budget is spent, no cluster is open or there is enough advice.
        doubt_left: what the open cluster is worth that is worth most: how much the demonstrations contradict one
            another where the policy goes, a visit [nat^2]; with the acquisitions 'gain' and 'belief' the share of the
            policy's visits that the best question is expected to put right; with `site` the steps that its answer saves.
        enough: it is worth less than the settings' `enough`.
    """

    query: Query | None
    doubt_left: float
    enough: bool


def next_query(situation: Situation, log: tuple[AdviceRecord, ...], numbering: Numbering) -> Asking:
    """SELECTQUERY, after a doubtful answer the same question again."""
    settings, prospect = situation.settings, _prospect(situation, log)
    if budget_left(log, numbering.budget) == 0:
        return Asking(None, prospect.left, False)
    again = unconfirmed(log, situation.counts.taken) if settings.confirms else None
    if again is not None:
        return Asking(_query(situation, np.array(again.states), log, numbering, again), prospect.left, False)
    enough = settings.enough if situation.belief is None else _within_advise().enough_of(settings.enough)
    if prospect.states is None or prospect.left < enough:
        return Asking(None, prospect.left, prospect.states is not None or situation.belief is not None)
    return Asking(_query(situation, prospect.states, log, numbering), prospect.left, False)


def _within_advise() -> ModuleType:
    from advise_ros.core.site import within_advise  # noqa: PLC0415 - compiled loops take half a second to import

    return within_advise


class _Prospect(NamedTuple):
    """States of the best question, None when none is open, and what it is worth."""

    states: Ints | None
    left: float


def _prospect(situation: Situation, log: tuple[AdviceRecord, ...]) -> _Prospect:
    if situation.belief is not None:
        question = _within_advise().ask(situation.grid, situation.belief, log, situation.settings.seed)
        return _Prospect(None, 0.0) if question is None else _Prospect(np.array(question.states), question.worth)
    if situation.settings.acquisition in BY_WORTH:
        found = _worth(situation, log)
        return _Prospect(found.best(), found.most)
    ranking = _ranking(situation, log)
    candidates = open_clusters(situation.clusters, _covered(situation.grid, log))
    chosen = select(situation.settings.acquisition, ranking, candidates)
    states = None if chosen is None else np.flatnonzero(situation.clusters == chosen)
    return _Prospect(states, _doubt_left(ranking, candidates))


def _worth(situation: Situation, log: tuple[AdviceRecord, ...]) -> Worth:
    """Of questions about clusters, finer ones and single states."""
    counts, held = situation.counts, advice_in(log)
    if situation.settings.confirms:
        held = agreed(held, counts.taken)
    partitions = [situation.clusters, *finer_clusters(situation.grid, counts, situation.settings)]
    favourite, advice = imitated(situation.settings.acquisition, counts, held)
    return worth(partitions, Known(
        counts.taken, favourite, situation.inferred.greedy, _visits(situation), log, held, advice,
    ))


def _doubt_left(ranking: Ranking, candidates: Bools) -> float:
    """Of the open cluster that is worth most, a visit; 0 when none is open."""
    worth = cluster_uncertainty(ranking.labels, doubt(ranking) * ranking.occupancy, 'sum')
    visits = float(ranking.occupancy[ranking.labels >= 0].sum())
    return float(worth[candidates].max(initial=0.0)) / max(visits, np.finfo(float).tiny)


def budget_left(log: tuple[AdviceRecord, ...], budget: int) -> int:
    """Answers left, -1 unlimited; skipping costs nothing, and what is taken back is given back."""
    spent = sum(record.verdict is Verdict.ANSWER for record in active(log))
    return -1 if budget < 0 else max(0, budget - spent)


def open_clusters(labels: Ints, covered: Bools) -> Bools:
    """Clusters that were not asked about: less than half of the states are covered by earlier questions.

    So each cluster is asked once, and again only when new demonstrations have made another of it.
    """
    members = labels >= 0
    share = np.bincount(labels[members], weights=covered[members]) / np.bincount(labels[members])
    return share < 0.5


def _covered(grid: Grid, log: tuple[AdviceRecord, ...]) -> Bools:
    """States that the person was asked about; a cluster that was MIXED or SPLIT is asked about again in parts."""
    covered = np.zeros(grid.n_states, dtype=np.bool_)
    for record in active(log):
        parted = record.verdict is Verdict.SPLIT or (record.verdict is Verdict.MIXED and len(record.states) > 1)
        if not parted:
            covered[list(record.states)] = True
    return covered


def mixed(log: tuple[AdviceRecord, ...]) -> list[tuple[int, ...]]:
    """The clusters whose states need different actions, as the person said."""
    return [record.states for record in active(log) if record.verdict is Verdict.MIXED]


def drawn(log: tuple[AdviceRecord, ...]) -> list[tuple[int, ...]]:
    """The parts that the person cut off a cluster."""
    return [record.states for record in active(log) if record.verdict is Verdict.SPLIT]


def _ranking(situation: Situation, log: tuple[AdviceRecord, ...]) -> Ranking:
    settings = situation.settings
    disagreement, scarcity = sources(situation.counts.taken, settings.laplace)
    return Ranking(
        situation.clusters,
        situation.unsure.state,
        _visits(situation),
        settings.cluster_score,
        np.random.default_rng([settings.seed, len(active(log))]),
        disagreement,
        scarcity,
        unexplained(situation.inferred.q, situation.counts.favourite(), settings.margin_cap),
        len(advice_in(log)),
    )


def _visits(situation: Situation) -> Floats:
    """(n,) that the policy is expected to pay."""
    start = np.zeros(situation.grid.n_states)
    start[situation.grid.start_state()] = 1.0
    return occupancy(situation.mdp, situation.inferred.probabilities, start)


def _query(
    situation: Situation, states: Ints, log: tuple[AdviceRecord, ...], numbering: Numbering,
    again: AdviceRecord | None = None,
) -> Query:
    advised = {state for record in advice_in(log) for state in record.states}
    inferred, unsure, settings = situation.inferred, situation.unsure, situation.settings
    one = np.where(np.isin(np.arange(situation.grid.n_states), states), 0, -1)
    disagreement, scarcity = (float(part.mean()) for part in sources(situation.counts.taken[states], settings.laplace))
    asked = Asked(
        states, situation.counts.taken[states], inferred.greedy[states], scarcity > disagreement,
        (again.preferred, *support(situation.counts.taken, again)) if again else None,
    )
    return Query(
        query_id=numbering.query_id,
        policy_version=numbering.version,
        states=tuple(states.tolist()),
        uncertainty=float(cluster_uncertainty(one, unsure.state, settings.cluster_score)[0]),
        demonstration_uncertainty=float(unsure.demonstrations[states].mean()),
        policy_uncertainty=float(unsure.policy[states].mean()),
        demonstrated=tuple(situation.demonstrated[states].mean(axis=0).tolist()),
        policy=tuple(inferred.probabilities[states].mean(axis=0).tolist()),
        answered_before=tuple(sorted(advised.intersection(states.tolist()))),
        budget_left=budget_left(log, numbering.budget),
        question=question(situation.grid, asked),
        disagreement=disagreement,
        scarcity=scarcity,
    )
