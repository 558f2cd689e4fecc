"""Flights on the grid model, the right way and the budget of steps."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.core.grid.grid import Grid, optimal_actions
from advise_ros.core.planning.rollout import optimal_table, rollout, shortest_route, step_budget
from support.learning import CORRIDOR, EAST, ROUND_TRIP, WEST

WALLED = Grid(1.0, 3, 3, (0.0, 0.0), 2.0, (2, 6), (4,))


@pytest.mark.parametrize('grid', [CORRIDOR, ROUND_TRIP, WALLED])
def test_the_table_holds_the_optimal_actions_of_each_state(grid: Grid) -> None:
    expected = [list(optimal_actions(grid, state)) for state in range(grid.n_states)]
    assert [np.flatnonzero(row).tolist() for row in optimal_table(grid)] == expected


@pytest.mark.parametrize('grid', [CORRIDOR, ROUND_TRIP, WALLED])
def test_the_right_way_takes_the_shortest_route(grid: Grid) -> None:
    start = grid.start_state(0)
    flown = rollout(grid, optimal_table(grid).argmax(axis=1), start, 100)
    assert flown.reached
    assert flown.waypoints_reached == grid.n_layers
    assert flown.steps == shortest_route(grid, start) == len(flown.states) - 1


def test_a_round_trip_of_four_corners_takes_twelve_moves() -> None:
    assert shortest_route(ROUND_TRIP, ROUND_TRIP.start_state()) == 12
    assert step_budget(ROUND_TRIP, ROUND_TRIP.start_state(), 2.0) == 24
    assert shortest_route(ROUND_TRIP, ROUND_TRIP.goal_state) == 0


def test_the_budget_ends_a_flight_that_gets_nowhere() -> None:
    lost = rollout(CORRIDOR, [WEST] * 4, 2, 7)
    assert (lost.reached, lost.waypoints_reached, lost.steps) == (False, 0, 7)


def test_the_last_step_of_the_budget_counts() -> None:
    assert rollout(CORRIDOR, [EAST] * 4, 0, 3).reached
    assert not rollout(CORRIDOR, [EAST] * 4, 0, 2).reached


def test_a_blocked_cell_ends_the_flight() -> None:
    crashed = rollout(WALLED, [0] * WALLED.n_states, 1, 50)
    assert (crashed.reached, crashed.steps) == (False, 1)
