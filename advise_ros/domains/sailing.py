"""Sailing: across a 5 x 5 lake in one of two winds that push the boat off its course (section 4, figure 3 centre)."""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np
from scipy import sparse

from advise_ros.core.planning.process import Mdp
from advise_ros.domains.domain import Domain, Measure, uniform_over

SIZE = 5
WINDS = (-1, 1)  # Columns that a gust pushes by.
ACTIONS = {'across': (0, 1), 'left': (-1, 0), 'right': (1, 0)}
DOCK = (2, 3)  # Columns of the far side where the boat lands; elsewhere it runs aground.
SHALLOWS = ((0, 2), (4, 2))  # (column, row) where it runs aground on the way.
GUST = 0.25
WIND_TURNS = 0.1
GAMMA = 0.95
HORIZON = 50


@lru_cache(maxsize=1)
def sailing() -> Domain:
    """Land at the dock on the far side, from anywhere on the near side.

    State = wind * 25 + row * 5 + column. Of each move a gust adds one column with the wind, and the wind may turn.
    The paper says neither where the dock is, nor the shallows, nor the wind's strength.
    """
    n = len(WINDS) * SIZE * SIZE
    cell = np.arange(n) % (SIZE * SIZE)
    column, row = cell % SIZE, cell // SIZE
    goal = (row == SIZE - 1) & np.isin(column, DOCK)
    shallow = np.isin(cell, [r * SIZE + c for c, r in SHALLOWS])
    ended = (row == SIZE - 1) | shallow
    wind = np.arange(n) // (SIZE * SIZE)
    return Domain(
        name='sailing',
        mdp=Mdp(sparse.vstack([_action(step, ended) for step in ACTIONS.values()], format='csr'), GAMMA),
        reward=goal.astype(float) - (ended & ~goal),
        ended=ended,
        goal=goal,
        start=uniform_over(row == 0),
        measure=Measure.GOAL,
        horizon=HORIZON,
        features=np.column_stack([column / (SIZE - 1), row / (SIZE - 1), wind]),
        actions=tuple(ACTIONS),
    )


def _action(step: tuple[int, int], ended: np.ndarray) -> sparse.csr_array:
    """(n, n) transitions of one action."""
    n = len(ended)
    table = np.zeros((n, n))
    for here in range(n):
        if ended[here]:
            table[here, here] = 1.0
            continue
        for gust, turns in product((False, True), repeat=2):
            share = (GUST if gust else 1.0 - GUST) * (WIND_TURNS if turns else 1.0 - WIND_TURNS)
            table[here, _there(here, step, gust, turns)] += share
    return sparse.csr_array(table)


def _there(here: int, step: tuple[int, int], gust: bool, turns: bool) -> int:
    """Where one move ends; the shores left and right stop the boat."""
    wind, cell = divmod(here, SIZE * SIZE)
    column = min(max(cell % SIZE + step[0] + (WINDS[wind] if gust else 0), 0), SIZE - 1)
    row = cell // SIZE + step[1]
    return (1 - wind if turns else wind) * SIZE * SIZE + row * SIZE + column
