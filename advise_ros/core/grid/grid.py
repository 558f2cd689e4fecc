"""The grid, its waypoints and the rule that numbers states and actions.

This module is the only owner of the state index: state = next_waypoint * n_cells + cell.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property

from advise_ros.core.errors import InputError

MAX_STATES = 1_000_000


class Action(IntEnum):
    """A move to the neighbouring cell; the index is public interface."""

    NORTH = 0
    EAST = 1
    SOUTH = 2
    WEST = 3


N_ACTIONS = len(Action)

# (east, north) cells moved, indexed by action.
ACTION_STEP: tuple[tuple[int, int], ...] = ((0, 1), (1, 0), (0, -1), (-1, 0))


@dataclass(frozen=True)
class Grid:
    """Cells of a map in the ENU frame, flown at one altitude, with the route's waypoints.

    Attributes:
        resolution_m: edge of a cell.
        width, height: cells along east (x) and north (y).
        origin_enu_m: lower left corner of cell (0, 0).
        altitude_m: flight altitude above the map's origin.
        waypoints: cell indices (y * width + x) in the order of flight; the last is the final position.
        blocked: cell indices that end a flight, ascending.

    Raises:
        InputError: a size is not positive, a waypoint or blocked cell lies outside, a waypoint is
            blocked or repeats its predecessor, or a waypoint cannot be reached.
    """

    resolution_m: float
    width: int
    height: int
    origin_enu_m: tuple[float, float]
    altitude_m: float
    waypoints: tuple[int, ...]
    blocked: tuple[int, ...] = ()
    _blocked_set: frozenset[int] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        self._check_size()
        object.__setattr__(self, 'blocked', tuple(sorted(set(self.blocked))))
        object.__setattr__(self, '_blocked_set', frozenset(self.blocked))
        self._check_cells()
        self._check_reachable()

    def _check_size(self) -> None:
        for name, number in (
            ('resolution', self.resolution_m),
            ('width', self.width),
            ('height', self.height),
            ('altitude', self.altitude_m),
        ):
            if not (math.isfinite(number) and number > 0):
                raise InputError(f'grid: {name} is {number}; it must be a positive number')
        if not all(math.isfinite(v) for v in self.origin_enu_m):
            raise InputError(f'grid: origin is {list(self.origin_enu_m)}; it must be two finite numbers')
        if not self.waypoints:
            raise InputError('grid: waypoints is empty; name at least the final position')
        if self.n_states > MAX_STATES:
            raise InputError(
                f'grid: {self.width} x {self.height} cells with {self.n_layers} waypoints make '
                f'{self.n_states} states; at most {MAX_STATES} are supported, use larger cells'
            )

    def _check_cells(self) -> None:
        for name, cells in (('waypoint', self.waypoints), ('blocked cell', self.blocked)):
            for cell in cells:
                if not 0 <= cell < self.n_cells:
                    raise InputError(
                        f'grid: {name} {cell} lies outside the {self.width} x {self.height} grid '
                        f'(cells 0 to {self.n_cells - 1})'
                    )
        for index, cell in enumerate(self.waypoints):
            if cell in self._blocked_set:
                raise InputError(f'grid: waypoint {list(self.xy(cell))} is a blocked cell; free it or move it')
            if index and cell == self.waypoints[index - 1]:
                raise InputError(f'grid: waypoint {list(self.xy(cell))} stands twice in a row; drop one')

    def _check_reachable(self) -> None:
        distance = self.distances_to(self.waypoints[-1])
        for cell in self.waypoints:
            if distance[cell] < 0:
                raise InputError(
                    f'grid: there is no way from waypoint {list(self.xy(cell))} to the final position '
                    f'{list(self.xy(self.waypoints[-1]))}; free some of the {len(self.blocked)} blocked cells'
                )

    # -- sizes -------------------------------------------------------------------------------
    @cached_property
    def n_cells(self) -> int:
        return self.width * self.height

    @property
    def n_layers(self) -> int:
        """One layer of states a waypoint: the cells with that waypoint next."""
        return len(self.waypoints)

    @property
    def n_states(self) -> int:
        return self.n_layers * self.n_cells

    # -- cells -------------------------------------------------------------------------------
    def xy(self, cell: int) -> tuple[int, int]:
        """Column (east) and row (north) of a cell."""
        return cell % self.width, cell // self.width

    def cell(self, x: int, y: int) -> int:
        """Cell index of a column and row inside the grid."""
        return y * self.width + x

    def contains(self, x: int, y: int) -> bool:
        return 0 <= x < self.width and 0 <= y < self.height

    def is_blocked(self, cell: int) -> bool:
        return cell in self._blocked_set

    def cell_at(self, x_enu_m: float, y_enu_m: float) -> int | None:
        """Cell that holds a position, or None outside; borders belong to the upper right cell.

        Args:
            x_enu_m, y_enu_m: position, east and north.
        """
        x = math.floor((x_enu_m - self.origin_enu_m[0]) / self.resolution_m)
        y = math.floor((y_enu_m - self.origin_enu_m[1]) / self.resolution_m)
        return self.cell(x, y) if self.contains(x, y) else None

    def centre_enu_m(self, cell: int) -> tuple[float, float]:
        x, y = self.xy(cell)
        return (
            self.origin_enu_m[0] + (x + 0.5) * self.resolution_m,
            self.origin_enu_m[1] + (y + 0.5) * self.resolution_m,
        )

    def neighbour(self, cell: int, action: int) -> int:
        """Cell that an action leads to; a move off the grid stays."""
        x, y = self.xy(cell)
        dx, dy = ACTION_STEP[action]
        return self.cell(x + dx, y + dy) if self.contains(x + dx, y + dy) else cell

    def distances_to(self, goal: int) -> list[int]:
        """Fewest moves from each cell to `goal` over free cells, -1 where there is no way."""
        distance = [-1] * self.n_cells
        distance[goal] = 0
        queue = deque([goal])
        while queue:
            here = queue.popleft()
            for action in Action:
                there = self.neighbour(here, action)
                if distance[there] < 0 and there not in self._blocked_set:
                    distance[there] = distance[here] + 1
                    queue.append(there)
        return distance

    # -- states ------------------------------------------------------------------------------
    def state(self, next_waypoint: int, cell: int) -> int:
        return next_waypoint * self.n_cells + cell

    def next_waypoint(self, state: int) -> int:
        return state // self.n_cells

    def cell_of(self, state: int) -> int:
        return state % self.n_cells

    @cached_property
    def goal_state(self) -> int:
        """The last layer's state on the final position: the flight is over."""
        return self.state(self.n_layers - 1, self.waypoints[-1])

    def is_terminal(self, state: int) -> bool:
        """The goal, or a blocked cell in any layer."""
        return state == self.goal_state or self.cell_of(state) in self._blocked_set

    def enter(self, next_waypoint: int, cell: int) -> int:
        """State after arriving in `cell` with `next_waypoint` ahead: reaching it moves on to the next layer."""
        if cell == self.waypoints[next_waypoint] and next_waypoint < self.n_layers - 1:
            return self.state(next_waypoint + 1, cell)
        return self.state(next_waypoint, cell)

    def successor(self, state: int, action: int) -> int:
        """State that an action leads to; terminal states stay."""
        if self.is_terminal(state):
            return state
        return self.enter(self.next_waypoint(state), self.neighbour(self.cell_of(state), action))

    def start_state(self, cell: int | None = None) -> int:
        """First state of a flight that begins in `cell` (default: the final position, a round trip).

        Raises:
            InputError: the cell is blocked or outside.
        """
        start = self.waypoints[-1] if cell is None else cell
        if not 0 <= start < self.n_cells or start in self._blocked_set:
            raise InputError(f'start cell {start} is blocked or outside the {self.width} x {self.height} grid')
        return self.enter(0, start) if self.n_layers > 1 else self.state(0, start)


def optimal_actions(grid: Grid, state: int) -> tuple[int, ...]:
    """Actions on a shortest way to the next waypoint, ascending; empty in terminal states."""
    if grid.is_terminal(state):
        return ()
    layer = grid.next_waypoint(state)
    distance = grid.distances_to(grid.waypoints[layer])
    here = distance[grid.cell_of(state)]
    if here == 0:  # On the waypoint with itself next: any free neighbour leads back.
        here = 2
    return tuple(
        int(action)
        for action in Action
        if distance[grid.neighbour(grid.cell_of(state), action)] == here - 1
    )
