"""Drone: cells x next waypoint, three corners of a room and back, before the battery is empty (section 4, figure 4)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from advise_ros.core.clusters import structure
from advise_ros.core.grid import Action, Grid
from advise_ros.core.mdp import mdp_of, occurring, terminal
from advise_ros.domains.domain import Domain, Measure

ROOM = Grid(2.0, 5, 5, (-1.0, -1.0), 5.0, waypoints=(4, 24, 20, 0))
GAMMA = 0.95
# The shortest route has 16 moves; the battery lasts for twice as many, as in the demo.
BATTERY_MOVES = 32


@lru_cache(maxsize=1)
def drone() -> Domain:
    """Fly to the corners in order and back to the start while the battery lasts; four directions, one altitude."""
    goal, start = np.zeros(ROOM.n_states, dtype=np.bool_), np.zeros(ROOM.n_states)
    goal[ROOM.goal_state] = True
    start[ROOM.start_state()] = 1.0
    return Domain(
        name='drone',
        mdp=mdp_of(ROOM, 0.0, GAMMA),
        reward=goal.astype(float),
        ended=terminal(ROOM) | ~occurring(ROOM),
        goal=goal,
        start=start,
        measure=Measure.GOAL,
        horizon=BATTERY_MOVES,
        features=structure(ROOM),
        actions=tuple(action.name.lower() for action in Action),
    )
