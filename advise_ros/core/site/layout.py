"""A site and a route over it as arrays that compiled loops read."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.grid.tables import occurring

Int32s = npt.NDArray[np.int32]
Bytes = npt.NDArray[np.uint8]


class Layout(NamedTuple):
    """A site and a route over it; nothing is written to.

    Attributes:
        width, height: cells along east and north.
        beside: (cells, 4) the cell in each direction, -1 over the border.
        moves: (cells, 4) the same, and -1 into and out of blocked cells.
        waypoints: (layers,) cells in the order of flight.
        open_cells: (cells,) 1 where nothing is to be learnt: waypoints, the start, blocked cells.
        acting: (layers * cells,) 1 for states in which a flight makes a move.
        start: first state of a flight.
    """

    width: int
    height: int
    beside: Int32s
    moves: Int32s
    waypoints: Int32s
    open_cells: Bytes
    acting: Bytes
    start: int

    @property
    def n_cells(self) -> int:
        return len(self.beside)

    @property
    def n_layers(self) -> int:
        return len(self.waypoints)

    @property
    def n_states(self) -> int:
        return len(self.acting)


@lru_cache(maxsize=8)
def layout_of(grid: Grid, start_cell: int | None = None) -> Layout:
    """The arrays of a grid.

    Args:
        grid: the site and its route.
        start_cell: where flights begin; None: at the final position.

    Raises:
        InputError: the start is blocked or outside.
    """
    start = grid.start_state(start_cell)
    table = [[_beside(grid, cell, action) for action in range(N_ACTIONS)] for cell in range(grid.n_cells)]
    beside = np.array(table, dtype=np.int32)
    blocked = np.zeros(grid.n_cells, dtype=np.bool_)
    blocked[list(grid.blocked)] = True
    moves = np.where((beside >= 0) & ~blocked[beside] & ~blocked[:, None], beside, -1).astype(np.int32)
    open_cells = blocked.astype(np.uint8)
    open_cells[[*grid.waypoints, grid.cell_of(start)]] = 1
    waypoints = np.array(grid.waypoints, dtype=np.int32)
    return Layout(grid.width, grid.height, beside, moves, waypoints, open_cells, occurring(grid).astype(np.uint8), start)


def _beside(grid: Grid, cell: int, action: int) -> int:
    there = grid.neighbour(cell, action)
    return -1 if there == cell else there
