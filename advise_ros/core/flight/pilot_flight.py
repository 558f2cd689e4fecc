"""One demonstration flight of the simulated pilot: moves chosen one by one, then the way home."""

from __future__ import annotations

from collections.abc import Callable

from advise_ros.core.flight.flight_settings import FlightSettings
from advise_ros.core.flight.leg_follower import CellMover, Pose
from advise_ros.core.flight.start import CENTRING_S, check_reach
from advise_ros.core.flight.transit import Transit
from advise_ros.core.flight.velocity_law import SeekSettings
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import NS, ZERO, Vector


class PilotFlight:
    """Flies the moves that `choose` names for each state, then home; a pure function of the poses and choices.

    The flight begins at the centre of the cell of the first pose, or of the nearest one. A move off the grid
    leaves the vehicle where it is and counts. The route ends at the centre of the final waypoint, in a blocked
    cell or after `max_moves`; then the vehicle flies to `home` over free cells (None: the cell of the first pose).

    Attributes:
        moves: moves chosen so far.
        seconds: time on the route so far, by the poses' stamps.
        ending: why the route ended, in words; empty before.
        gave_up: it ended because no moves were left.
        finished: home again, at the centre of its cell.
    """

    def __init__(
        self, grid: Grid, choose: Callable[[int], int], settings: SeekSettings, max_moves: int, home: int | None = None,
    ) -> None:
        self._grid, self._choose, self._settings = grid, choose, settings
        self._max_moves, self._home = max_moves, home
        self._mover = CellMover(grid, settings)
        self._transit: Transit | None = None
        self._leg_states: tuple[int, int] | None = None
        self._chosen: tuple[int, int] | None = None  # A state ahead and its action.
        self._blown_out = self._centred = False
        self._began_ns: int | None = None
        self.moves = 0
        self.seconds = 0.0
        self.ending = ''
        self.gave_up = False

    @property
    def finished(self) -> bool:
        return self._transit is not None and self._transit.finished

    @property
    def state(self) -> int | None:
        """Grid state on the route, None before the first pose on the grid."""
        return self._mover.state

    @property
    def home(self) -> int | None:
        """Cell to come back to, None before the first pose when it is to be the first cell."""
        return self._home

    def step(self, pose: Pose) -> Vector:
        """Command for a pose, (east, north, up) in m/s.

        Raises:
            InputError: there is no way home over free cells, or the first pose is more than `start_reach_m` off the grid.
        """
        if self._transit is None:
            if self._began_ns is None:
                check_reach(self._grid, pose.position_enu_m, FlightSettings.start_reach_m)
                self._began_ns = pose.stamp_ns
            self.seconds = (pose.stamp_ns - self._began_ns) / NS
            self._mover.observe(pose)
            self._fly()
        if self._transit is None:
            return self._mover.velocity()
        return ZERO if self._transit.finished else self._transit.step(pose)

    def _fly(self) -> None:
        state = self._mover.state
        if state is None or not self._mover.inside:
            self._come_back()
            return
        if self._home is None:
            self._home = self._grid.cell_of(state)
        if self._grid.is_blocked(self._grid.cell_of(state)):
            self._go_home('a blocked cell ended it')
        elif not self._centred and not self._at_centre():
            return
        elif self._leg_states is None or state not in self._leg_states or self._blown_out or self._mover.arrived:
            self._depart(state)

    def _at_centre(self) -> bool:
        """Whether it has come to the centre of its first cell, or has tried for CENTRING_S."""
        self._mover.go(self._mover.cell, self._mover.cell)
        self._centred = self._mover.arrived or self.seconds > CENTRING_S
        return self._centred

    def _come_back(self) -> None:
        """Off the grid: to the centre of the nearest cell, as a person would."""
        self._blown_out = True
        self._mover.go(self._mover.cell, self._mover.cell)

    def _depart(self, state: int) -> None:
        self._blown_out = False
        if state == self._grid.goal_state:
            self._go_home('the final waypoint was reached')
            return
        action = self._next_action(state)
        if action is None:
            self.gave_up = True
            self._go_home(f'{self._max_moves} moves did not reach the final waypoint')
            return
        target = self._grid.successor(state, action)
        self._leg_states = (state, target)
        run_on_m, corner = self._look_ahead(target, action)
        self._mover.go(self._grid.cell_of(state), self._grid.cell_of(target), run_on_m=run_on_m, corner=corner)

    def _next_action(self, state: int) -> int | None:
        """The action chosen ahead, or a new one that moves; None when no move is left."""
        if self._chosen is not None and self._chosen[0] == state:
            action = self._chosen[1]
            self._chosen = None
            return action
        cell = self._grid.cell_of(state)
        while self.moves < self._max_moves:
            self.moves += 1
            action = self._choose(state)
            if self._grid.neighbour(cell, action) != cell:
                return action
        return None

    def _look_ahead(self, target: int, action: int) -> tuple[float, bool]:
        """Choose the move after this one early, so that a straight run keeps its speed."""
        self._chosen = None
        if self._grid.is_terminal(target):
            return 0.0, False
        beyond = self._next_action(target)
        if beyond is None:
            return 0.0, False
        self._chosen = (target, beyond)
        return (self._grid.resolution_m, False) if beyond == action else (0.0, True)

    def _go_home(self, ending: str) -> None:
        assert self._home is not None
        self.ending = ending
        self._transit = Transit(self._grid, self._home, self._settings)
