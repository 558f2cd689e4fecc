"""Answers that cannot hold together are named, and no others."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.advice.state import Imitated, preferences, reversed_pair
from advise_ros.core.errors import InputError
from advise_ros.core.irl import reward
from advise_ros.core.irl.program import Evidence, Problem, pose
from advise_ros.core.irl.reward import conflicting, infer, solver_by_name
from advise_ros.core.irl.settings import LearnSettings, Terms
from advise_ros.core.planning.process import Mdp
from support.learning import record

NOTHING = np.full(5, -1)
CIRCLE = tuple(record(1 + state, [state], [0], [1]) for state in range(3))
HARMLESS = record(4, [3], [0], [1])


@pytest.fixture
def ring() -> Mdp:
    """States 0, 1, 2 in a ring: action 0 leads to the next, 1 to the one after; 3 leads to 4 or 0, 4 stays."""
    targets = np.array([[1, 2, 0, 4, 4], [2, 0, 1, 0, 4]])
    stacked = np.zeros((10, 5))
    stacked[np.arange(10), targets.ravel()] = 1.0
    return Mdp(sparse.csr_array(stacked), 0.9)


def posed(mdp: Mdp, records: tuple[AdviceRecord, ...], terms: Terms | None = None) -> Problem:
    return pose(mdp, Evidence(NOTHING, preferences(records)), terms or Terms())


def test_three_answers_that_lead_round_in_a_circle_are_named_and_the_harmless_one_is_not(ring: Mdp) -> None:
    """Each asks for more worth at the next state than at the one after: no order of three fulfils that."""
    records = (HARMLESS, *CIRCLE)
    assert conflicting(posed(ring, records), records) == (1, 2, 3)


@pytest.mark.parametrize('left_out', range(3))
def test_without_any_one_of_them_the_others_hold(ring: Mdp, left_out: int) -> None:
    records = tuple(one for number, one in enumerate(CIRCLE) if number != left_out)
    assert conflicting(posed(ring, records), records) == ()


def test_opposed_answers_are_named_beside_a_circle_of_others(ring: Mdp) -> None:
    records = (*CIRCLE, HARMLESS, record(5, [3], [1], [0]))
    assert conflicting(posed(ring, records), records) == (1, 2, 3, 4, 5)


def test_where_it_costs_too_much_only_opposed_answers_are_named(ring: Mdp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reward, 'AFFORDABLE', 0)
    records = (*CIRCLE, HARMLESS, record(5, [3], [1], [0]))
    assert conflicting(posed(ring, records), records) == (4, 5)


def test_learning_goes_on_with_the_elastic_optimum(ring: Mdp) -> None:
    """Round a circle the three margins sum to 0, so the least slack of all together is three times delta."""
    inferred = infer(ring, Imitated(NOTHING, CIRCLE), LearnSettings(margin_cap=0.0), solver_by_name('auto'))
    assert inferred.contradictions == (1, 2, 3)
    assert inferred.solution.objective == pytest.approx(-3 * 0.1 * 1000.0)


def test_strict_advice_names_them_as_it_refuses(ring: Mdp) -> None:
    with pytest.raises(InputError, match='answers 1 and 2 and 3 cannot hold together'):
        infer(ring, Imitated(NOTHING, CIRCLE), LearnSettings(slack_cost=0.0), solver_by_name('auto'))


def test_a_chain_of_wishes_can_hold_where_only_reversed_pairs_oppose(ring: Mdp) -> None:
    """In state 3 an order of two actions, said twice; people take preferred and avoided in one for a contradiction."""
    three = Mdp(sparse.csr_array(np.vstack([ring.stacked.toarray(), np.eye(5)])), 0.9)  # Action 2 stays.
    chain = (record(1, [3], [0], [1]), record(2, [3], [1], [2]))
    assert conflicting(posed(three, chain), chain) == (1, 2)
    assert conflicting(posed(three, chain), chain, reversed_pair) == ()
    turned = (*chain, record(3, [3], [1], [0]))
    assert conflicting(posed(three, turned), turned, reversed_pair) == (1, 3)
