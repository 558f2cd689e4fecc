"""Definitions 3 and 4, and the orders of clusters."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.core.numerics import Floats, entropy
from advise_ros.core.questions.acquisition import ACQUISITIONS, Ranking, select
from advise_ros.core.questions.uncertainty import Sources, cluster_uncertainty, uncertainty

LABELS = np.array([0, 0, 1, 1, 1, -1])
STATE = np.array([0.5, 0.5, 0.4, 0.4, 0.4, 9.0])


def _ranking(occupancy: tuple[float, ...] = (1.0,) * 6, score: str = 'mean', seed: int = 0) -> Ranking:
    sources = Sources(STATE, STATE)
    return Ranking(LABELS, STATE, score, lambda: np.array(occupancy), sources, np.random.default_rng(seed))


def _disagreeing(labels: list[int], state: list[float], sources: Sources, occupancy: list[float]) -> Ranking:
    def visits() -> Floats:
        return np.array(occupancy)

    return Ranking(np.array(labels), np.array(state), 'mean', visits, sources, np.random.default_rng(0))


def test_entropy_of_certainty_and_of_a_fair_die() -> None:
    assert entropy(np.array([[1.0, 0.0, 0.0, 0.0], [0.25] * 4])) == pytest.approx([0.0, np.log(4)])


def test_definition_3_weighs_demonstrations_against_policy() -> None:
    sure, unsure = np.array([[1.0, 0.0]]), np.array([[0.5, 0.5]])
    both = uncertainty(unsure, sure, 0.25)
    assert both.demonstrations == pytest.approx([np.log(2)])
    assert both.policy == pytest.approx([0.0])
    assert both.state == pytest.approx([0.25 * np.log(2)])


def test_definition_4_takes_the_mean_and_algorithm_1_the_sum() -> None:
    assert cluster_uncertainty(LABELS, STATE, 'mean') == pytest.approx([0.5, 0.4])
    assert cluster_uncertainty(LABELS, STATE, 'sum') == pytest.approx([1.0, 1.2])


@pytest.mark.parametrize(
    ('acquisition', 'ranking', 'expected'),
    [
        ('paper', _ranking(), 0),
        ('paper', _ranking(score='sum'), 1),
        ('occupancy', _ranking(), 1),
        ('occupancy', _ranking((1.0, 1.0, 0.1, 0.1, 0.1, 5.0)), 0),
    ],
)
def test_the_cluster_worth_most_is_asked_first(acquisition: str, ranking: Ranking, expected: int) -> None:
    assert select(acquisition, ranking, np.array([True, True])) == expected


@pytest.mark.parametrize('acquisition', sorted(ACQUISITIONS))
def test_closed_clusters_are_not_asked(acquisition: str) -> None:
    assert select(acquisition, _ranking(), np.array([False, True])) == 1
    assert select(acquisition, _ranking(), np.array([False, False])) is None


def test_equal_clusters_are_asked_in_their_order_despite_rounding() -> None:
    nothing = Sources(np.zeros(2), np.zeros(2))
    assert select('paper', _disagreeing([0, 1], [0.5, 0.5 + 1e-9], nothing, [1.0] * 2), np.array([True, True])) == 0


def test_a_disagreement_outweighs_scarcity_and_small_disagreements() -> None:
    labels, sources = [0, 0, 1, 1, 2], Sources(np.array([0.3, 0.3, 0.0, 0.0, 0.5]), np.array([0.1, 0.1, 1.3, 1.3, 0.1]))
    everywhere, not_there = (_disagreeing(labels, [1.0] * 5, sources, [1.0] * 4 + [last]) for last in (1.0, 0.0))
    assert select('disagreement', everywhere, np.array([True] * 3)) == 2
    assert select('disagreement', not_there, np.array([True] * 3)) == 0


@pytest.mark.parametrize('acquisition', ['paper', 'random'])
def test_an_order_that_does_not_look_at_the_policy_does_not_wait_for_its_visits(acquisition: str) -> None:
    def unwanted() -> Floats:
        raise AssertionError('the visits were computed')

    ranking = Ranking(LABELS, STATE, 'mean', unwanted, Sources(STATE, STATE), np.random.default_rng(0))
    assert select(acquisition, ranking, np.array([True, True])) in (0, 1)


def test_random_order_is_seeded_and_varies() -> None:
    chosen = [select('random', _ranking(seed=seed), np.array([True, True])) for seed in range(20)]
    assert set(chosen) == {0, 1}
    assert chosen == [select('random', _ranking(seed=seed), np.array([True, True])) for seed in range(20)]
