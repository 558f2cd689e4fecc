"""Demonstrations made up on the grid model, for tests that need some."""

from __future__ import annotations

import numpy as np

from advise_ros.core.demonstrations.demonstration import Audit, Demonstration, EndReason
from advise_ros.core.grid.grid import N_ACTIONS, Grid, optimal_actions

GRID_4X4 = Grid(2.0, 4, 4, (-1.0, -1.0), 3.0, waypoints=(3, 15, 12, 0))
STEP_NS = 2_000_000_000


def walk(grid: Grid, number: int, noise: float = 0.3, seed: int = 0) -> Demonstration:
    """One flight along the route in which a share `noise` of the moves is random; the same for the same arguments."""
    rng = np.random.default_rng([seed, number])
    states, actions, state = [], [], grid.start_state()
    while not grid.is_terminal(state) and len(states) < 40 * grid.n_states:
        action = int(rng.integers(N_ACTIONS)) if rng.random() < noise else int(rng.choice(optimal_actions(grid, state)))
        states.append(state)
        actions.append(action)
        state = grid.successor(state, action)
    stamps = tuple(STEP_NS * (1 + 1000 * number + step) for step in range(len(states)))
    return Demonstration(
        f'flight-{number:03d}', 'made up', grid, tuple(states), tuple(actions), stamps, (stamps[0], stamps[-1]),
        EndReason.FINAL_WAYPOINT, Audit(samples=len(states)),
    )


def everywhere(grid: Grid, moves: int, seed: int = 0) -> Demonstration:
    """Random moves in random states: much to learn from, in no order that could be flown."""
    rng = np.random.default_rng(seed)
    states, actions = rng.integers(grid.n_states, size=moves), rng.integers(N_ACTIONS, size=moves)
    stamps = tuple(STEP_NS * step for step in range(moves))
    return Demonstration(
        'everywhere', 'made up', grid, tuple(states.tolist()), tuple(actions.tolist()), stamps,
        (stamps[0], stamps[-1]), EndReason.STOPPED, Audit(samples=moves),
    )
