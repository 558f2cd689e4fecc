"""A policy flown on the grid model, without slip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from advise_ros.core.grid.grid import Grid
from advise_ros.core.planning.routes import shortest_route


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
    """Moves before the battery is spent: `factor` times the shortest route."""
    return int(factor * shortest_route(grid, start_state))


def rollout(grid: Grid, greedy: Sequence[int], start_state: int, step_budget: int) -> Rollout:
    """Follow the greedy actions until the flight ends or the budget is spent."""
    states = [start_state]
    while not grid.is_terminal(states[-1]) and len(states) <= step_budget:
        states.append(grid.successor(states[-1], int(greedy[states[-1]])))
    reached = states[-1] == grid.goal_state
    return Rollout(tuple(states), reached, grid.next_waypoint(states[-1]) + int(reached), len(states) - 1)
