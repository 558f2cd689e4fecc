"""Maps with cells of other sizes and places, on the cells of a grid."""

from __future__ import annotations

import math

import numpy as np
import pytest

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.obstacles import with_obstacles
from advise_ros.core.grid.raster import Raster, on_cells

GRID = Grid(2.0, 4, 3, (-1.0, -1.0), 5.0, (3, 11, 0))


def test_the_same_cells_keep_their_numbers() -> None:
    values = np.arange(12.0).reshape(3, 4)
    known, mean = on_cells(Raster(values, 2.0, (-1.0, -1.0)), GRID)
    assert np.array_equal(known, np.ones(12)) and np.allclose(mean, values.ravel())


def test_smaller_larger_and_shifted_cells_count_by_area() -> None:
    fine = np.zeros((30, 40))
    fine[:5, :10] = 1.0  # The southern half of cell (0, 0), cells of 0.2 m.
    assert on_cells(Raster(fine, 0.2, (-1.0, -1.0)), GRID).mean == pytest.approx([0.5, *[0.0] * 11])
    coarse = np.array([[1.0, 0.0]])  # 4 m each, along the southern rows.
    assert on_cells(Raster(coarse, 4.0, (-1.0, -1.0)), GRID).mean[:8] == pytest.approx([1, 1, 0, 0] * 2)
    known, mean = on_cells(Raster(np.array([[1.0]]), 2.0, (0.0, -1.0)), GRID)
    assert known[:3] == pytest.approx([0.5, 0.5, 0.0]) and mean[:2] == pytest.approx([1.0, 1.0]) and np.isnan(mean[2])


def test_what_is_unknown_takes_no_part() -> None:
    known, mean = on_cells(Raster(np.array([[1.0, np.nan], [0.0, np.nan]]), 1.0, (-1.0, -1.0)), GRID)
    assert known[0] == pytest.approx(0.5) and mean[0] == pytest.approx(0.5)


@pytest.mark.parametrize('yaw', [math.pi / 2, -math.pi / 2, math.pi])
def test_a_turned_map_lies_where_it_was_turned_to(yaw: float) -> None:
    centre = np.array([6.0, 4.0]) / 2 + (-1.0, -1.0)
    values = np.zeros((8, 8))
    values[1, 2] = 1.0
    raster = Raster(values, 1.0, (float(centre[0]), float(centre[1])), yaw)
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    where = centre + turn @ (2.5, 1.5)
    wide = Grid(1.0, 24, 24, (-10.0, -10.0), 5.0, (0,))
    assert on_cells(raster, wide).mean[wide.cell_at(*where)] == pytest.approx(1.0, abs=0.02)
    assert np.nansum(on_cells(raster, wide).mean) == pytest.approx(1.0, abs=0.05)


def test_every_cell_that_an_obstacle_reaches_into_is_blocked() -> None:
    occupancy = np.zeros((60, 80))
    occupancy[22:25, 22:45] = 1.0  # From 0.2 m in cell (1, 1) to half of cell (2, 1), cells of 0.1 m.
    occupancy[0, 79] = np.nan
    found = with_obstacles(GRID, Raster(occupancy, 0.1, (-1.0, -1.0)))
    assert [found.xy(cell) for cell in found.blocked] == [(1, 1), (2, 1)]


def test_an_obstacle_that_ends_at_a_border_stays_on_its_side() -> None:
    occupancy = np.zeros((60, 80))
    occupancy[20:40, 20:40] = 1.0  # Cell (1, 1) to the last pixel, at a resolution that is no binary fraction.
    found = with_obstacles(GRID, Raster(occupancy, 0.1, (-1.0, -1.0)))
    assert [found.xy(cell) for cell in found.blocked] == [(1, 1)]


def test_obstacles_that_no_route_can_bear_are_named() -> None:
    wall = np.zeros((3, 4))
    wall[2, 3] = 1.0
    with pytest.raises(InputError, match=r'waypoint 2, cell \[3, 2\], is in an obstacle \(100% of the cell\); move the waypoint'):
        with_obstacles(GRID, Raster(wall, 2.0, (-1.0, -1.0)))
    wall = np.zeros((3, 4))
    wall[:, 1] = 1.0
    with pytest.raises(InputError, match='there is no way from waypoint'):
        with_obstacles(GRID, Raster(wall, 2.0, (-1.0, -1.0)))
    with pytest.raises(InputError, match=r'no part of it lies on the grid: it begins at \[100.0, 0.0\]'):
        with_obstacles(GRID, Raster(wall, 2.0, (100.0, 0.0)))
