"""Maps of numbers whose cells are smaller, larger or elsewhere than those of a grid, and what of them lies in each cell."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from advise_ros.core.grid.grid import Grid
from advise_ros.core.numerics import Floats

# Shares of a cell below this are float noise at its border.
TOUCH = 1e-6
# A map that is turned against the axes is read at so many points along the edge of its own cells.
POINTS_TURNED = 3


@dataclass(frozen=True, eq=False)
class Raster:
    """A map in the ENU frame.

    Attributes:
        values: (rows, columns), row 0 in the south, column 0 in the west; NaN where unknown.
        resolution_m: edge of a cell.
        origin_enu_m: corner of cell (0, 0), about which the map is turned.
        yaw_rad: by how much, counter-clockwise.
    """

    values: Floats
    resolution_m: float
    origin_enu_m: tuple[float, float]
    yaw_rad: float = 0.0


class OnCells(NamedTuple):
    """What of a map lies in the cells of a grid.

    Attributes:
        known: (cells,) share of the area that the map has a number for.
        mean: (cells,) mean of the numbers, by area; NaN where none is known.
    """

    known: Floats
    mean: Floats


def on_cells(raster: Raster, grid: Grid) -> OnCells:
    """The map by area on a grid's cells.

    Args:
        raster: the map.
        grid: its cells; the route does not matter.
    """
    upright = raster if raster.yaw_rad == 0.0 else _upright(raster)
    north, east = (
        _shares(upright.resolution_m, upright.origin_enu_m[axis], upright.values.shape[1 - axis], grid, axis)
        for axis in (1, 0)
    )
    there = np.isfinite(upright.values)
    known = (north @ there @ east.T).ravel()
    known[known < TOUCH] = 0.0
    total = (north @ np.where(there, upright.values, 0.0) @ east.T).ravel()
    return OnCells(known, np.divide(total, known, out=np.full_like(total, np.nan), where=known > 0))


def _shares(resolution_m: float, origin_m: float, number: int, grid: Grid, axis: int) -> Floats:
    """(cells along the axis, number) share of each grid cell's edge that each cell of the map covers."""
    cells = (grid.width, grid.height)[axis]
    begin = grid.origin_enu_m[axis] + np.arange(cells)[:, None] * grid.resolution_m
    other = origin_m + np.arange(number)[None, :] * resolution_m
    overlap = np.minimum(begin + grid.resolution_m, other + resolution_m) - np.maximum(begin, other)
    return np.maximum(overlap, 0.0) / grid.resolution_m


def _upright(raster: Raster) -> Raster:
    """The turned map on smaller cells along the axes; each takes the number at its centre."""
    rows, columns = raster.values.shape
    step_m = raster.resolution_m / POINTS_TURNED
    cos, sin = math.cos(raster.yaw_rad), math.sin(raster.yaw_rad)
    corners = raster.resolution_m * np.array([(x, y) for x in (0, columns) for y in (0, rows)])
    corners = corners @ np.array([[cos, sin], [-sin, cos]])
    low = corners.min(axis=0)
    high, wide = (math.ceil(span / step_m) for span in (np.ptp(corners[:, 1]), np.ptp(corners[:, 0])))
    x, y = np.meshgrid(low[0] + (np.arange(wide) + 0.5) * step_m, low[1] + (np.arange(high) + 0.5) * step_m)
    column = np.floor((cos * x + sin * y) / raster.resolution_m).astype(np.int64)
    row = np.floor((cos * y - sin * x) / raster.resolution_m).astype(np.int64)
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    values = np.full(x.shape, np.nan)
    values[inside] = raster.values[row[inside], column[inside]]
    origin = raster.origin_enu_m
    return Raster(values, step_m, (origin[0] + float(low[0]), origin[1] + float(low[1])))
