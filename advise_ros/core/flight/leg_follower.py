"""Moves a vehicle from cell centre to cell centre: where it is, which leg it flies, what to command."""

from __future__ import annotations

import math
from typing import NamedTuple

from advise_ros.core.flight.velocity_law import Leg, SeekSettings, seek
from advise_ros.core.grid.cell_tracker import CellTracker
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import NS, ZERO, Vector

# Velocity is the mean over this time: shorter, and the noise of positions shows.
VELOCITY_WINDOW_NS = 250_000_000
# Positions further apart than this say nothing of the velocity.
VELOCITY_GAP_NS = NS
# A centre counts as reached only this near to the line, as a share of a cell.
ARRIVAL_CROSS = 0.3


class Pose(NamedTuple):
    """A position in the map frame (ENU) at a time."""

    stamp_ns: int
    position_enu_m: Vector


class CellMover:
    """Follows legs between cells; a pure function of the poses and legs given.

    Attributes:
        state: grid state of the vehicle (see CellTracker), None before the first pose on the grid.
        inside: the last pose was on the grid, give or take the hysteresis.
    """

    def __init__(self, grid: Grid, settings: SeekSettings) -> None:
        self.grid, self.settings = grid, settings
        self._tracker = CellTracker(grid, settings.hysteresis_m)
        self.inside = False
        self._recent: list[Pose] = []
        self._leg: Leg | None = None
        self._target: int | None = None

    @property
    def state(self) -> int | None:
        return self._tracker.state

    @property
    def cell(self) -> int:
        """Cell of the vehicle; off the grid the last one, before any the nearest."""
        if self.state is None:
            return nearest_cell(self.grid, self._recent[-1].position_enu_m)
        return self.grid.cell_of(self.state)

    def observe(self, pose: Pose) -> None:
        """Take the next pose; stamps must grow, unless the clock was set."""
        x, y, _ = pose.position_enu_m
        self.inside = self._tracker.is_inside(x, y)
        self._tracker.update(x, y, pose.stamp_ns)
        if self._recent and not 0 <= pose.stamp_ns - self._recent[-1].stamp_ns <= VELOCITY_GAP_NS:
            self._recent.clear()
        self._recent.append(pose)
        while len(self._recent) > 2 and pose.stamp_ns - self._recent[1].stamp_ns >= VELOCITY_WINDOW_NS:
            self._recent.pop(0)

    def go(self, start: int, target: int, *, run_on_m: float = 0.0, corner: bool = False) -> None:
        """Fly from the centre of a cell to that of another in its row or column.

        Args:
            start, target: cells.
            run_on_m: how far the route goes straight on behind the target.
            corner: whether it then turns.
        """
        self._target = target
        centres = self.grid.centre_enu_m(start), self.grid.centre_enu_m(target)
        self._leg = Leg(*centres, self.grid.resolution_m, run_on_m, corner)

    @property
    def outside_m(self) -> float:
        """How far off the grid the vehicle is, 0 on it."""
        return off_grid_m(self.grid, self._recent[-1].position_enu_m)

    @property
    def arrived(self) -> bool:
        """The leg's end was reached: its cell entered, and its centre near or passed."""
        if self._leg is None or not self.inside or self.cell != self._target:
            return False
        position = self._recent[-1].position_enu_m
        near_line = abs(self._leg.cross_m(position)) <= ARRIVAL_CROSS * self.grid.resolution_m
        return near_line and self._leg.remaining_m(position) <= self.settings.arrival_radius_m

    def velocity(self) -> Vector:
        """Command for the last pose, (east, north, up) in m/s; zero without a leg."""
        if self._leg is None or not self._recent:
            return ZERO
        position = self._recent[-1].position_enu_m
        return seek(position, self._seen_velocity(), self._leg, self.grid.altitude_m, self.settings)

    def _seen_velocity(self) -> Vector:
        first, last = self._recent[0], self._recent[-1]
        seconds = (last.stamp_ns - first.stamp_ns) / NS
        if seconds <= 0:
            return ZERO
        # A jump of the position estimate must not throw the vehicle about.
        limit = 2.0 * self.settings.speed_m_s
        x, y, z = (
            max(-limit, min(limit, (now - then) / seconds))
            for then, now in zip(first.position_enu_m, last.position_enu_m, strict=True)
        )
        return (x, y, z)


def nearest_cell(grid: Grid, position_enu_m: Vector) -> int:
    """Cell of a position, or the nearest one to a position off the grid.

    Args:
        grid: cells.
        position_enu_m: (east, north, up).
    """
    x, y = (
        min(max(int((value - origin) // grid.resolution_m), 0), size - 1)
        for value, origin, size in zip(position_enu_m[:2], grid.origin_enu_m, (grid.width, grid.height), strict=True)
    )
    return grid.cell(x, y)


def off_grid_m(grid: Grid, position_enu_m: Vector) -> float:
    """Horizontal distance from the grid, 0 on it.

    Args:
        grid: cells.
        position_enu_m: (east, north, up).
    """
    off_m = (
        max(origin - value, value - origin - size * grid.resolution_m, 0.0)
        for value, origin, size in zip(position_enu_m[:2], grid.origin_enu_m, (grid.width, grid.height), strict=True)
    )
    return math.hypot(*off_m)
