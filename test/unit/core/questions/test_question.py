"""The sentence that a person reads."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.core.questions.query import Asked, question
from support.learning import EAST, NORTH, ROUND_TRIP, WEST


def _asked(states: list[int], taken: list[list[int]], greedy: list[int], scarce: bool = False) -> str:
    return question(ROUND_TRIP, Asked(np.array(states), np.array(taken), np.array(greedy), scarce))


def test_it_says_where_what_was_flown_what_would_be_flown_and_why() -> None:
    states = [ROUND_TRIP.state(1, cell) for cell in (1, 2, 5)]
    assert _asked(states, [[10, 12, 3, 0]] * 3, [EAST] * 3) == (
        'In 3 cells on the way to waypoint 2 (columns 1-2, rows 0-1) you flew EAST 48 %, NORTH 40 %, SOUTH 12 %; '
        'the drone would fly EAST. It is unsure because your moves there disagree (75 moves in all). '
        'Which direction is right there, and which is wrong?'
    )


def test_few_visits_are_told_from_disagreement() -> None:
    assert 'you were seldom there (1 move in all)' in _asked([1], [[1, 0, 0, 0]], [NORTH], True)
    assert 'your moves there disagree (40 moves in all)' in _asked([1], [[20, 20, 0, 0]], [NORTH])


def test_a_doubtful_answer_is_asked_for_again_with_the_reason() -> None:
    asked = Asked(np.array([1]), np.array([[38, 2, 0, 0]]), np.array([EAST]), False, ((EAST,), 2, 40))
    text = question(ROUND_TRIP, asked)
    assert 'you answered EAST, but 2 of 40 moves there went that way, so it is asked once more.' in text
    assert 'the drone would fly' not in text


def test_a_cell_that_was_never_flown_over() -> None:
    text = _asked([6], [[0, 0, 0, 0]], [WEST])
    assert text.startswith('In 1 cell on the way to waypoint 1 (column 2, row 1) you never flew; ')


@pytest.mark.parametrize(
    ('layers', 'words'),
    [((0,), 'waypoint 1 '), ((0, 2), 'waypoints 1 and 3 '), ((0, 1, 3), 'waypoints 1, 2 and 4 ')],
)
def test_all_waypoints_are_named(layers: tuple[int, ...], words: str) -> None:
    states = [ROUND_TRIP.state(layer, 5) for layer in layers]
    assert f'on the way to {words}' in _asked(states, [[1, 0, 0, 0]] * len(states), [NORTH] * len(states))


def test_several_directions_are_ordered_by_their_number_of_cells() -> None:
    text = _asked([5, 6, 9], [[1, 0, 0, 0]] * 3, [WEST, WEST, NORTH])
    assert 'the drone would fly WEST, in some cells NORTH.' in text
