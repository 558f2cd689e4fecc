"""Where a flight may begin: take-off leaves a vehicle beside the centre of its cell, or a little off the grid."""

from __future__ import annotations

from dataclasses import replace

from advise_ros.core.errors import InputError
from advise_ros.core.flight.leg_follower import Pose, nearest_cell, off_grid_m
from advise_ros.core.flight.transit import Transit, shortest_way
from advise_ros.core.flight.velocity_law import SeekSettings
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import NS, Vector

# Faster than any drift that was measured, and slow enough to stop within a part of a cell.
CENTRING_M_S = 0.6
CENTRING_S = 20.0


class Centring:
    """Flies slowly to the centre of the cell of the first pose, or of the nearest one; a pure function of the poses.

    A steady wind may keep the vehicle beside the centre: after CENTRING_S, on the grid is enough.

    Attributes:
        finished: the route can begin.
    """

    def __init__(self, grid: Grid, first: Pose, settings: SeekSettings) -> None:
        slowly = replace(settings, speed_m_s=min(CENTRING_M_S, settings.speed_m_s))
        self._grid, self._began_ns = grid, first.stamp_ns
        self._late = False
        self._transit = Transit(grid, nearest_cell(grid, first.position_enu_m), slowly)

    @property
    def finished(self) -> bool:
        return self._transit.finished or self._late

    def step(self, pose: Pose) -> Vector:
        """Command for a pose, (east, north, up) in m/s.

        Raises:
            InputError: blown into another cell, from which there is no way over free cells.
        """
        on_grid = off_grid_m(self._grid, pose.position_enu_m) == 0.0
        self._late = on_grid and pose.stamp_ns - self._began_ns > CENTRING_S * NS
        return self._transit.step(pose)


def start_cell_of(grid: Grid, position_enu_m: Vector, start_cell: int, reach_m: float) -> int:
    """The cell that a flight from a position first goes to the centre of: the present or the nearest one.

    Args:
        position_enu_m: (east, north, up).
        start_cell: where the route is to begin; -1: in the cell returned.
        reach_m: how far off the grid a flight may begin.

    Raises:
        InputError: the vehicle is further away, the cell is blocked and no other one is to be flown to, or there is
            no way to it.
    """
    check_reach(grid, position_enu_m, reach_m)
    cell = nearest_cell(grid, position_enu_m)
    if start_cell >= 0:
        shortest_way(grid, cell, start_cell)
    elif grid.is_blocked(cell):
        where = 'in' if off_grid_m(grid, position_enu_m) == 0.0 else 'off the grid beside'
        raise InputError(f'the vehicle is {where} the blocked cell {list(grid.xy(cell))}; fly it out or give a start_cell')
    return cell


def check_reach(grid: Grid, position_enu_m: Vector, reach_m: float) -> None:
    """Refuse a flight that would begin too far off the grid.

    Args:
        grid: cells.
        position_enu_m: (east, north, up).
        reach_m: how far off the grid a flight may begin.

    Raises:
        InputError: the position is more than `reach_m` off the grid.
    """
    off_m = off_grid_m(grid, position_enu_m)
    if off_m > reach_m:
        east, north, _ = position_enu_m
        raise InputError(
            f'the vehicle is {off_m:.1f} m off the grid, at east {east:.1f} m, north {north:.1f} m; its nearest cell is '
            f'{list(grid.xy(nearest_cell(grid, position_enu_m)))}; a flight begins at most {reach_m:g} m off the grid: '
            'fly it nearer'
        )
