"""Flying to a cell by a shortest way over free cells: to the start of a route, or home."""

from __future__ import annotations

from advise_ros.core.errors import InputError
from advise_ros.core.flight.leg_follower import CellMover, Pose
from advise_ros.core.flight.velocity_law import SeekSettings
from advise_ros.core.grid.grid import Action, Grid
from advise_ros.core.units import Vector


def shortest_way(grid: Grid, start: int, goal: int) -> tuple[int, ...]:
    """Actions over free cells, with as few turns as a greedy look finds; ties go to the lowest action.

    The start may be blocked: a vehicle that flew into a blocked cell has to leave it.

    Raises:
        InputError: there is no way.
    """
    distance = grid.distances_to(goal)
    if distance[start] < 0 and start != goal:
        free = [distance[grid.neighbour(start, action)] for action in Action]
        distance[start] = min((d for d in free if d >= 0), default=-2) + 1
    if distance[start] < 0:
        raise InputError(f'there is no way over free cells from {list(grid.xy(start))} to {list(grid.xy(goal))}')
    way: list[int] = []
    cell = start
    while cell != goal:
        downhill = [int(a) for a in Action if distance[grid.neighbour(cell, a)] == distance[cell] - 1]
        way.append(way[-1] if way and way[-1] in downhill else downhill[0])
        cell = grid.neighbour(cell, way[-1])
    return tuple(way)


class Transit:
    """Flies to the centre of a cell; a pure function of the poses given.

    It takes every cell as free to be in, so that a vehicle in a blocked cell or off the grid can come back,
    but it plans over free cells only.

    Attributes:
        finished: the centre was reached.
    """

    def __init__(self, grid: Grid, goal: int, settings: SeekSettings) -> None:
        self._grid, self._goal, self._settings = grid, goal, settings
        self._mover = CellMover(_open_grid(grid, goal), settings)
        self._way: list[int] = []
        self._here: int | None = None
        self._target = goal
        self.finished = False

    def step(self, pose: Pose) -> Vector:
        """Command for a pose, (east, north, up) in m/s.

        Raises:
            InputError: there is no way over free cells from where the vehicle is.
        """
        self._mover.observe(pose)
        cell = self._mover.cell
        if self._here is None or cell not in (self._here, self._target):
            self._plan(cell)
        elif self._mover.arrived:
            self._here = cell
            self._next_leg()
        return self._mover.velocity()

    def _plan(self, cell: int) -> None:
        """Anew from where the vehicle is; off the grid, first to the nearest centre."""
        self._here = cell
        self._way = list(shortest_way(self._grid, cell, self._goal))
        if self._mover.inside:
            self._next_leg()
        else:
            self._target = cell
            self._mover.go(cell, cell)

    def _next_leg(self) -> None:
        assert self._here is not None
        if not self._way:
            self._target = self._goal
            self._mover.go(self._goal, self._goal)
            self.finished = self._mover.arrived
            return
        action = self._way.pop(0)
        straight = next((n for n, other in enumerate(self._way) if other != action), len(self._way))
        self._target = self._grid.neighbour(self._here, action)
        run_on_m = straight * self._grid.resolution_m
        self._mover.go(self._here, self._target, run_on_m=run_on_m, corner=straight < len(self._way))


def _open_grid(grid: Grid, goal: int) -> Grid:
    """The same cells with nothing blocked and one waypoint, so that a tracker ends there and nowhere else."""
    return Grid(grid.resolution_m, grid.width, grid.height, grid.origin_enu_m, grid.altitude_m, (goal,))
