"""The right way on a grid: what the simulated pilot, the simulated expert and the step budget know."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.numerics import Bools, Ints
from advise_ros.core.planning.process import terminal


@lru_cache(maxsize=8)
def distances(grid: Grid) -> Ints:
    """Fewest moves from each cell to each waypoint, (n_layers, n_cells), -1 where there is no way; read-only."""
    table = np.array([grid.distances_to(waypoint) for waypoint in grid.waypoints])
    table.setflags(write=False)
    return table


@lru_cache(maxsize=8)
def optimal_table(grid: Grid) -> Bools:
    """`grid.optimal_actions` of every state at once, (n, n_actions), read-only."""
    table = distances(grid)
    best = table - 1
    best[table == 0] = 1  # On the waypoint with itself next: any free neighbour leads back.
    optimal = np.stack([_arrive(grid, table, action) == best for action in range(N_ACTIONS)], axis=-1)
    flat: Bools = optimal.reshape(grid.n_states, N_ACTIONS)
    flat[terminal(grid)] = False
    flat.setflags(write=False)
    return flat


def _arrive(grid: Grid, table: Ints, action: int) -> Ints:
    """Distance after an action, (n_layers, n_cells); off the grid: that of staying."""
    there = np.array([grid.neighbour(cell, action) for cell in range(grid.n_cells)])
    return table[:, there]


def shortest_route(grid: Grid, start_state: int) -> int:
    """Fewest moves from a state over all waypoints ahead to the final position."""
    table, layer = distances(grid), grid.next_waypoint(start_state)
    legs = [table[layer, grid.cell_of(start_state)]]
    legs += [table[ahead, grid.waypoints[ahead - 1]] for ahead in range(layer + 1, grid.n_layers)]
    return int(sum(legs))
