"""Answers that the demonstrations do not bear out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from advise_ros.core.advice.advice import Verdict
from advise_ros.core.advice.state import advice_state, agreed, doubtful
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.learner import learn
from support.learning import BY_CLUSTERS, CORRIDOR, EAST, NORTH, WEST, answer, demonstration, ready, record

TAKEN = np.array([[2, 34, 2, 2]] * 2 + [[9, 1, 1, 1], [0, 0, 0, 0]])
RIGHT, WRONG = record(1, (0, 1), (EAST,), (WEST,)), record(2, (0, 1), (WEST,), (EAST,))
WRONG_AGAIN = record(3, (0, 1), (WEST,), (EAST,))


@pytest.mark.parametrize(
    ('states', 'preferred', 'expected'),
    [((0, 1), EAST, False), ((0, 1), WEST, True), ((2,), EAST, False), ((3,), WEST, False)],
)
def test_what_was_hardly_ever_flown_in_many_moves_is_doubtful(
    states: tuple[int, ...], preferred: int, expected: bool,
) -> None:
    assert doubtful(TAKEN, record(1, states, (preferred,), (NORTH,))) is expected


def test_a_doubtful_answer_is_asked_for_once_more_and_only_once() -> None:
    assert advice_state((RIGHT,), TAKEN).doubtful is None
    assert advice_state((WRONG,), TAKEN).doubtful == WRONG
    assert advice_state((WRONG, WRONG_AGAIN), TAKEN).doubtful is None
    skipped = record(3, (0, 1), (), (), verdict=Verdict.SKIP)
    assert advice_state((WRONG, skipped), TAKEN).doubtful is None
    assert advice_state((WRONG, record(2, (0, 1), (WEST,), (EAST,), retracted=True)), TAKEN).doubtful is None


def test_what_is_said_twice_holds_and_of_two_answers_the_one_that_was_flown() -> None:
    assert agreed((WRONG, RIGHT), TAKEN) == (RIGHT,)
    assert agreed((WRONG, RIGHT, WRONG_AGAIN), TAKEN) == (WRONG, WRONG_AGAIN)
    elsewhere = record(9, (1, 2), (WEST,), (EAST,))
    assert agreed((WRONG, RIGHT, elsewhere), TAKEN) == (RIGHT, elsewhere)


def test_the_learner_asks_again_with_its_reason_and_the_second_answer_corrects_the_first() -> None:
    flown = tuple(demonstration(CORRIDOR, [(0, EAST), (1, EAST), (2, EAST)], f'flight {i}') for i in range(12))
    settings = LearnSettings(acquisition='occupancy', clusters=1)
    first = learn(CORRIDOR, settings, flown, ()).query
    assert first is not None
    slip = record(1, first.states, (WEST,), (EAST,))
    learned = learn(CORRIDOR, settings, flown, (slip,))
    assert learned.query is not None
    assert learned.query.states == first.states
    assert 'You answered WEST, but 0 of 36 moves there went that way' in learned.query.question
    right = record(2, first.states, (EAST,), (WEST,))
    corrected = learn(CORRIDOR, settings, flown, (slip, right))
    assert corrected.query is None
    assert corrected.contradictions == ()
    assert corrected.greedy[:3].tolist() == [EAST] * 3
    assert np.array_equal(corrected.reward, learn(CORRIDOR, settings, flown, (right,)).reward)


@pytest.mark.parametrize('settings', [replace(BY_CLUSTERS, confirm=False), replace(BY_CLUSTERS, slack_cost=0.0)])
def test_who_wants_it_otherwise_or_strict_is_not_asked_again(settings: LearnSettings) -> None:
    flown = tuple(demonstration(CORRIDOR, [(0, EAST), (1, EAST), (2, EAST)], f'flight {i}') for i in range(12))
    slip = record(1, (0, 1, 2), (WEST,), (EAST,))
    query = learn(CORRIDOR, settings, flown, (slip,)).query
    assert query is None or 'once more' not in query.question


def test_enough_advice_ends_the_questions_and_is_said() -> None:
    learned = ready(settings=LearnSettings(enough=100.0)).learned
    assert learned is not None and learned.query is None and learned.enough_advice
    assert 0.0 < learned.doubt_left < 100.0
    asking = ready(settings=LearnSettings(enough=0.5 * learned.doubt_left)).learned
    assert asking is not None and asking.query is not None and not asking.enough_advice
    assert asking.doubt_left == learned.doubt_left


def test_questions_about_clusters_end_with_the_clusters() -> None:
    asking = ready(settings=replace(BY_CLUSTERS, enough=100.0))
    while asking.query is not None:
        asking.submit(answer(asking, avoided=(WEST,)))
        left = asking.learn()
    assert left.doubt_left == 0.0 and not left.enough_advice
    assert len(asking.advice.answers) >= 6


def test_answers_may_come_one_after_the_other() -> None:
    assert agreed(iter((WRONG, RIGHT, WRONG_AGAIN)), TAKEN) == (WRONG, WRONG_AGAIN)
