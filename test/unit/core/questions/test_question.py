"""The sentence that a person reads."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.core.questions.query import Asked, question
from support.learning import EAST, NORTH, ROUND_TRIP, WEST


def _asked(states: list[int], taken: list[list[int]], greedy: list[int]) -> str:
    return question(ROUND_TRIP, Asked(np.array(states), np.array(taken), np.array(greedy)))


def test_it_asks_then_says_where_what_was_flown_and_what_would_be() -> None:
    states = [ROUND_TRIP.state(1, cell) for cell in (1, 2, 5)]
    assert _asked(states, [[10, 12, 3, 0]] * 3, [EAST] * 3) == (
        'Flying to waypoint 2: which way in these 3 cells? '
        'Columns 2-3, rows 1-2; 75 moves there, split three ways: EAST 48 %, NORTH 40 %, SOUTH 12 %. '
        'The drone would fly EAST.'
    )


@pytest.mark.parametrize(('taken', 'words'), [
    ([1, 0, 0, 0], '1 move there, all NORTH'), ([20, 20, 0, 0], '40 moves there, split two ways: NORTH 50 %, EAST 50 %'),
    ([11, 10, 9, 9], '39 moves there, split four ways'), ([39, 1, 0, 0], '40 moves there, nearly all NORTH'),
    ([0, 0, 0, 0], 'nobody flew there yet'),
])  # fmt: skip
def test_the_reason_is_what_was_counted(taken: list[int], words: str) -> None:
    assert words in _asked([1], [taken], [NORTH])


def test_a_doubtful_answer_is_asked_for_again_with_the_reason() -> None:
    asked = Asked(np.array([1]), np.array([[38, 2, 0, 0]]), np.array([EAST]), ((EAST,), 2, 40))
    text = question(ROUND_TRIP, asked)
    assert 'You answered EAST, but 2 of 40 moves there went that way, so it is asked once more.' in text
    assert 'drone would fly' not in text


def test_one_cell_is_named_as_the_map_s_axes_have_it() -> None:
    text = _asked([6], [[0, 0, 0, 0]], [WEST])
    assert text.startswith('Flying to waypoint 1: which way in this cell? Column 3, row 2; ')


@pytest.mark.parametrize(
    ('layers', 'words'),
    [
        ((0,), 'Flying to waypoint 1: '), ((0, 2), 'Flying to waypoints 1 and 3: '),
        ((0, 1, 3), ', on the way to waypoints 1, 2 and 4; '),
    ],
)
def test_all_waypoints_are_named_in_at_most_twelve_words(layers: tuple[int, ...], words: str) -> None:
    states = [ROUND_TRIP.state(layer, 5) for layer in layers]
    text = _asked(states, [[1, 0, 0, 0]] * len(states), [NORTH] * len(states))
    assert words in text
    assert len(text.split('?')[0].split()) <= 12


def test_several_directions_are_ordered_by_their_number_of_cells() -> None:
    text = _asked([5, 6, 9], [[1, 0, 0, 0]] * 3, [WEST, WEST, NORTH])
    assert 'The drone would fly WEST, in some cells NORTH.' in text
