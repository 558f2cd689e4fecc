"""Flights of hand-made policies, in plain arithmetic."""

import math
import random
import re
import struct
from dataclasses import replace

import pytest

from advise_ros.core.errors import InputError
from advise_ros.core.flight.leg_follower import Pose
from advise_ros.core.flight.policy_flight import FlightPhase, FlightPlan, PolicyFlight, check_start
from advise_ros.core.flight.start import CENTRING_M_S, CENTRING_S
from advise_ros.core.flight.velocity_law import SeekSettings
from advise_ros.core.grid.grid import Action, Grid
from advise_ros.core.units import NS, ZERO, Vector
from support.policies import best, square
from support.vehicle import LazyVehicle, fly

SETTINGS = SeekSettings()
N, E, S, W = Action


def vehicle_in(grid: Grid, cell: int, **settings: object) -> LazyVehicle:
    return LazyVehicle([*grid.centre_enu_m(cell), grid.altitude_m], **settings)  # type: ignore[arg-type]


def flown(
    flight: PolicyFlight, vehicle: LazyVehicle, delay_s: float = 0.02, limit_s: float = 300.0,
) -> tuple[list[tuple[Pose, Vector]], list[int]]:
    """Poses with commands until the flight is over, and the states on the way."""
    jitter = random.Random(1)
    history, states = [], []
    for pose, command in fly(flight.step, vehicle, delay_s=lambda: delay_s * jitter.uniform(0.5, 1.5), limit_s=limit_s):
        history.append((pose, command))
        if flight.phase != FlightPhase.TO_START and (not states or states[-1] != flight.state):
            states.append(flight.state)
        if flight.phase.over:
            return history, states
    raise AssertionError(f'not over after {limit_s} s: {flight.phase.name}, state {flight.state}, step {flight.steps}')


def changed(grid: Grid, greedy: tuple[int, ...], waypoint: int, cell: tuple[int, int], action: Action) -> tuple[int, ...]:
    state = grid.state(waypoint, grid.cell(*cell))
    return (*greedy[:state], int(action), *greedy[state + 1:])


def test_the_waypoints_are_visited_in_order_in_the_fewest_steps() -> None:
    grid = square(4)
    flight = PolicyFlight(FlightPlan(grid, best(grid)), SETTINGS)
    _, states = flown(flight, vehicle_in(grid, 0))
    assert (flight.phase, flight.steps, flight.step_budget, flight.waypoints_reached) == (FlightPhase.SUCCEEDED, 12, 24, 4)
    assert [grid.cell_of(state) for state in states] == [0, 1, 2, 3, 7, 11, 15, 14, 13, 12, 8, 4, 0]
    assert flight.message == 'final waypoint reached in 12 steps'


@pytest.mark.parametrize('speed_m_s', [1.2, 2.0])
@pytest.mark.parametrize('delay_s', [0.05, 0.3, 0.6])
def test_late_commands_do_not_throw_it_off_the_route(speed_m_s: float, delay_s: float) -> None:
    grid = square(4)
    flight = PolicyFlight(FlightPlan(grid, best(grid)), replace(SETTINGS, speed_m_s=speed_m_s))
    history, states = flown(flight, vehicle_in(grid, 0), delay_s)
    assert flight.phase is FlightPhase.SUCCEEDED
    assert flight.steps == 12
    assert len(states) == 13, 'no cell beside the route was entered'
    assert history[-1][0].stamp_ns / NS < 12 * 2.5


def test_a_straight_run_is_flown_without_slowing_down() -> None:
    grid = Grid(2.0, 8, 1, (-1.0, -1.0), 3.0, (7,))
    flight = PolicyFlight(FlightPlan(grid, best(grid), start_cell=0), SETTINGS)
    history, _ = flown(flight, vehicle_in(grid, 0))
    under_way = [command[0] for pose, command in history if 1.0 < pose.position_enu_m[0] < 11.0]
    assert under_way
    assert min(under_way) == SETTINGS.speed_m_s


