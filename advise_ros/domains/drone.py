"""Drone: cells x next waypoint, three corners of a room and back, before the battery is empty (section 4, figure 4).

Any other route on a grid makes such a domain too."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from advise_ros.core.grid.grid import Action, Grid
from advise_ros.core.grid.tables import occurring, terminal
from advise_ros.core.planning.process import grid_features, mdp_of
from advise_ros.core.planning.rollout import step_budget
from advise_ros.domains.domain import Domain, Measure

ROOM = Grid(2.0, 5, 5, (-1.0, -1.0), 5.0, waypoints=(4, 24, 20, 0))
GAMMA = 0.95
# The battery lasts for twice as many moves as the shortest route has, as in the demo.
BATTERY_FACTOR = 2.0


@lru_cache(maxsize=1)
def drone() -> Domain:
    """Fly to the corners in order and back to the start while the battery lasts; four directions, one altitude."""
    return route('drone', ROOM, [ROOM.start_state()])


def route(name: str, grid: Grid, starts: Sequence[int]) -> Domain:
    """Fly to the waypoints of a grid in order while the battery lasts, from any of some states, repeats count."""
    goal = np.zeros(grid.n_states, dtype=np.bool_)
    goal[grid.goal_state] = True
    return Domain(
        name=name,
        mdp=mdp_of(grid, 0.0, GAMMA),
        reward=goal.astype(float),
        ended=terminal(grid) | ~occurring(grid),
        goal=goal,
        start=np.bincount(starts, minlength=grid.n_states) / len(starts),
        measure=Measure.GOAL,
        horizon=max(step_budget(grid, state, BATTERY_FACTOR) for state in set(starts)),
        features=grid_features(grid),
        actions=tuple(action.name.lower() for action in Action),
    )
