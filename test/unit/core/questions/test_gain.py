"""What an answer is worth, and which of several answers holds where."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from advise_ros.core.advice.advice import AdviceRecord, Verdict
from advise_ros.core.advice.answer_beliefs import common, with_answers
from advise_ros.core.advice.error_model import log_beliefs, shares
from advise_ros.core.advice.state import Imitated, advice_state, narrowed
from advise_ros.core.demonstrations.demonstration import Counts
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.algorithm import MOVES, in_effect
from advise_ros.core.learning.learner import learn
from advise_ros.core.learning.session import Session
from advise_ros.core.numerics import Ints
from advise_ros.core.questions.expected_corrections import Known, worth
from support.learning import EAST, NORTH, ROUND_TRIP, SOUTH, WEST, answer, flights, record

# Two states flown east, two flown north again and again but east now and then, one flown north.
TAKEN = np.array([[0, 20, 1, 0], [1, 19, 0, 0], [14, 6, 0, 0], [15, 5, 1, 0], [20, 0, 0, 1]])
CLUSTERS = np.array([0, 0, 1, 1, 2])


# So many flights leave enough moves a state for beliefs.
OFTEN = 16


def often(settings: LearnSettings) -> Session:
    """A session with many flights."""
    session = Session(ROUND_TRIP, settings)
    for flight in flights(0, OFTEN):
        session.add(flight)
    session.learn()
    return session


def _known(*answers: AdviceRecord, taken: Ints = TAKEN) -> Known:
    favourite = Counts(taken).favourite()
    greedy, visits = np.zeros(len(taken), dtype=np.int64), np.ones(len(taken))
    return Known(taken, greedy, visits, advice_state(answers), Imitated(favourite, narrowed(answers)))


def test_who_hardly_slips_is_believed_and_who_contradicts_himself_is_not() -> None:
    beliefs = shares(log_beliefs(TAKEN))
    assert beliefs.argmax(axis=1)[[0, 1, 4]].tolist() == [EAST, EAST, NORTH]
    assert (beliefs.max(axis=1)[[0, 1, 4]] > 0.95).all()
    assert (beliefs[2:4, EAST] > beliefs[0, NORTH]).all()


def test_what_was_never_visited_is_not_believed_more_than_its_kind() -> None:
    beliefs = shares(log_beliefs(np.zeros((3, 4), dtype=np.int64)))
    assert beliefs == pytest.approx(np.full((3, 4), 0.25))


def test_beliefs_do_not_hang_on_the_order_of_the_states() -> None:
    order = np.array([3, 0, 4, 2, 1])
    assert np.array_equal(log_beliefs(TAKEN)[order], log_beliefs(TAKEN[order]))


def test_the_cluster_that_contradicts_itself_is_worth_most_and_nothing_that_was_asked() -> None:
    found = worth([CLUSTERS], _known())
    assert found.best().tolist() == [2, 3]  # type: ignore[union-attr]
    assert len(found.sets) == 3 + 4  # A cluster of one state is that state.
    asked = worth([CLUSTERS], _known(record(1, (2, 3), (EAST,), (WEST, SOUTH))))
    assert asked.gain[[tuple(states.tolist()) for states in asked.sets].index((2, 3))] == 0.0
    assert asked.most < found.most


def test_nothing_is_left_when_each_state_was_asked_about() -> None:
    answers = [record(1 + state, (state,), (NORTH,), (WEST,)) for state in range(5)]
    clusters = [record(10 + i, states, (NORTH,), (WEST,)) for i, states in enumerate([(0, 1), (2, 3)])]
    assert worth([CLUSTERS], _known(*answers, *clusters)).best() is None


def test_a_skipped_question_is_not_asked_again() -> None:
    skipped = record(1, (2, 3), (), (), verdict=Verdict.SKIP)
    known = _known()._replace(advice=advice_state((skipped,)))
    best = worth([CLUSTERS], known).best()
    assert best is not None
    assert best.tolist() != [2, 3]


def test_an_answer_moves_beliefs_and_one_that_the_moves_refute_hardly_does() -> None:
    logs = log_beliefs(TAKEN)
    told = shares(with_answers(logs, [record(1, (2, 3), (EAST,), (WEST, SOUTH))]))
    assert (told[2:4, EAST] > 0.8).all()
    refuted = shares(with_answers(logs, [record(1, (0, 1), (WEST,), (EAST,))]))
    assert refuted[:2].argmax(axis=1).tolist() == [EAST, EAST]


def test_a_pure_set_is_expected_to_be_purer_than_a_mixed_one() -> None:
    beliefs = shares(log_beliefs(TAKEN))
    assert common(beliefs[[0, 1]]).purity[EAST] > common(beliefs[[0, 4]]).purity[EAST]


def test_the_more_particular_answer_holds() -> None:
    wide, narrow = record(1, (0, 1, 2), (EAST,), (WEST,)), record(2, (1,), (NORTH,), (SOUTH,))
    held = narrowed((wide, narrow))
    assert held == (replace(wide, states=(0, 2)), narrow)
    assert narrowed((narrow, wide)) == (narrow, replace(wide, states=(0, 2)))
    assert narrowed((narrow, record(3, (1,), (EAST,), (WEST,)))) == (narrow, record(3, (1,), (EAST,), (WEST,)))


def test_the_learner_asks_on_after_every_cluster_was_asked_and_no_question_twice() -> None:
    session = often(LearnSettings(acquisition='gain', clusters=2, confirm=False))
    asked = []
    for _ in range(5):
        assert session.query is not None
        asked.append(session.query.states)
        session.submit(answer(session, avoided=(WEST,)))
        session.learn()
    assert len(set(asked)) == 5


def test_the_order_of_the_answers_leaves_no_trace() -> None:
    settings, flown = LearnSettings(acquisition='gain'), flights(0, OFTEN)
    wide, narrow = record(1, (0, 1, 2), (EAST,), (WEST,)), record(2, (1,), (NORTH,), (SOUTH,))
    first, second = (learn(ROUND_TRIP, settings, flown, log) for log in ((wide, narrow), (narrow, wide)))
    assert np.array_equal(first.reward, second.reward)
    assert first.query is not None
    assert second.query is not None
    assert first.query.states == second.query.states


def test_with_few_moves_questions_go_where_the_policy_does() -> None:
    few, many = (np.full(10, visits) for visits in (MOVES - 1, MOVES))
    assert [in_effect(name, few) for name in ('gain', 'paper')] == ['occupancy', 'paper']
    assert [in_effect(name, many) for name in ('gain', 'paper')] == ['gain', 'paper']
    flown = flights(0, 3)
    by_gain, by_visits = (
        learn(ROUND_TRIP, LearnSettings(acquisition=name), flown, ()).query for name in ('gain', 'occupancy')
    )
    assert by_gain == by_visits
