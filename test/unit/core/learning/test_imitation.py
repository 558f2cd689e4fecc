"""What the program imitates, and which answers stand beside it."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.core.advice.state import advice_state
from advise_ros.core.demonstrations.demonstration import Counts
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.algorithm import imitated
from advise_ros.core.learning.learner import learn
from support.learning import EAST, NORTH, ROUND_TRIP, SOUTH, WEST, flights, record

# Three states flown east with few slips; two flown north again and again but east now and then; one never visited.
COUNTS = Counts(np.array([[0, 20, 1, 0], [1, 19, 0, 0], [0, 22, 0, 1], [14, 6, 0, 0], [28, 12, 0, 0], [0, 0, 0, 0]]))
SLIP, MISTAKE, UNKNOWN = 0, 3, 5
NOTHING = advice_state(())


def test_what_is_believed_is_imitated_instead_of_a_mistake_that_is_made_again_and_again() -> None:
    for name in ('gain', 'paper', 'occupancy'):
        assert imitated(name, COUNTS, NOTHING).favourite.tolist() == [EAST, EAST, EAST, NORTH, NORTH, -1]
    assert imitated('belief', COUNTS, NOTHING).favourite.tolist() == [EAST] * 5 + [-1]


def test_an_answer_that_is_believed_goes_into_what_is_imitated_and_stands_where_nobody_was() -> None:
    found = imitated('belief', COUNTS, advice_state((record(1, (SLIP, MISTAKE, UNKNOWN), (EAST,), (WEST,)),)))
    assert found.favourite.tolist() == [EAST] * 5 + [-1]
    assert [one.states for one in found.advice] == [(UNKNOWN,)]


def test_an_answer_about_many_states_is_not_followed_where_their_moves_refute_it() -> None:
    mostly_north = Counts(np.vstack([np.tile([20, 0, 1, 0], (6, 1)), [[0, 40, 0, 0], [12, 28, 0, 0]]]))
    found = imitated('belief', mostly_north, advice_state((record(1, tuple(range(7)), (NORTH,), (SOUTH,)),)))
    assert found.favourite.tolist() == [NORTH] * 6 + [EAST, NORTH]
    assert found.advice == ()


def test_an_answer_about_one_state_alone_stands_whatever_was_flown_there() -> None:
    together, alone = record(1, (SLIP, 1, 2), (EAST,), (NORTH,)), record(2, (SLIP,), (SOUTH,), (EAST,))
    advice = imitated('belief', COUNTS, advice_state((together, alone))).advice
    assert [(one.states, one.preferred) for one in advice] == [((SLIP,), (SOUTH,))]


def test_without_evidence_of_mistakes_the_most_frequent_action_is_imitated() -> None:
    with_slips = Counts(np.array([[30, 4, 3, 3], [3, 31, 4, 2], [2, 3, 3, 32], [5, 28, 4, 3]]))
    assert imitated('belief', with_slips, NOTHING).favourite.tolist() == [NORTH, EAST, WEST, EAST]
    mostly_wrong = Counts(np.array([*[[14, 6, 0, 0]] * 6, *[[0, 40, 0, 0]] * 3]))
    assert imitated('belief', mostly_wrong, NOTHING).favourite.tolist() == [NORTH] * 6 + [EAST] * 3


@pytest.mark.parametrize(('number', 'same'), [(2, True), (16, False)])
def test_with_few_moves_the_learner_imitates_and_asks_as_occupancy_does(number: int, same: bool) -> None:
    flown = flights(0, number)
    by_belief, by_occupancy = (
        learn(ROUND_TRIP, LearnSettings(acquisition=name), flown, ()) for name in ('belief', 'occupancy')
    )
    assert (np.array_equal(by_belief.reward, by_occupancy.reward) and by_belief.query == by_occupancy.query) == same


def test_the_order_of_the_answers_leaves_no_trace_in_what_is_believed() -> None:
    flown = flights(0, 16)
    settings = LearnSettings(acquisition='belief')
    first = learn(ROUND_TRIP, settings, flown, ())
    assert first.query is not None
    whole = record(1, first.query.states, (NORTH,), (SOUTH,))
    part = record(2, first.query.states[:1], (EAST,), (WEST,))
    one, other = (learn(ROUND_TRIP, settings, flown, log) for log in ((whole, part), (part, whole)))
    assert one.digest == other.digest
