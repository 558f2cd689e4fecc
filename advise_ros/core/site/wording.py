"""A question about a site in words: what the person's moves did at the cells in dispute, and what either answer means."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.numerics import Ints

# So many moves beside an area show that the person went round it.
MOVES_BESIDE = 3


class Seen(NamedTuple):
    """The moves at an area.

    Attributes:
        into: that entered it.
        beside: in cells beside it, that did not.
    """

    into: int
    beside: int


class Words(NamedTuple):
    """The question, and for either answer its word for commands and its label for a button."""

    question: str
    keep_out: tuple[str, str]
    fly_through: tuple[str, str]


ON_PURPOSE, BY_ACCIDENT = ('on-purpose', 'On purpose: keep out'), ('by-accident', 'By accident: fly through')
YES, NO = ('keep-out', 'Yes: keep out'), ('fly-through', 'No: fly through')


def words(grid: Grid, layer: int, cells: tuple[int, ...], taken: Ints, *, enters: bool) -> Words:
    """E.g. 'Flying to waypoint 2, you always avoided these 6 cells. On purpose? Columns 2-4, rows 1-2; 12 moves beside them.'.

    The question itself has at most twelve words; what it is about follows. Whatever the moves were, 'yes' means keep out.

    Args:
        grid: the site and its route.
        layer: of the question.
        cells: in dispute.
        taken: (states, 4) moves flown.
        enters: the drone would fly through them now.
    """
    way, moves, them = f'Flying to waypoint {layer + 1}', seen(grid, layer, cells, taken), 'it' if len(cells) == 1 else 'them'
    where = place(grid, cells).capitalize()
    if always_avoided(moves):
        short = f'{way}, you always avoided {these(len(cells))}. On purpose?'
        return Words(f'{short} {where}; {counted(moves.beside, "move")} beside {them}.', ON_PURPOSE, BY_ACCIDENT)
    short = f'{way}: should I keep out of {these(len(cells))}?'
    if moves.into:
        flown = f'you flew into {them} {times(moves.into)} and past {them} {times(moves.beside)}'
    else:
        flown = f'you were never near {them}; I would {"fly through" if enters else "go round"} {them}'
    return Words(f'{short} {where}; {flown}.', YES, NO)


def always_avoided(moves: Seen) -> bool:
    """The person went past often enough, and never in."""
    return not moves.into and moves.beside >= MOVES_BESIDE


def seen(grid: Grid, layer: int, cells: tuple[int, ...], taken: Ints) -> Seen:
    """What the moves on the way to a waypoint did at some cells; arguments as of `words`."""
    inside, into, beside = set(cells), 0, 0
    here = taken[layer * grid.n_cells : (layer + 1) * grid.n_cells]
    for cell in {grid.neighbour(cell, action) for cell in cells for action in range(N_ACTIONS)} - inside:
        entering = [grid.neighbour(cell, action) in inside for action in range(N_ACTIONS)]
        into += int(here[cell][entering].sum())
        beside += int(here[cell][np.logical_not(entering)].sum())
    return Seen(into, beside)


def place(grid: Grid, cells: tuple[int, ...]) -> str:
    """Cells as the axes of maps have them, counted from 1, e.g. 'columns 2-4, row 1'."""
    columns, rows = np.array(cells) % grid.width + 1, np.array(cells) // grid.width + 1
    return f'{span("column", columns)}, {span("row", rows)}'


def span(name: str, indices: Ints) -> str:
    """E.g. 'columns 1-3'."""
    low, high = int(indices.min()), int(indices.max())
    return f'{name} {low}' if low == high else f'{name}s {low}-{high}'


def listed(words: Sequence[str]) -> str:
    """E.g. '1, 2 and 4'."""
    return f'{", ".join(words[:-1])} and {words[-1]}' if len(words) > 1 else words[0]


def these(number: int) -> str:
    """E.g. 'these 6 cells'."""
    return 'this cell' if number == 1 else f'these {number} cells'


def counted(number: int, name: str) -> str:
    """E.g. '3 moves'."""
    return f'{number} {name}' if number == 1 else f'{number} {name}s'


def times(number: int) -> str:
    """E.g. 'twice', '3 times'."""
    return {0: 'never', 1: 'once', 2: 'twice'}.get(number, f'{number} times')
