"""The learner's own expectation of a flight."""

import numpy as np
import pytest

from advise_ros.core.grid.grid import Grid
from advise_ros.core.planning.rollout import ASTRAY, expected_success, shortest_route
from support.learning import CORRIDOR, EAST, WEST


def test_a_corridor_is_a_product_of_moves() -> None:
    start = CORRIDOR.start_state(0)
    grid = Grid(1.0, 3, 1, (0.0, 0.0), 2.0, (2, 0))
    east_then_west = np.repeat([EAST, WEST], grid.n_cells)
    assert shortest_route(grid, grid.start_state()) == 4
    exactly = expected_success(grid, east_then_west, 0.0, 1.0)
    assert exactly == pytest.approx((1 - ASTRAY) ** 4, abs=0.02)
    assert expected_success(grid, east_then_west, 0.0, 4.0) > exactly
    assert expected_success(grid, east_then_west, 0.5, 1.0) < exactly
    assert expected_success(grid, np.full(grid.n_states, EAST), 0.0, 1.0) < 0.01
    assert start == 0
