"""Wumpus World: a 5 x 5 grid with obstacles that end the game (section 4, figure 3 left)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import sparse

from advise_ros.core.planning.process import Mdp
from advise_ros.domains.domain import Domain, Measure

SIZE = 5
START, GOAL = (0, 0), (4, 4)  # (column, row), rows counted from the top as in figure 2.
OBSTACLES = ((1, 0), (1, 1), (3, 2), (3, 3), (1, 4))
MOVES = {'up': (0, -1), 'right': (1, 0), 'down': (0, 1), 'left': (-1, 0)}
GAMMA = 0.95
HORIZON = 50


@lru_cache(maxsize=1)
def wumpus() -> Domain:
    """Reach the lower right cell from the upper left one; moves are certain, walls stop them.

    The paper gives neither the obstacles' cells nor the reward: +1 at the goal, -1 in an obstacle.
    """
    n = SIZE * SIZE
    goal, obstacle, start = (np.zeros(n, dtype=np.bool_) for _ in range(3))
    goal[_cell(*GOAL)] = start[_cell(*START)] = True
    obstacle[[_cell(*cell) for cell in OBSTACLES]] = True
    ended = goal | obstacle
    column, row = np.arange(n) % SIZE, np.arange(n) // SIZE
    return Domain(
        name='wumpus',
        mdp=Mdp(sparse.vstack([_move(step, ended) for step in MOVES.values()], format='csr'), GAMMA),
        reward=goal.astype(float) - obstacle,
        ended=ended,
        goal=goal,
        start=start.astype(float),
        measure=Measure.GOAL,
        horizon=HORIZON,
        features=np.column_stack([column, row]) / (SIZE - 1),
        actions=tuple(MOVES),
    )


def _cell(column: int, row: int) -> int:
    return row * SIZE + column


def _move(step: tuple[int, int], ended: np.ndarray) -> sparse.csr_array:
    """(n, n) certain transitions of one action."""
    n = len(ended)
    here = np.arange(n)
    column = np.clip(here % SIZE + step[0], 0, SIZE - 1)
    row = np.clip(here // SIZE + step[1], 0, SIZE - 1)
    there = np.where(ended, here, row * SIZE + column)
    return sparse.csr_array((np.ones(n), there, np.arange(n + 1)), shape=(n, n))
