"""Samples of a vehicle that flies from cell centre to cell centre, for tests of recording and discretising."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from advise_ros.core.demonstrations.samples import CommandSamples, PoseSamples, Recording, VehicleEvent
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import NS

SPEED_M_S = 1.0
PERIOD_NS = 100_000_000
START_NS = 1000 * NS

GRID = Grid(2.0, 4, 3, (-1.0, -1.0), 5.0, waypoints=(3, 11, 0))


def cells(grid: Grid, *places: tuple[int, int]) -> list[int]:
    return [grid.cell(*place) for place in places]


def round_trip(grid: Grid = GRID) -> list[int]:
    """Cells of a flight along the grid's waypoints from the final position, moving east and west first."""
    route = [grid.waypoints[-1]]
    for waypoint in grid.waypoints:
        (x, y), (to_x, to_y) = grid.xy(route[-1]), grid.xy(waypoint)
        while (x, y) != (to_x, to_y):
            if x != to_x:
                x += 1 if to_x > x else -1
            else:
                y += 1 if to_y > y else -1
            route.append(grid.cell(x, y))
    return route


def track(points: Sequence[tuple[float, float, float]], start_ns: int = START_NS) -> PoseSamples:
    """Positions along straight lines between points at SPEED_M_S, one every PERIOD_NS."""
    corners = np.asarray(points, dtype=np.float64)
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    steps = np.arange(0.0, along[-1] + 1e-9, SPEED_M_S * PERIOD_NS / NS)
    positions = np.column_stack([np.interp(steps, along, corners[:, axis]) for axis in range(3)])
    return PoseSamples(start_ns + PERIOD_NS * np.arange(len(steps), dtype=np.int64), positions)


def commands_of(poses: PoseSamples) -> CommandSamples:
    """The velocity commanded after each position: that which leads to the next one."""
    velocities = np.diff(poses.positions_enu_m, axis=0, append=poses.positions_enu_m[-1:]) * NS / PERIOD_NS
    return CommandSamples(poses.stamps_ns.copy(), velocities)


def flight(grid: Grid, route: Sequence[int], start_ns: int = START_NS, *, landing: bool = True) -> Recording:
    """Take-off in the first cell, the route, landing in the last one; armed and in the air all the while."""
    level = [(*grid.centre_enu_m(cell), grid.altitude_m) for cell in route]
    ground = [(*grid.centre_enu_m(cell), 0.0) for cell in (route[0], route[-1])]
    poses = track([ground[0], *level, *(ground[1:] if landing else [])], start_ns)
    first, last = int(poses.stamps_ns[0]), int(poses.stamps_ns[-1])
    events = (
        VehicleEvent(first - NS, False, False), VehicleEvent(first - 1, True, False), VehicleEvent(first, True, True),
        *((VehicleEvent(last, True, False), VehicleEvent(last + NS, False, False)) if landing else ()),
    )
    return Recording(poses, commands_of(poses), events, source='made up')


def joined(*recordings: Recording) -> Recording:
    """Flights one after the other."""
    return Recording(
        PoseSamples(*(np.concatenate(arrays) for arrays in zip(*(r.poses for r in recordings), strict=True))),
        CommandSamples(*(np.concatenate(arrays) for arrays in zip(*(r.commands for r in recordings), strict=True))),
        tuple(event for r in recordings for event in r.events),
        tuple(event for r in recordings for event in r.policy),
        recordings[0].source,
    )
