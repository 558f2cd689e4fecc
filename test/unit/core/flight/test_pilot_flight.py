"""Demonstration flights, in plain arithmetic."""

import random
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from advise_ros.core.errors import InputError
from advise_ros.core.flight.leg_follower import Pose
from advise_ros.core.flight.pilot_flight import PilotFlight
from advise_ros.core.flight.velocity_law import SeekSettings
from advise_ros.core.grid.cell_tracker import CellTracker
from advise_ros.core.grid.grid import Action, Grid
from advise_ros.core.people.simulated_pilot import SimulatedPilot
from support.policies import best, square
from support.vehicle import LazyVehicle, fly

SETTINGS = SeekSettings()
N, E, S, W = Action


def flown(flight: PilotFlight, grid: Grid, vehicle: LazyVehicle, delay_s: float = 0.02, limit_s: float = 600.0) -> list[int]:
    """States that a recorder would see until the route ends, after flying it and home."""
    jitter = random.Random(2)
    tracker = CellTracker(grid, SETTINGS.hysteresis_m)
    states: list[int] = []
    for pose, _ in fly(flight.step, vehicle, delay_s=lambda: delay_s * jitter.uniform(0.5, 1.5), limit_s=limit_s):
        state = tracker.update(*pose.position_enu_m[:2], pose.stamp_ns)
        if not flight.ending and state is not None and state not in states[-1:]:
            states.append(state)
        if flight.finished:
            return states
    raise AssertionError(f'not home after {limit_s} s: move {flight.moves}, {flight.ending!r}')


def logged(choose: Callable[[int], int]) -> tuple[Callable[[int], int], list[tuple[int, int]]]:
    log: list[tuple[int, int]] = []

    def note(state: int) -> int:
        log.append((state, choose(state)))
        return log[-1][1]

    return note, log


@pytest.mark.parametrize(('speed_m_s', 'delay_s'), [(1.2, 0.02), (1.2, 0.6), (2.0, 0.3)])
def test_a_recorder_sees_exactly_the_moves_that_were_chosen(speed_m_s: float, delay_s: float) -> None:
    grid = square(4)
    choose, chosen = logged(SimulatedPilot(grid, 0.4, 0.2, np.random.default_rng(4)).action)
    flight = PilotFlight(grid, choose, replace(SETTINGS, speed_m_s=speed_m_s), 400)
    states = flown(flight, grid, LazyVehicle([0.0, 0.0, 3.0]), delay_s)
    assert states == [*(state for state, _ in chosen), grid.goal_state]
    assert flight.moves == len(chosen) > 12
    assert flight.ending == 'the final waypoint was reached'


def test_a_move_off_the_grid_is_not_flown_and_counts() -> None:
    grid = square(3)
    right = best(grid)
    tries: dict[int, int] = {}

    def choose(state: int) -> int:
        tries[state] = tries.get(state, 0) + 1
        return int(S) if state == 0 and tries[state] < 3 else right[state]

    flight = PilotFlight(grid, choose, SETTINGS, 400)
    states = flown(flight, grid, LazyVehicle([0.0, 0.0, 3.0]))
    assert [grid.cell_of(s) for s in states] == [0, 1, 2, 5, 8, 7, 6, 3, 0]
    assert flight.moves == 8 + 2


def test_it_gives_up_after_its_moves_and_flies_home() -> None:
    grid = square(3)
    flight = PilotFlight(grid, lambda state: int(E if grid.cell_of(state) % 3 == 0 else W), SETTINGS, 7)
    vehicle = LazyVehicle([0.0, 0.0, 3.0])
    flown(flight, grid, vehicle)
    assert (flight.moves, flight.gave_up, flight.ending) == (7, True, '7 moves did not reach the final waypoint')
    assert vehicle.position[:2] == pytest.approx((0.0, 0.0), abs=0.5)


def test_only_walls_end_a_flight_too() -> None:
    grid = square(3)
    flight = PilotFlight(grid, lambda state: int(S), SETTINGS, 50)
    flown(flight, grid, LazyVehicle([0.0, 0.0, 3.0]))
    assert flight.moves == 50


def test_a_blocked_cell_ends_the_route_and_it_comes_home_over_free_cells() -> None:
    grid = replace(square(3), blocked=(4,))
    right = best(grid)
    flight = PilotFlight(grid, lambda state: int(N) if state == 1 else right[state], SETTINGS, 50)
    vehicle = LazyVehicle([0.0, 0.0, 3.0])
    states = flown(flight, grid, vehicle)
    assert states[:2] == [0, 1]
    assert flight.ending == 'a blocked cell ended it'
    assert flight.home == 0


def test_home_is_where_the_first_flight_began() -> None:
    grid = square(3)
    first = PilotFlight(grid, best(grid).__getitem__, SETTINGS, 50)
    assert first.home is None
    vehicle = LazyVehicle([*grid.centre_enu_m(4), 3.0])
    flown(first, grid, vehicle)
    assert first.home == 4
    assert grid.cell_at(*vehicle.position[:2]) == 4


def test_one_that_is_blown_off_the_grid_comes_back_and_goes_on() -> None:
    grid = square(3)
    flight = PilotFlight(grid, best(grid).__getitem__, SETTINGS, 50)
    vehicle = LazyVehicle([0.0, 0.0, 3.0])
    blown = False
    for _ in fly(flight.step, vehicle, limit_s=120.0):
        if not blown and vehicle.position[0] > 1.5:
            vehicle.position[1] -= 2.0
            blown = True
        if flight.finished:
            break
    assert flight.finished
    assert flight.ending == 'the final waypoint was reached'


@pytest.mark.parametrize('position', [(0.9, -0.9), (-2.5, 0.3)])
def test_it_begins_at_the_centre_of_its_cell(position: tuple[float, float]) -> None:
    """Where take-off left it beside the centre, or off the grid."""
    grid = square(3)
    flight = PilotFlight(grid, best(grid).__getitem__, SETTINGS, 50)
    for pose, _ in fly(flight.step, LazyVehicle([*position, 3.0]), limit_s=120.0):
        if flight.moves:
            assert pose.position_enu_m[:2] == pytest.approx((0.0, 0.0), abs=SETTINGS.arrival_radius_m)
            break
    assert (flight.home, flight.moves > 0) == (0, True)


def test_it_does_not_begin_far_off_the_grid() -> None:
    grid = square(3)
    flight = PilotFlight(grid, best(grid).__getitem__, SETTINGS, 50)
    with pytest.raises(InputError, match=r'is 39.0 m off the grid, at east -40.0 m, .*nearest cell is \[0, 0\]'):
        flight.step(Pose(1, (-40.0, 0.0, 3.0)))
