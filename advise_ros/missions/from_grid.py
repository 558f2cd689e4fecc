"""A route over a grid with a place on the earth -> a mission for other tools."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.missions.mission import EarthPosition, FlightMission
from advise_ros.recording.place import Place


def cells_flown(grid: Grid, greedy: Sequence[int], start_cell: int | None = None) -> list[int]:
    """The cells of a policy's route, from the start through all waypoints.

    Args:
        grid: the site and the route.
        greedy: (states,) the action in each state.
        start_cell: where the flight begins; None: at the final position.

    Raises:
        InputError: the policy does not come to the end.
    """
    state = grid.start_state(start_cell)
    cells, known = [grid.cell_of(state)], {state}
    while state != grid.goal_state:
        state = grid.successor(state, int(greedy[state]))
        cells.append(grid.cell_of(state))
        if state in known or grid.is_blocked(cells[-1]):
            raise InputError(
                f'the policy does not come to the end: it stops on the way to waypoint {grid.next_waypoint(state) + 1} of '
                f'{grid.n_layers}; answer its questions, or fly the route once more'
            )
        known.add(state)
    return cells


def mission_of(grid: Grid, place: Place, cells: Sequence[int], *, every_cell: bool = False) -> FlightMission:
    """The route as a mission at the grid's altitude; home is where it begins, the grid's border and blocked cells are areas.

    Args:
        grid: the site and the route.
        place: of the grid.
        cells: of the route, each beside the one before.
        every_cell: a waypoint in each cell; else where the route turns, and at the waypoints of the grid.
    """
    kept = list(cells) if every_cell else _corners(grid, cells)
    waypoints = _positions(place, [grid.centre_enu_m(cell) for cell in kept], grid.altitude_m)
    (x, y), width_m, height_m = grid.origin_enu_m, grid.width * grid.resolution_m, grid.height * grid.resolution_m
    border = _positions(place, [(x, y), (x + width_m, y), (x + width_m, y + height_m), (x, y + height_m)], None)
    blocked = tuple(_square(grid, place, cell) for cell in grid.blocked)
    return FlightMission(waypoints, (border,), blocked, waypoints[0]._replace(height_m=0.0))


def _corners(grid: Grid, cells: Sequence[int]) -> list[int]:
    """Where the route turns, and the waypoints in their order on it."""
    steps = [np.subtract(grid.xy(after), grid.xy(before)).tolist() for before, after in pairwise(cells)]
    kept, next_waypoint = [cells[0]], 0
    for index, cell in enumerate(cells[1:], start=1):
        reached = next_waypoint < grid.n_layers and cell == grid.waypoints[next_waypoint]
        next_waypoint += reached
        if reached or index == len(steps) or steps[index] != steps[index - 1]:
            kept.append(cell)
    return kept


def _square(grid: Grid, place: Place, cell: int) -> tuple[EarthPosition, ...]:
    (x, y), half_m = grid.centre_enu_m(cell), grid.resolution_m / 2.0
    corners = [(x - half_m, y - half_m), (x + half_m, y - half_m), (x + half_m, y + half_m), (x - half_m, y + half_m)]
    return _positions(place, corners, None)


def _positions(place: Place, at_m: Sequence[tuple[float, float]], height_m: float | None) -> tuple[EarthPosition, ...]:
    on_earth = place.on_earth(np.array(at_m, dtype=np.float64))
    return tuple(EarthPosition(float(latitude), float(longitude), height_m) for latitude, longitude in on_earth)
