"""Routes on the grid model: the shortest ones, a policy's without slip, and its probability of success with slip."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.grid.tables import terminal
from advise_ros.core.numerics import Bools, Ints


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


class Rollout(NamedTuple):
    """One flight of a policy.

    Attributes:
        states: the start and the state after each move.
        reached: whether it ended at the final waypoint, with all others visited in order before.
        waypoints_reached: waypoints visited in order, the final one included.
        steps: moves made, those into the grid's border included.
    """

    states: tuple[int, ...]
    reached: bool
    waypoints_reached: int
    steps: int


def step_budget(grid: Grid, start_state: int, factor: float) -> int:
    """Moves before the battery is spent: `factor` times the shortest route.

    Args:
        grid: cells and waypoints.
        start_state: where the flight begins.
        factor: times the shortest route.
    """
    return int(factor * shortest_route(grid, start_state))


def rollout(grid: Grid, greedy: Sequence[int], start_state: int, step_budget: int) -> Rollout:
    """Follow the greedy actions until the flight ends or the budget is spent.

    Args:
        grid: cells and waypoints.
        greedy: (n,) action of each state.
        start_state: where the flight begins.
        step_budget: most moves.
    """
    states = [start_state]
    while not grid.is_terminal(states[-1]) and len(states) <= step_budget:
        states.append(grid.successor(states[-1], int(greedy[states[-1]])))
    reached = states[-1] == grid.goal_state
    return Rollout(tuple(states), reached, grid.next_waypoint(states[-1]) + int(reached), len(states) - 1)


# A policy that knows its way along one line only is worth less than one that finds back: a move in twenty goes astray.
ASTRAY = 0.05


def expected_success(grid: Grid, greedy: Ints, slip: float, budget_factor: float) -> float:
    """Probability of reaching the final waypoint from the start.

    Args:
        grid: the map.
        greedy: (n,) action of each state.
        slip: of the learner's model; at least ASTRAY is taken.
        budget_factor: moves before the battery is spent, times the shortest route.
    """
    from advise_ros.core.planning.process import mdp_of  # noqa: PLC0415 - scipy.sparse, for the learner only: who flies has none

    process = mdp_of(grid, max(slip, ASTRAY), 0.0)
    moves = process.outcomes(np.arange(grid.n_states), np.asarray(greedy, dtype=np.int64)).T.tocsr()
    start = grid.start_state()
    share = np.zeros(grid.n_states)
    share[start] = 1.0
    for _ in range(step_budget(grid, start, budget_factor)):
        share = moves @ share
    return float(share[grid.goal_state])
