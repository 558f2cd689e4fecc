"""One flight of a learnt policy: poses in, one command each out."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from enum import IntEnum

from advise_ros.core.errors import InputError
from advise_ros.core.flight.flight_settings import FlightSettings
from advise_ros.core.flight.leg_follower import CellMover, Pose, nearest_cell, off_grid_m
from advise_ros.core.flight.start import Centring, start_cell_of
from advise_ros.core.flight.transit import Transit
from advise_ros.core.flight.velocity_law import SeekSettings, brake_distance_m
from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.planning.rollout import step_budget
from advise_ros.core.units import NS, ZERO, Vector

# A vehicle that swings out of the grid steers back; this many cells outside, the flight is lost.
LOST_CELLS = 0.5


class FlightPhase(IntEnum):
    """As advise_msgs/FlightStatus."""

    IDLE = 0
    TO_START = 1
    FLYING = 2
    SUCCEEDED = 3
    BUDGET_SPENT = 4
    BLOCKED = 5
    CANCELED = 6
    STOPPED = 7
    LOST = 8

    @property
    def over(self) -> bool:
        return self not in (FlightPhase.TO_START, FlightPhase.FLYING)


@dataclass(frozen=True)
class FlightPlan:
    """What one flight is flown by.

    Attributes:
        grid: the policy's grid.
        greedy: (n_states,) action by state.
        start_cell: cell to fly to before the route begins; -1: begin at the centre of the present or nearest one.
        step_budget: steps before the battery counts as spent; 0: `step_budget_factor` times the shortest route.
        stop_on_loop: end a flight as BUDGET_SPENT as soon as a state comes back. A greedy policy that does not
            leave the grid's rules would go round until the budget is spent; this saves the time of it.
        centre_first: fly slowly to the centre of the cell before the route begins; False, as flights that
            were recorded before there was this: begin wherever in its cell the vehicle is, and never off the grid.
        start_reach_m: how far off the grid a flight may begin.

    Raises:
        InputError: the policy does not fit the grid, or the start cell is blocked or outside.
    """

    grid: Grid
    greedy: tuple[int, ...]
    start_cell: int = -1
    step_budget: int = 0
    step_budget_factor: float = FlightSettings.step_budget_factor
    stop_on_loop: bool = FlightSettings.stop_on_loop
    centre_first: bool = FlightSettings.centre_first
    start_reach_m: float = FlightSettings.start_reach_m

    def __post_init__(self) -> None:
        if len(self.greedy) != self.grid.n_states:
            raise InputError(
                f'the policy has {len(self.greedy)} actions for the {self.grid.n_states} states of its grid; '
                'it needs one a state'
            )
        wrong = next((a for a in self.greedy if not 0 <= a < N_ACTIONS), None)
        if wrong is not None:
            raise InputError(f'the policy holds action {wrong}; actions are 0 to {N_ACTIONS - 1}')
        if self.start_cell < -1:
            raise InputError(f'start cell {self.start_cell} is no cell; give one of 0 to {self.grid.n_cells - 1}, or -1')
        if self.start_cell >= 0:
            self.grid.start_state(self.start_cell)

    def budget(self, start_state: int) -> int:
        """Steps allowed for a flight that begins in a state."""
        if self.step_budget > 0:
            return self.step_budget
        return max(1, step_budget(self.grid, start_state, self.step_budget_factor))


def check_start(plan: FlightPlan, position_enu_m: Vector) -> None:
    """Refuse a flight that cannot begin, before it is accepted.

    Args:
        plan: policy and start cell.
        position_enu_m: (east, north, up) of the vehicle.

    Raises:
        InputError: too far off the grid, in a blocked cell without a start cell to go to, or no way to it.
    """
    reach_m = plan.start_reach_m if plan.centre_first or plan.start_cell >= 0 else 0.0
    start_cell_of(plan.grid, position_enu_m, plan.start_cell, reach_m)


class PolicyFlight:
    """Flies a plan; a pure function of the poses given, so that a replay rebuilds each command.

    Feed it the poses in the order of their stamps. The first one begins the flight: it goes to the centre of its
    cell (centre_first), then to the start cell, if there is one, and then along the route. The state follows
    CellTracker; a step ends where the centre of the next cell is reached, or where the vehicle was blown
    into another cell. The flight is over at the centre of the final waypoint, in a blocked cell, off the
    grid (by more than LOST_CELLS), when the budget is spent, or in a loop (see FlightPlan).

    Attributes:
        phase, state, steps, step_budget, message: as advise_msgs/FlightStatus.
    """

    def __init__(self, plan: FlightPlan, settings: SeekSettings) -> None:
        self.plan, self._settings = plan, settings
        grid = plan.grid
        begins_elsewhere = plan.centre_first or plan.start_cell >= 0
        self.phase = FlightPhase.TO_START if begins_elsewhere else FlightPhase.FLYING
        self.state = grid.start_state(plan.start_cell) if plan.start_cell >= 0 else 0
        self.steps = 0
        self.step_budget = plan.budget(self.state) if plan.start_cell >= 0 else 0
        self.message = ''
        self._transits: deque[Centring | Transit] | None = None  # Ways to fly before the route; None before the first pose.
        self._was_on_grid = False
        self._mover = CellMover(grid, settings)
        self._leg_states: tuple[int, int] | None = None  # The state left and the state flown to.
        self._flown: set[int] = set()
        self._stay_since_ns: int | None = None

    @property
    def waypoints_reached(self) -> int:
        """Waypoints passed in order; all of them after a success."""
        done = self.phase == FlightPhase.SUCCEEDED
        return self.plan.grid.n_layers if done else self.plan.grid.next_waypoint(self.state)

    def step(self, pose: Pose) -> Vector:
        """Command for a pose, (east, north, up) in m/s; zero once the flight is over."""
        if self.phase == FlightPhase.TO_START:
            return self._to_start(pose)
        if self.phase == FlightPhase.FLYING:
            self._mover.observe(pose)
            self._fly(pose.stamp_ns)
        return ZERO if self.phase.over else self._mover.velocity()

    def end(self, phase: FlightPhase, message: str) -> None:
        """End the flight from outside (CANCELED or STOPPED)."""
        if not self.phase.over:
            self.phase, self.message = phase, message

    # -- to the start of the route -----------------------------------------------------------
    def _to_start(self, pose: Pose) -> Vector:
        if self._transits is None:
            self._transits = deque(self._ways_to_start(pose))
        reach_m = self.plan.start_reach_m if self.plan.centre_first else math.inf
        if self._is_lost(off_grid_m(self.plan.grid, pose.position_enu_m), reach_m):
            return ZERO
        try:
            while self._transits:
                velocity = self._transits[0].step(pose)
                if not self._transits[0].finished:
                    return velocity
                self._transits.popleft()
        except InputError as problem:
            self.end(FlightPhase.LOST, str(problem))
            return ZERO
        self.phase = FlightPhase.FLYING
        return self.step(pose)

    def _ways_to_start(self, pose: Pose) -> list[Centring | Transit]:
        grid, start_cell = self.plan.grid, self.plan.start_cell
        here = nearest_cell(grid, pose.position_enu_m)
        ways: list[Centring | Transit] = []
        if self.plan.centre_first and (start_cell < 0 or off_grid_m(grid, pose.position_enu_m) > 0.0):
            ways.append(Centring(grid, pose, self._settings))
        if start_cell >= 0:
            ways.append(Transit(grid, start_cell, self._settings))
        elif not grid.is_blocked(here):
            self.state = grid.start_state(here)
            self.step_budget = self.plan.budget(self.state)
        return ways

    def _is_lost(self, off_m: float, reach_m: float) -> bool:
        """End the flight of a vehicle that is further off the grid than any of its swings."""
        if off_m == 0.0:
            self._was_on_grid = True
        if off_m <= reach_m + LOST_CELLS * self.plan.grid.resolution_m:
            return False
        last = f'last in cell {self._cell_text(self.state)}' if self._was_on_grid else 'and has not been on it in this flight'
        self.end(FlightPhase.LOST, f'the vehicle is {off_m:.1f} m off the grid, {last}')
        return True

    # -- along the route ---------------------------------------------------------------------
    def _fly(self, stamp_ns: int) -> None:
        state = self._mover.state
        if self._is_lost(self._mover.outside_m, 0.0):
            return
        if state is None:  # Beside the grid, where a flight without centre_first does not begin.
            self.end(FlightPhase.LOST, f'the vehicle is {self._mover.outside_m:.1f} m off the grid and has not been on it')
            return
        if self._leg_states is None:
            self._begin(state, stamp_ns)
            return
        self.state = state
        if self.plan.grid.is_blocked(self.plan.grid.cell_of(state)):
            self.steps += 1
            self.end(FlightPhase.BLOCKED, f'cell {self._cell_text(state)} is blocked')
        elif state not in self._leg_states:
            self._step_done(state, stamp_ns, strayed=True)
        elif self._leg_states[0] == self._leg_states[1]:
            self._stay(state, stamp_ns)
        elif self._mover.arrived:
            self._step_done(state, stamp_ns)

    def _begin(self, state: int, stamp_ns: int) -> None:
        self.state = state
        self.step_budget = self.plan.budget(state)
        if self.plan.grid.is_terminal(state):
            if state == self.plan.grid.goal_state:
                self.end(FlightPhase.SUCCEEDED, 'the route is one cell')
            else:
                self.end(FlightPhase.BLOCKED, 'the first cell is blocked')
            return
        self._depart(state, stamp_ns)

    def _step_done(self, state: int, stamp_ns: int, *, strayed: bool = False) -> None:
        self.steps += 1
        if strayed:  # Wind may break a loop as it made it.
            self._flown.clear()
        if state == self.plan.grid.goal_state:
            self._finish(strayed)
        elif self.steps >= self.step_budget:
            self.end(FlightPhase.BUDGET_SPENT, f'{self.steps} steps did not reach the final waypoint')
        else:
            self._depart(state, stamp_ns)

    def _finish(self, strayed: bool) -> None:
        by_wind = ', blown into its cell' if strayed else ''
        self.end(FlightPhase.SUCCEEDED, f'final waypoint reached in {self.steps} steps{by_wind}')

    def _depart(self, state: int, stamp_ns: int) -> None:
        """Choose the next leg by the policy."""
        grid = self.plan.grid
        if self.plan.stop_on_loop and state in self._flown:
            self.end(FlightPhase.BUDGET_SPENT, self._loop_text(state))
            return
        self._flown.add(state)
        target = grid.successor(state, self.plan.greedy[state])
        self._leg_states = (state, target)
        self._stay_since_ns = stamp_ns
        if state == target and self.plan.stop_on_loop:
            cell = self._cell_text(state)
            self.end(FlightPhase.BUDGET_SPENT, f'the policy stays in cell {cell} for ever: it moves off the grid')
            return
        run_on_m, corner = self._run_on(target)
        self._mover.go(grid.cell_of(state), grid.cell_of(target), run_on_m=run_on_m, corner=corner)

    def _stay(self, state: int, stamp_ns: int) -> None:
        """A move off the grid: a step lasts as long as it takes to cross a cell."""
        assert self._stay_since_ns is not None
        crossing_ns = self.plan.grid.resolution_m / self._settings.speed_m_s * NS
        if stamp_ns - self._stay_since_ns >= crossing_ns:
            self._step_done(state, stamp_ns)

    def _run_on(self, target: int) -> tuple[float, bool]:
        """Way that goes straight on beyond the next centre, as far as it matters, and whether a turn follows it."""
        grid, greedy = self.plan.grid, self.plan.greedy
        assert self._leg_states is not None
        action = greedy[self._leg_states[0]]
        far_m, run_m = brake_distance_m(self._settings), 0.0
        while run_m <= far_m:
            beyond = grid.successor(target, greedy[target])
            if beyond == target:
                return run_m, False
            if greedy[target] != action:
                return run_m, True
            run_m += grid.resolution_m
            target = beyond
        return run_m, True

    def _cell_text(self, state: int) -> str:
        return str(list(self.plan.grid.xy(self.plan.grid.cell_of(state))))

    def _loop_text(self, state: int) -> str:
        waypoint = self.plan.grid.waypoints[self.plan.grid.next_waypoint(state)]
        return (
            f'the policy flies in a loop: it is in cell {self._cell_text(state)} again and would not reach '
            f'waypoint {list(self.plan.grid.xy(waypoint))} with the {self.step_budget - self.steps} steps left'
        )
