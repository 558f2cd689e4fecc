"""How likely a policy is to fly its route to the end, in the learner's own model."""

from __future__ import annotations

import numpy as np

from advise_ros.core.grid.grid import Grid
from advise_ros.core.numerics import Ints
from advise_ros.core.planning.process import mdp_of
from advise_ros.core.planning.rollout import step_budget

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
    process = mdp_of(grid, max(slip, ASTRAY), 0.0)
    moves = process.outcomes(np.arange(grid.n_states), np.asarray(greedy, dtype=np.int64)).T.tocsr()
    start = grid.start_state()
    share = np.zeros(grid.n_states)
    share[start] = 1.0
    for _ in range(step_budget(grid, start, budget_factor)):
        share = moves @ share
    return float(share[grid.goal_state])