def test_it_flies_to_the_start_over_free_cells_first() -> None:
    grid = replace(square(3), blocked=(4,))
    flight = PolicyFlight(FlightPlan(grid, best(grid), start_cell=0), SETTINGS)
    assert flight.phase is FlightPhase.TO_START
    history, _ = flown(flight, vehicle_in(grid, 8))
    assert (flight.phase, flight.steps) == (FlightPhase.SUCCEEDED, 8), 'the way to the start costs no steps'
    assert all(grid.cell_at(*pose.position_enu_m[:2]) != 4 for pose, _ in history)


def test_it_begins_where_it_is_when_no_start_is_named() -> None:
    grid = square(3)
    flight = PolicyFlight(FlightPlan(grid, best(grid)), SETTINGS)
    _, states = flown(flight, vehicle_in(grid, 4))
    assert flight.phase is FlightPhase.SUCCEEDED
    assert states[0] == grid.state(0, 4)


def test_a_blocked_cell_ends_it_where_it_is_entered() -> None:
    grid = replace(square(3), blocked=(4,))
    flight = PolicyFlight(FlightPlan(grid, changed(grid, best(grid), 0, (1, 0), N)), SETTINGS)
    history, _ = flown(flight, vehicle_in(grid, 0))
    assert (flight.phase, flight.steps, flight.message) == (FlightPhase.BLOCKED, 2, 'cell [1, 1] is blocked')
    assert history[-1][1] == ZERO


def test_off_the_grid_it_is_lost() -> None:
    grid = square(3)
    flight = PolicyFlight(FlightPlan(grid, best(grid)), SETTINGS)
    flown(flight, vehicle_in(grid, 0, wind_m_s=(0.0, -2.0)))
    assert flight.phase is FlightPhase.LOST
    assert 'm off the grid, last in cell [0, 0]' in flight.message


def test_a_swing_over_the_edge_is_steered_back() -> None:
    grid = square(3)
    flight = PolicyFlight(FlightPlan(grid, best(grid)), SETTINGS)
    vehicle = vehicle_in(grid, 0)
    for _ in fly(flight.step, vehicle, limit_s=120.0):
        if flight.state == 1 and vehicle.position[0] < 2.2:
            vehicle.position[1] = -1.8
        if flight.phase.over:
            break
    assert (flight.phase, flight.steps) == (FlightPhase.SUCCEEDED, 8)


def test_a_wall_is_no_way_to_spend_a_flight() -> None:
    grid = square(3)
    plan = FlightPlan(grid, changed(grid, best(grid), 0, (2, 0), S))
    plan = replace(plan, greedy=changed(grid, plan.greedy, 1, (2, 1), E))
    flight = PolicyFlight(plan, SETTINGS)
    flown(flight, vehicle_in(grid, 0))
    assert (flight.phase, flight.steps, flight.waypoints_reached) == (FlightPhase.BUDGET_SPENT, 3, 1)
    assert flight.message == 'the policy stays in cell [2, 1] for ever: it moves off the grid'


def test_a_wall_costs_a_step_each_time_when_loops_are_flown_on() -> None:
    grid = square(3)
    plan = FlightPlan(grid, changed(grid, best(grid), 0, (1, 0), S), stop_on_loop=False, step_budget=5)
    flight = PolicyFlight(plan, SETTINGS)
    history, _ = flown(flight, vehicle_in(grid, 0))
    assert (flight.phase, flight.steps) == (FlightPhase.BUDGET_SPENT, 5)
    crossing_s = grid.resolution_m / SETTINGS.speed_m_s
    assert history[-1][0].stamp_ns / NS >= 5 * crossing_s


@pytest.mark.parametrize('stop_on_loop', [True, False])
def test_a_loop_ends_at_once_or_when_the_budget_is_spent(stop_on_loop: bool) -> None:
    grid = square(3)
    greedy = changed(grid, best(grid), 0, (1, 0), W)
    flight = PolicyFlight(FlightPlan(grid, greedy, stop_on_loop=stop_on_loop), SETTINGS)
    _, states = flown(flight, vehicle_in(grid, 0))
    assert flight.phase is FlightPhase.BUDGET_SPENT
    assert flight.steps == (2 if stop_on_loop else 16)
    assert {grid.cell_of(state) for state in states} == {0, 1}
    if stop_on_loop:
        assert flight.message.startswith('the policy flies in a loop: it is in cell [0, 0] again')


