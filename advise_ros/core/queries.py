"""SELECTQUERY of algorithm 1: which cluster is asked about next, and the query for the person."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.advice import AdviceRecord, Query, Verdict, active
from advise_ros.core.contradictions import advice_in
from advise_ros.core.counts import Counts
from advise_ros.core.grid import Grid
from advise_ros.core.infer import Inferred
from advise_ros.core.learn_settings import LearnSettings
from advise_ros.core.mdp import Mdp, occupancy
from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.question import Asked, question
from advise_ros.core.uncertainty import Ranking, Uncertainty, cluster_uncertainty, select


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


class Numbering(NamedTuple):
    """What the session counts: the policy's version, the next query's id and the budget (-1 unlimited)."""

    version: int
    query_id: int
    budget: int


def next_query(situation: Situation, log: tuple[AdviceRecord, ...], numbering: Numbering) -> Query | None:
    """The next question, None when the budget is spent or no cluster is open."""
    if budget_left(log, numbering.budget) == 0:
        return None
    candidates = open_clusters(situation.clusters, _covered(situation.grid, log))
    chosen = select(situation.settings.acquisition, _ranking(situation, log), candidates)
    return None if chosen is None else _query(situation, chosen, log, numbering)


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
    settings, start = situation.settings, np.zeros(situation.grid.n_states)
    start[situation.grid.start_state()] = 1.0
    return Ranking(
        situation.clusters,
        situation.unsure.state,
        occupancy(situation.mdp, situation.inferred.probabilities, start),
        settings.cluster_score,
        np.random.default_rng([settings.seed, len(active(log))]),
    )


def _query(situation: Situation, cluster: int, log: tuple[AdviceRecord, ...], numbering: Numbering) -> Query:
    states = np.flatnonzero(situation.clusters == cluster)
    advised = {state for record in advice_in(log) for state in record.states}
    inferred, unsure, settings = situation.inferred, situation.unsure, situation.settings
    scores = cluster_uncertainty(situation.clusters, unsure.state, settings.cluster_score)
    asked = Asked(states, situation.counts.taken[states], inferred.greedy[states])
    return Query(
        query_id=numbering.query_id,
        policy_version=numbering.version,
        states=tuple(states.tolist()),
        uncertainty=float(scores[cluster]),
        demonstration_uncertainty=float(unsure.demonstrations[states].mean()),
        policy_uncertainty=float(unsure.policy[states].mean()),
        demonstrated=tuple(situation.demonstrated[states].mean(axis=0).tolist()),
        policy=tuple(inferred.probabilities[states].mean(axis=0).tolist()),
        answered_before=tuple(sorted(advised.intersection(states.tolist()))),
        budget_left=budget_left(log, numbering.budget),
        question=question(situation.grid, asked, settings.laplace),
    )
