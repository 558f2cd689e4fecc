"""Positions -> grid states, with hysteresis at the borders: one rule for live nodes and for recordings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Action, Grid
from advise_ros.core.parameter import parameter
from advise_ros.core.units import NS


@dataclass(frozen=True)
class TrackerSettings:
    """How cells follow from positions: parameters of every node that has a `CellTracker`."""

    hysteresis_m: float = parameter(0.2, 'how far past a border counts as the next cell', low=0.0, high=100.0)
    max_skip_cells: int = parameter(
        3, 'cells skipped between two samples that are filled in along a straight line', low=0, high=1000,
    )


class Fix(NamedTuple):
    """A position on the map at a time."""

    stamp_ns: int
    x_enu_m: float
    y_enu_m: float


class Path(NamedTuple):
    """Cells along many fixes, wherever the flight may have ended.

    Attributes:
        rows: indices of the fixes at which the cell changes; the very first fix included.
        cells: column and row from each of them on.
    """

    rows: list[int]
    cells: list[tuple[int, int]]


class Step(NamedTuple):
    """What one fix changed.

    Attributes:
        actions: directions of the moves since the fix before, in order; empty when `broken`.
        states: the state after each of those moves; one state when `broken`.
        broken: the vehicle is elsewhere and the moves in between are not known.
    """

    actions: tuple[int, ...]
    states: tuple[int, ...]
    broken: bool = False


class CellTracker:
    """The state of a vehicle, kept up fix by fix.

    Each axis changes its index only `hysteresis_m` past the border, so a vehicle that hovers on a border
    stays in its cell. The next waypoint moves on as waypoints are entered. Terminal states (the goal, a
    blocked cell) are kept: the flight is over. Fixes further than `hysteresis_m` outside the grid and
    fixes that are not numbers change nothing.

    Several borders crossed between two fixes are resolved along the straight line between them, unless
    more than `max_skip_cells` cells were skipped, more than `max_gap_s` passed, or the line crosses a
    blocked cell: then the track is broken there.

    Raises:
        InputError: the hysteresis is not below half a cell.
    """

    def __init__(
        self, grid: Grid, hysteresis_m: float, *,
        max_skip_cells: int = TrackerSettings.max_skip_cells, max_gap_s: float = math.inf,
    ) -> None:
        check_hysteresis(grid, hysteresis_m)
        self.grid, self._hysteresis_m = grid, hysteresis_m
        self._max_skip_cells, self._max_gap_s = max_skip_cells, max_gap_s
        self.state: int | None = None
        self._before = Fix(0, 0.0, 0.0)

    @property
    def finished(self) -> bool:
        """A terminal state was entered."""
        return self.state is not None and self.grid.is_terminal(self.state)

    def update(self, x_enu_m: float, y_enu_m: float, stamp_ns: int = 0) -> int | None:
        """State after a fix; None as long as no fix was inside the grid.

        Args:
            x_enu_m, y_enu_m: position, east and north.
            stamp_ns: of the fix.
        """
        if self.is_inside(x_enu_m, y_enu_m):
            fix = Fix(stamp_ns, x_enu_m, y_enu_m)
            self.step(self._before, fix)
            self._before = fix
        return self.state

    def is_inside(self, x_enu_m: float, y_enu_m: float) -> bool:
        """Inside the grid or at most `hysteresis_m` outside; False for NaN.

        Args:
            x_enu_m, y_enu_m: position, east and north.
        """
        grid, margin = self.grid, self._hysteresis_m
        x, y = x_enu_m - grid.origin_enu_m[0], y_enu_m - grid.origin_enu_m[1]
        east, north = grid.width * grid.resolution_m, grid.height * grid.resolution_m
        return -margin <= x <= east + margin and -margin <= y <= north + margin

    def step(self, before: Fix, now: Fix) -> Step | None:
        """Take the fix `now`, inside the grid; `before` is the one before it. None when nothing changed."""
        if self.state is None:
            self.state = self._first_state(now)
            return None
        if self.grid.is_terminal(self.state):
            return None
        here = self.grid.xy(self.grid.cell_of(self.state))
        there = self._axis(0, here[0], now.x_enu_m), self._axis(1, here[1], now.y_enu_m)
        if here == there:
            return None
        return self.move(here, there, before, now)

    def move(self, here: tuple[int, int], there: tuple[int, int], before: Fix, now: Fix) -> Step:
        """Leave the cell of the state, `here`, for another one; a terminal state must not be left."""
        assert self.state is not None
        step = self._move(self.state, self._crossings(here, there, before, now), now.stamp_ns - before.stamp_ns)
        if step.broken:
            arrival = self.grid.enter(self.grid.next_waypoint(self.state), self.grid.cell(*there))
            step = Step((), (arrival,), broken=True)
        self.state = step.states[-1]
        return step

    def path(self, positions_enu_m: npt.NDArray[np.float64], here: tuple[int, int] | None = None) -> Path:
        """The cells along fixes (n, 2 or 3), n >= 1, all of them inside the grid.

        Args:
            here: column and row before them; None: taken from the first fix, which is in the result.
        """
        lowest, highest = zip(*(self._allowed(axis, positions_enu_m[:, axis]) for axis in (0, 1)), strict=True)
        # Only where the cells allowed change can the cell change.
        changed = np.zeros(len(positions_enu_m) - 1, dtype=np.bool_)
        for bounds in (*lowest, *highest):
            changed |= bounds[1:] != bounds[:-1]
        events = np.concatenate([[0], np.flatnonzero(changed) + 1])
        x, y = here or self._first_cell(*positions_enu_m[0, :2].tolist())
        rows: list[int] = [] if here else [0]
        cells = [] if here else [(x, y)]
        limits = (bounds[events].tolist() for bounds in (*lowest, *highest))
        for row, west, south, east, north in zip(events.tolist(), *limits, strict=True):
            here = x, y
            x = west if x < west else min(x, east)
            y = south if y < south else min(y, north)
            if here != (x, y):
                rows.append(row)
                cells.append((x, y))
        return Path(rows, cells)

    def _first_state(self, fix: Fix) -> int:
        grid = self.grid
        cell = grid.cell(*self._first_cell(fix.x_enu_m, fix.y_enu_m))
        return grid.state(0, cell) if grid.is_blocked(cell) else grid.start_state(cell)

    def _first_cell(self, x_enu_m: float, y_enu_m: float) -> tuple[int, int]:
        """Column and row of the nearest cell."""
        grid = self.grid
        x, y = (
            min(max(math.floor((value - origin) / grid.resolution_m), 0), size - 1)
            for value, origin, size in zip((x_enu_m, y_enu_m), grid.origin_enu_m, (grid.width, grid.height), strict=True)
        )
        return x, y

    def _allowed(self, axis: int, positions_m: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """As _axis: lowest and highest index that positions allow."""
        grid = self.grid
        past, size = positions_m - grid.origin_enu_m[axis], grid.height if axis else grid.width
        lowest, highest = (
            np.minimum(np.maximum(np.floor((past + margin) / grid.resolution_m), 0), size - 1).astype(np.int64)
            for margin in (-self._hysteresis_m, self._hysteresis_m)
        )
        return lowest, highest

    def _axis(self, axis: int, index: int, position_m: float) -> int:
        """Column (axis 0) or row (axis 1) after a position: the old one as long as its border allows."""
        grid = self.grid
        past = position_m - grid.origin_enu_m[axis]
        lowest = math.floor((past - self._hysteresis_m) / grid.resolution_m)
        highest = math.floor((past + self._hysteresis_m) / grid.resolution_m)
        size = grid.height if axis else grid.width
        return min(max(min(max(index, lowest), highest), 0), size - 1)

    def _move(self, state: int, actions: tuple[int, ...], gap_ns: int) -> Step:
        """The states along the moves; broken when the moves can't be believed."""
        grid = self.grid
        states: list[int] = []
        for action in actions:
            state = grid.successor(state, action)
            states.append(state)
            if grid.is_terminal(state):
                break
        skipped = len(actions) - 1
        through_blocked = any(grid.is_blocked(grid.cell_of(passed)) for passed in states[:skipped])
        gap_too_long = skipped > 0 and gap_ns > self._max_gap_s * NS
        broken = skipped > self._max_skip_cells or gap_too_long or through_blocked
        return Step(actions[: len(states)], tuple(states), broken)

    def _crossings(self, here: tuple[int, int], there: tuple[int, int], before: Fix, now: Fix) -> tuple[int, ...]:
        """Moves from cell to cell in the order in which the straight line between the fixes makes them."""
        moves: list[tuple[float, int]] = []
        for axis, (up, down) in enumerate(((Action.EAST, Action.WEST), (Action.NORTH, Action.SOUTH))):
            forward = there[axis] > here[axis]
            action = up if forward else down
            travel_m = now[axis + 1] - before[axis + 1]
            for count in range(abs(there[axis] - here[axis])):
                border = here[axis] + 1 + count if forward else here[axis] - count
                line_m = border * self.grid.resolution_m + (self._hysteresis_m if forward else -self._hysteresis_m)
                past_m = line_m + self.grid.origin_enu_m[axis] - before[axis + 1]
                moves.append((past_m / travel_m if travel_m else 0.0, int(action)))
        # Equal shares go to the axis first listed; sorting is stable.
        return tuple(action for _, action in sorted(moves, key=lambda move: move[0]))


def check_hysteresis(grid: Grid, hysteresis_m: float) -> None:
    """Refuse a hysteresis with which the centre of the next cell would not count as that cell.

    Args:
        grid: its cell size.
        hysteresis_m: must be below half of that.

    Raises:
        InputError: with both numbers and the remedy.
    """
    if not 0 <= hysteresis_m < grid.resolution_m / 2:
        raise InputError(
            f"parameter 'hysteresis_m' is {hysteresis_m:g}; "
            f'it must be below half a cell, {grid.resolution_m / 2:g} m on this grid'
        )