def test_a_gust_into_another_cell_costs_a_step_and_the_policy_goes_on_from_there() -> None:
    grid = square(4)
    flight = PolicyFlight(FlightPlan(grid, best(grid)), SETTINGS)
    vehicle = vehicle_in(grid, 0)
    blown = False
    for _ in fly(flight.step, vehicle, limit_s=120.0):
        if not blown and flight.state == 1:
            vehicle.position[1] += 2.0
            blown = True
        if flight.phase.over:
            break
    assert (flight.phase, flight.steps) == (FlightPhase.SUCCEEDED, 13), 'the leg that ended aside and its way back'


def test_a_gust_does_not_make_a_loop_of_a_good_policy() -> None:
    grid = square(4)
    flight = PolicyFlight(FlightPlan(grid, best(grid)), SETTINGS)
    vehicle = vehicle_in(grid, 0)
    gusts = 2
    for _ in fly(flight.step, vehicle, limit_s=120.0):
        if gusts and flight.state == 2:
            vehicle.position[0] -= 2.0
            gusts -= 1
        if flight.phase.over:
            break
    assert flight.phase is FlightPhase.SUCCEEDED


def test_positions_lost_for_a_while_lose_no_waypoint() -> None:
    grid = Grid(2.0, 6, 1, (-1.0, -1.0), 3.0, (2, 5))
    flight = PolicyFlight(FlightPlan(grid, best(grid), start_cell=-1), SETTINGS)
    for second, east in enumerate((0.0, 2.0, 6.2, 8.0, 10.0)):
        flight.step(Pose(second * NS + 1, (east, 0.0, 3.0)))
    assert flight.phase is FlightPhase.SUCCEEDED


def test_the_same_poses_give_the_same_bytes() -> None:
    grid = square(4)
    plan = FlightPlan(grid, best(grid), start_cell=0)
    history, _ = flown(PolicyFlight(plan, SETTINGS), vehicle_in(grid, 5), 0.3)
    again = PolicyFlight(plan, SETTINGS)
    for pose, command in history:
        assert struct.pack('<3d', *again.step(pose)) == struct.pack('<3d', *command)
    assert again.phase is FlightPhase.SUCCEEDED


def test_after_its_end_a_flight_commands_nothing() -> None:
    grid = square(3)
    flight = PolicyFlight(FlightPlan(grid, best(grid)), SETTINGS)
    flight.step(Pose(1, (0.0, 0.0, 3.0)))
    flight.end(FlightPhase.CANCELED, 'canceled')
    flight.end(FlightPhase.STOPPED, 'too late')
    assert flight.step(Pose(NS, (0.1, 0.0, 3.0))) == ZERO
    assert (flight.phase, flight.message) == (FlightPhase.CANCELED, 'canceled')


@pytest.mark.parametrize(('changes', 'words'), [
    ({'greedy': (0, 1)}, 'has 2 actions for the 36 states'),
    ({'greedy': (4,) * 36}, 'holds action 4'),
    ({'start_cell': 9}, 'start cell 9 is blocked or outside'),
    ({'start_cell': -2}, 'start cell -2 is no cell'),
])
def test_a_plan_that_does_not_fit_is_refused_in_words(changes: dict[str, object], words: str) -> None:
    grid = square(3)
    with pytest.raises(InputError, match=words):
        FlightPlan(**{'grid': grid, 'greedy': best(grid), **changes})  # type: ignore[arg-type]


def start_of(flight: PolicyFlight, vehicle: LazyVehicle) -> list[tuple[Pose, Vector]]:
    """Poses and commands until the route begins; the flight is flown on to its end."""
    way = []
    for pose, command in fly(flight.step, vehicle, limit_s=300.0):
        if flight.phase is FlightPhase.TO_START:
            way.append((pose, command))
        if flight.phase.over:
            return way
    raise AssertionError(f'not over: {flight.phase.name}')


