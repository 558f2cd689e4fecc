"""Any finite process as the learner sees it, and the drone's grid as one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from advise_ros.core.grid.grid import Grid
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.planning.process import Mdp, mdp_of, occurring


@dataclass(frozen=True, eq=False)
class FiniteProcess:
    """What algorithm 1 is run on: a decision process whose reward nobody has written down.

    Attributes:
        mdp: transitions and discount.
        acting: (m,) states in which an action is chosen, ascending; the others are never asked about.
        features: (n, f) what makes states alike beside their actions, in comparable units.
        start: (n,) distribution of the first state.
        grid: the drone's map, where the process is one; acquisition `site` needs it.
    """

    mdp: Mdp
    acting: Ints
    features: Floats
    start: Floats
    grid: Grid | None = None


@lru_cache(maxsize=8)
def process_of(grid: Grid, slip: float, gamma: float) -> FiniteProcess:
    """The drone's process: states are numbered by `core/grid/grid.py`.

    Args:
        grid: cells and waypoints.
        slip: probability that a move goes elsewhere, 0 to 1.
        gamma: discount, below 1.
    """
    start = np.zeros(grid.n_states)
    start[grid.start_state()] = 1.0
    return FiniteProcess(mdp_of(grid, slip, gamma), np.flatnonzero(occurring(grid)), grid_features(grid), start, grid)


def grid_features(grid: Grid) -> Floats:
    """(n, 2 + n_layers): east and north in units of the grid's size, and the next waypoint.

    Two states that differ in the waypoint alone are as far apart as two opposite borders.
    """
    cells = np.tile(np.arange(grid.n_cells), grid.n_layers)
    layers = np.repeat(np.arange(grid.n_layers), grid.n_cells)
    east, north = cells % grid.width / max(1, grid.width - 1), cells // grid.width / max(1, grid.height - 1)
    waypoint = np.eye(grid.n_layers)[layers] / np.sqrt(2.0)
    return np.column_stack([east, north, waypoint])
