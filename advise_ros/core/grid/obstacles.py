"""Known obstacles from a map of occupancy: they become the blocked cells of a grid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.raster import TOUCH, Raster, on_cells

# A place is an obstacle from this occupancy on: the threshold that map_saver writes.
OCCUPIED = 0.65


def with_obstacles(grid: Grid, occupancy: Raster) -> Grid:
    """The grid with every cell blocked that an obstacle reaches into, beside those that were blocked.

    What is unknown or not on the map is free, as it is without a map.

    Args:
        grid: cells and route.
        occupancy: 0 free to 1 occupied, NaN unknown.

    Raises:
        InputError: the map lies beside the grid, a waypoint is in an obstacle, or obstacles bar the route.
    """
    covered, share = on_cells(replace(occupancy, values=(occupancy.values >= OCCUPIED).astype(np.float64)), grid)
    if not covered.any():
        raise InputError(f'no part of it lies on the grid: {_extent(occupancy)}, {_grid_extent(grid)}; both are ENU, in metres')
    share = np.nan_to_num(covered * share)
    for number, cell in enumerate(grid.waypoints, start=1):
        if share[cell] > TOUCH:
            raise InputError(
                f'waypoint {number}, cell {list(grid.xy(cell))}, is in an obstacle ({share[cell]:.0%} of the cell); '
                'move the waypoint or free the map there'
            )
    return replace(grid, blocked=(*grid.blocked, *np.flatnonzero(share > TOUCH).tolist()))


def _extent(raster: Raster) -> str:
    rows, columns = raster.values.shape
    return f'it begins at {list(raster.origin_enu_m)} and is {columns * raster.resolution_m:g} x {rows * raster.resolution_m:g} m'


def _grid_extent(grid: Grid) -> str:
    return (
        f'the grid begins at {list(grid.origin_enu_m)} and is {grid.width * grid.resolution_m:g} x '
        f'{grid.height * grid.resolution_m:g} m'
    )