@pytest.mark.parametrize('wind_m_s', [(0.0, 0.0), (0.3, 0.0), (-0.2, 0.2)])
@pytest.mark.parametrize(('position', 'cell'), [
    ((0.9, -0.9), 0), ((-2.0, 0.5), 0), ((-1.1, -3.5), 0), ((6.5, 2.4), 5), ((2.5, 1.6), 4),
])  # fmt: skip
def test_it_goes_slowly_to_the_centre_of_its_cell_before_the_route(
    position: tuple[float, float], cell: int, wind_m_s: tuple[float, float],
) -> None:
    """Take-off leaves a PX4 beside the centre, or a metre or two off the grid."""
    grid = square(3)
    vehicle = LazyVehicle([*position, grid.altitude_m], wind_m_s=wind_m_s)
    plan = FlightPlan(grid, best(grid))
    check_start(plan, (*position, grid.altitude_m))
    flight = PolicyFlight(plan, replace(SETTINGS, speed_m_s=2.0))
    way = start_of(flight, vehicle)
    assert way, 'the way to the centre is flown'
    assert max(math.hypot(*command[:2]) for _, command in way) <= CENTRING_M_S + 1e-9
    at = way[-1][0].position_enu_m
    assert math.dist(at[:2], grid.centre_enu_m(cell)) < SETTINGS.arrival_radius_m + 0.15
    assert (flight.phase, flight.waypoints_reached) == (FlightPhase.SUCCEEDED, 4), flight.message


def test_in_the_centre_the_route_begins_with_the_first_pose() -> None:
    grid = square(3)
    flight = PolicyFlight(FlightPlan(grid, best(grid)), SETTINGS)
    assert flight.phase is FlightPhase.TO_START
    flight.step(Pose(1, (0.1, 0.2, 3.0)))
    assert flight.phase is FlightPhase.FLYING


def test_a_wind_that_keeps_it_beside_the_centre_does_not_keep_it_from_the_route() -> None:
    grid = square(3)
    vehicle = LazyVehicle([0.9, 0.0, grid.altitude_m], wind_m_s=(0.45, 0.0))
    flight = PolicyFlight(FlightPlan(grid, best(grid)), SETTINGS)
    way = start_of(flight, vehicle)
    assert way[-1][0].stamp_ns / NS == pytest.approx(CENTRING_S, abs=0.2)
    assert flight.steps > 0


def test_a_vehicle_that_is_blown_away_on_its_way_to_the_grid_is_lost() -> None:
    grid = square(3)
    flight = PolicyFlight(FlightPlan(grid, best(grid)), SETTINGS)
    start_of(flight, LazyVehicle([-2.0, 0.0, grid.altitude_m], wind_m_s=(-1.5, 0.0)))
    assert flight.phase is FlightPhase.LOST
    assert re.fullmatch(r'the vehicle is 4\.\d m off the grid, and has not been on it in this flight', flight.message)


def test_one_recorded_before_there_was_a_way_to_the_centre_flies_as_it_did() -> None:
    grid = square(3)
    plan = FlightPlan(grid, best(grid), centre_first=False)
    flight = PolicyFlight(plan, SETTINGS)
    assert flight.phase is FlightPhase.FLYING
    assert flight.step(Pose(1, (0.0, 0.5, 3.0)))[0] > CENTRING_M_S
    with pytest.raises(InputError, match='off the grid'):
        check_start(plan, (-1.5, 0.0, 3.0))


def test_a_flight_that_cannot_begin_is_refused_in_words() -> None:
    grid = replace(square(3), blocked=(4,))
    anywhere, to_cell_0 = FlightPlan(grid, best(grid)), FlightPlan(grid, best(grid), start_cell=0)
    for plan in (anywhere, to_cell_0):
        with pytest.raises(InputError, match=r'is 4.0 m off the grid, at east -5.0 m, .*nearest cell is \[0, 0\]; .*at most 3 m'):
            check_start(plan, (-5.0, 0.0, 3.0))
    with pytest.raises(InputError, match=r'in the blocked cell \[1, 1\]'):
        check_start(anywhere, (2.0, 2.0, 3.0))
    corner = replace(grid, blocked=(2,), waypoints=(8,))
    with pytest.raises(InputError, match=r'off the grid beside the blocked cell \[2, 0\]'):
        check_start(FlightPlan(corner, (0,) * corner.n_states), (6.0, -2.0, 3.0))
    check_start(to_cell_0, (2.0, 2.0, 3.0))
    check_start(to_cell_0, (-3.0, 0.0, 3.0))
    check_start(anywhere, (-3.0, 0.0, 3.0))
    check_start(anywhere, (0.0, 0.0, 3.0))
