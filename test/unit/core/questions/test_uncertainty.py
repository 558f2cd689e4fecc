"""Definitions 3 and 4, and the orders of clusters."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.core.numerics import entropy
from advise_ros.core.questions.acquisition import ACQUISITIONS, Ranking, cluster_uncertainty, select, unexplained
from advise_ros.core.questions.uncertainty import uncertainty

LABELS = np.array([0, 0, 1, 1, 1, -1])
STATE = np.array([0.5, 0.5, 0.4, 0.4, 0.4, 9.0])


def _ranking(occupancy: tuple[float, ...] = (1.0,) * 6, score: str = 'mean', seed: int = 0) -> Ranking:
    return Ranking(
        LABELS, STATE, np.array(occupancy), score, np.random.default_rng(seed),
        disagreement=STATE, scarcity=STATE, unexplained=STATE,
    )


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
    ranking = Ranking(np.array([0, 1]), np.array([0.5, 0.5 + 1e-9]), np.ones(2), 'mean', np.random.default_rng(0))
    assert select('paper', ranking, np.array([True, True])) == 0


def test_a_disagreement_outweighs_scarcity_and_small_disagreements() -> None:
    labels = np.array([0, 0, 1, 1, 2])
    ranking = Ranking(
        labels, np.ones(5), np.ones(5), 'mean', np.random.default_rng(0),
        disagreement=np.array([0.3, 0.3, 0.0, 0.0, 0.5]), scarcity=np.array([0.1, 0.1, 1.3, 1.3, 0.1]),
    )
    assert select('disagreement', ranking, np.array([True, True, True])) == 2
    assert select('disagreement', ranking._replace(occupancy=np.array([1.0, 1, 1, 1, 0])), np.array([True] * 3)) == 0


def test_the_mixed_schedule_begins_by_visits_and_ends_by_the_papers_score() -> None:
    ranking = _ranking((0.1, 0.1, 1.0, 1.0, 1.0, 5.0))
    assert [select('mixed', ranking._replace(asked=asked), np.array([True, True])) for asked in (0, 2, 3, 9)] == [1, 1, 0, 0]


def test_what_the_reward_does_not_explain() -> None:
    q = np.array([[1.0, 0.9, 0.0], [1.0, 0.5, 0.0], [0.2, 0.8, 0.0], [0.0, 0.0, 0.0]])
    assert unexplained(q, np.array([0, 0, 0, -1]), 0.2) == pytest.approx([0.1, 0.0, 0.8, 0.2])


def test_random_order_is_seeded_and_varies() -> None:
    chosen = [select('random', _ranking(seed=seed), np.array([True, True])) for seed in range(20)]
    assert set(chosen) == {0, 1}
    assert chosen == [select('random', _ranking(seed=seed), np.array([True, True])) for seed in range(20)]
