"""A query in one or two plain sentences for the person who flew."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.grid.grid import N_ACTIONS, Action, Grid
from advise_ros.core.numerics import Ints


class Asked(NamedTuple):
    """What the sentence is about.

    Attributes:
        states: (m,) ascending.
        taken: (m, n_actions) how often each action was taken there.
        greedy: (m,) what the drone would do.
        scarce: few moves, rather than moves that disagree, make it unsure.
        said: an earlier answer that the moves do not bear out: what it prefers, moves that way, all moves.
    """

    states: Ints
    taken: Ints
    greedy: Ints
    scarce: bool
    said: tuple[tuple[int, ...], int, int] | None = None


def question(grid: Grid, asked: Asked) -> str:
    """E.g. 'In 5 cells on the way to waypoint 2 (columns 1-3, rows 0-1) you flew EAST 48 %, NORTH 40 %; ...'."""
    where, flown = _where(grid, asked.states), _flown(asked.taken)
    if asked.said is not None:
        return f'{where} {flown}; {_doubted(*asked.said)} Which direction is right there, and which is wrong?'
    return (
        f'{where} {flown}; the drone would fly {_would(asked.greedy)}. '
        f'{_why(asked.taken, asked.scarce)} Which direction is right there, and which is wrong?'
    )


def _doubted(preferred: tuple[int, ...], moves: int, of: int) -> str:
    said = ' or '.join(Action(action).name for action in preferred)
    way = 'ways' if len(preferred) > 1 else 'way'
    return f'you answered {said}, but {moves} of {of} moves there went that {way}, so it is asked once more.'


def _where(grid: Grid, states: Ints) -> str:
    cells, layers = states % grid.n_cells, np.unique(states // grid.n_cells) + 1
    where = 'In 1 cell' if len(states) == 1 else f'In {len(states)} cells'
    columns, rows = _span('column', cells % grid.width), _span('row', cells // grid.width)
    return f'{where} on the way to {_waypoints([int(layer) for layer in layers])} ({columns}, {rows})'


def _waypoints(layers: list[int]) -> str:
    if len(layers) == 1:
        return f'waypoint {layers[0]}'
    return f'waypoints {", ".join(map(str, layers[:-1]))} and {layers[-1]}'


def _span(name: str, indices: Ints) -> str:
    low, high = int(indices.min()), int(indices.max())
    return f'{name} {low}' if low == high else f'{name}s {low}-{high}'


def _flown(taken: Ints) -> str:
    total = taken.sum(axis=0)
    if not total.any():
        return 'you never flew'
    shares = total / total.sum()
    ranked = [a for a in np.argsort(-shares, kind='stable') if shares[a] >= 0.1]
    return 'you flew ' + ', '.join(f'{Action(a).name} {100 * shares[a]:.0f} %' for a in ranked)


def _would(greedy: Ints) -> str:
    """Directions in the order of how many states have them."""
    counts = np.bincount(greedy, minlength=N_ACTIONS)
    ranked = [Action(a).name for a in np.argsort(-counts, kind='stable') if counts[a]]
    return ranked[0] if len(ranked) == 1 else f'{ranked[0]}, in some cells {" or ".join(ranked[1:])}'


def _why(taken: Ints, scarce: bool) -> str:
    """Few visits or disagreement; the paper's F mixes the two."""
    moves = int(taken.sum())
    amount = f'{moves} move in all' if moves == 1 else f'{moves} moves in all'
    if scarce:
        return f'It is unsure because you were seldom there ({amount}).'
    return f'It is unsure because your moves there disagree ({amount}).'
