"""The learner's uncertainty, reward and site as nav_msgs/OccupancyGrid, for RViz and the like.

A map has one number a cell, the learner one a state: the layers (one a waypoint) of a cell are folded.
Blocked cells are -1.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from nav_msgs.msg import OccupancyGrid

from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.learning.learner import Learned
from advise_ros.core.units import MAP_FRAME
from advise_ros.ros.convert import grid_to_msg, stamp_from_ns

FULL = 100
BLOCKED = -1


def uncertainty_map(learned: Learned, stamp_ns: int) -> OccupancyGrid:
    """U_s, the highest of a cell's layers: 0 certain, 100 all four actions alike (ln 4 nat)."""
    highest = _by_layer(learned.grid, learned.state_uncertainty).max(axis=0)
    return _map(learned.grid, highest / math.log(N_ACTIONS), stamp_ns)


def reward_map(learned: Learned, stamp_ns: int) -> OccupancyGrid:
    """Reward, the mean of a cell's layers: 0 is -r_max, 50 is zero, 100 is +r_max."""
    mean = _by_layer(learned.grid, learned.reward).mean(axis=0)
    return _map(learned.grid, (mean / learned.settings.r_max + 1.0) / 2.0, stamp_ns)


def site_map(grid: Grid, keep_out: npt.NDArray[np.float64], stamp_ns: int) -> OccupancyGrid:
    """Probability (cells,) that the person wants the cell kept out of: 0 to 100 %."""
    return _map(grid, keep_out, stamp_ns)


def obstacle_map(grid: Grid, stamp_ns: int) -> OccupancyGrid:
    """The grid as nav2's maps have it: 100 where a cell is blocked, 0 where it is free."""
    out = _map(grid, np.zeros(grid.n_cells), stamp_ns)
    out.data = [FULL if cell in grid.blocked else 0 for cell in range(grid.n_cells)]
    return out


def _by_layer(grid: Grid, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """(n_states,) -> (n_layers, n_cells)."""
    return np.asarray(values, dtype=np.float64).reshape(grid.n_layers, grid.n_cells)


def _map(grid: Grid, shares: npt.NDArray[np.float64], stamp_ns: int) -> OccupancyGrid:
    out = OccupancyGrid()
    out.header.frame_id, out.header.stamp = MAP_FRAME, stamp_from_ns(stamp_ns)
    out.info = grid_to_msg(grid).info
    out.info.origin.position.z = grid.altitude_m
    cells = percent(shares)
    cells[list(grid.blocked)] = BLOCKED
    out.data = cells.tolist()
    return out


def percent(shares: npt.NDArray[np.float64]) -> npt.NDArray[np.int8]:
    """Shares as whole per cent; a small term keeps float noise from moving a value that lies on a rounding border."""
    return np.floor(np.clip(shares, 0.0, 1.0) * FULL + 0.5 + 1e-6).astype(np.int8)
