"""A question about a site in words: each kind that the moves can make, with what yes and no mean."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from advise_ros.core.grid.grid import Grid
from advise_ros.core.site.wording import Seen, place, seen, words

# Six by six cells; the area is the 2 x 2 cells at columns 2-3, rows 2-3.
GRID = Grid(2.0, 6, 6, (0.0, 0.0), 5.0, (5, 35, 30, 0))
AREA = (14, 15, 20, 21)
NORTH, EAST = 0, 1
SECOND = GRID.n_cells  # First state on the way to waypoint 2.


def taken(*moves: tuple[int, int, int]) -> npt.NDArray[np.int64]:
    """(states, 4) of (state, action, how often)."""
    counts = np.zeros((GRID.n_states, 4), dtype=np.int64)
    for state, action, times in moves:
        counts[state, action] += times
    return counts


def test_who_always_went_round_is_asked_whether_on_purpose() -> None:
    said = words(GRID, 1, AREA, taken((SECOND + 8, EAST, 5), (SECOND + 9, EAST, 5)), enters=True)
    assert said.question == (
        'Flying to waypoint 2, you always avoided these 4 cells. On purpose? Columns 3-4, rows 3-4; 10 moves beside them.'
    )
    assert said.keep_out == ('on-purpose', 'On purpose: keep out')
    assert said.fly_through == ('by-accident', 'By accident: fly through')


def test_who_went_in_now_and_then_reads_how_often() -> None:
    moves = taken((SECOND + 8, NORTH, 2), (SECOND + 8, EAST, 17))
    said = words(GRID, 1, AREA, moves, enters=False)
    assert said.question == (
        'Flying to waypoint 2: should I keep out of these 4 cells? '
        'Columns 3-4, rows 3-4; you flew into them twice and past them 17 times.'
    )
    assert said.keep_out == ('keep-out', 'Yes: keep out')
    assert said.fly_through == ('fly-through', 'No: fly through')


@pytest.mark.parametrize(('enters', 'does'), [(False, 'go round'), (True, 'fly through')])
def test_where_nobody_was_the_drone_says_what_it_would_do(enters: bool, does: str) -> None:
    said = words(GRID, 0, (14,), taken((SECOND + 8, NORTH, 9), (8, EAST, 1)), enters=enters)
    assert said.question == (
        'Flying to waypoint 1: should I keep out of this cell? '
        f'Column 3, row 3; you were never near it; I would {does} it.'
    )
    assert (said.keep_out[1], said.fly_through[1]) == ('Yes: keep out', 'No: fly through')


def test_the_question_has_at_most_twelve_words() -> None:
    for moves in (taken((SECOND + 8, EAST, 9)), taken((SECOND + 8, NORTH, 2)), taken()):
        said = words(GRID, 1, AREA, moves, enters=True)
        assert len(said.question.split('?')[0].split()) <= 12


def test_moves_inside_count_neither_as_into_nor_as_beside() -> None:
    inside = taken((SECOND + 14, EAST, 7), (SECOND + 13, EAST, 1), (SECOND + 13, NORTH, 4), (13, EAST, 50))
    assert seen(GRID, 1, AREA, inside) == Seen(into=1, beside=4)


def test_cells_are_named_by_columns_and_rows() -> None:
    assert place(GRID, (0, 1, 2)) == 'columns 1-3, row 1'
