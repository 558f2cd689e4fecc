"""What holds for all states of a grid at once, as arrays; without the planner, whose libraries take long to import."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from advise_ros.core.grid.grid import ACTION_STEP, N_ACTIONS, Grid
from advise_ros.core.numerics import Bools, Ints


@lru_cache(maxsize=8)
def successors(grid: Grid) -> Ints:
    """`Grid.successor` of every state and action at once, (n, n_actions), read-only."""
    cells = np.arange(grid.n_cells)
    x, y = cells % grid.width, cells // grid.width
    table = np.empty((grid.n_layers, grid.n_cells, N_ACTIONS), dtype=np.int64)
    layers = np.arange(grid.n_layers)[:, None]
    ahead = np.minimum(layers + 1, grid.n_layers - 1)
    waypoints = np.array(grid.waypoints)[:, None]
    for action, (dx, dy) in enumerate(ACTION_STEP):
        inside = (x + dx >= 0) & (x + dx < grid.width) & (y + dy >= 0) & (y + dy < grid.height)
        there = np.where(inside, cells + dx + dy * grid.width, cells)
        table[:, :, action] = grid.state(np.where(there == waypoints, ahead, layers), there)  # type: ignore[arg-type]
    flat = table.reshape(grid.n_states, N_ACTIONS)
    ended = np.flatnonzero(terminal(grid))
    flat[ended] = ended[:, None]
    flat.setflags(write=False)
    return flat


def terminal(grid: Grid) -> Bools:
    """`Grid.is_terminal` of every state, (n,)."""
    ended = np.zeros((grid.n_layers, grid.n_cells), dtype=np.bool_)
    ended[:, list(grid.blocked)] = True
    ended[-1, grid.waypoints[-1]] = True
    return ended.ravel()


def occurring(grid: Grid) -> Bools:
    """States that a flight can be in and act in, (n,): not over, and not on the waypoint that is next."""
    there = ~terminal(grid).reshape(grid.n_layers, grid.n_cells)
    there[np.arange(grid.n_layers), list(grid.waypoints)] = False
    return there.ravel()
