"""Laws of flying that hold for any grid, policy and position."""

import math
from dataclasses import replace

from hypothesis import assume, given, settings
from hypothesis import strategies as st

from advise_ros.core.errors import InputError
from advise_ros.core.flight.keyboard import decode
from advise_ros.core.flight.policy_flight import FlightPhase, FlightPlan, PolicyFlight
from advise_ros.core.flight.transit import shortest_way
from advise_ros.core.flight.velocity_law import Leg, SeekSettings, seek
from advise_ros.core.grid.grid import Grid
from advise_ros.core.planning.rollout import rollout
from support.vehicle import LazyVehicle, fly

any_float = st.floats(allow_nan=True, allow_infinity=True)
some_metres = st.floats(-50.0, 50.0)
vectors = st.tuples(some_metres, some_metres, some_metres)
seek_settings = st.builds(
    SeekSettings,
    speed_m_s=st.floats(0.05, 20.0), approach_gain_1_s=st.floats(0.05, 20.0), braking_m_s2=st.floats(0.1, 20.0),
    altitude_gain_1_s=st.floats(0.0, 20.0), climb_m_s=st.floats(0.0, 10.0), lead_s=st.floats(0.0, 5.0),
    corner_share=st.floats(0.0, 0.5),
)
legs = st.builds(
    lambda start, length, along_x, run_on, corner: Leg(
        start, (start[0] + length * along_x, start[1] + length * (not along_x)), max(abs(length), 0.1), run_on, corner,
    ),
    st.tuples(some_metres, some_metres), st.sampled_from([-2.0, 0.0, 0.5, 2.0]), st.booleans(),
    st.floats(0.0, 10.0), st.booleans(),
)


@given(st.tuples(any_float, any_float, any_float), st.tuples(any_float, any_float, any_float), legs, any_float, seek_settings)
def test_a_command_is_finite_and_within_its_limits_whatever_comes_in(position, velocity, leg, altitude_m, chosen) -> None:
    east, north, up = seek(position, velocity, leg, altitude_m, chosen)
    assert all(math.isfinite(value) for value in (east, north, up))
    assert math.hypot(east, north) <= chosen.speed_m_s * (1 + 1e-9)
    assert abs(up) <= chosen.climb_m_s


@given(vectors, vectors, legs, seek_settings)
def test_north_is_flown_as_east_is(position, velocity, leg, chosen) -> None:
    """The law has no favourite direction: a quarter turn of the world turns the command."""

    def turned(point):
        return (-point[1], point[0], *point[2:])

    east, north, up = seek(position, velocity, leg, 3.0, chosen)
    other = leg._replace(start_enu_m=turned(leg.start_enu_m), end_enu_m=turned(leg.end_enu_m))
    command = seek(turned(position), turned(velocity), other, 3.0, chosen)
    assert all(math.isclose(a, b, abs_tol=1e-9) for a, b in zip(command, (-north, east, up), strict=True))


@st.composite
def grids(draw) -> Grid:
    width, height = draw(st.integers(1, 4)), draw(st.integers(1, 4))
    cells = st.integers(0, width * height - 1)
    waypoints = tuple(draw(st.lists(cells, min_size=1, max_size=3)))
    blocked = tuple(draw(st.lists(cells, max_size=3)))
    try:
        return Grid(draw(st.sampled_from([1.0, 2.0, 5.0])), width, height, (-1.0, 3.0), 3.0, waypoints, blocked)
    except InputError:
        assume(False)
        raise


@settings(max_examples=60, deadline=None)
@given(grids(), st.data(), st.booleans())
def test_a_flight_ends_as_the_grid_model_says(grid: Grid, data: st.DataObject, stop_on_loop: bool) -> None:
    """Any policy, in still air: success, blocked cell and spent budget come out as in `rollout`."""
    greedy = tuple(data.draw(st.lists(st.integers(0, 3), min_size=grid.n_states, max_size=grid.n_states)))
    free = [cell for cell in range(grid.n_cells) if not grid.is_blocked(cell)]
    start = data.draw(st.sampled_from(free))
    plan = FlightPlan(grid, greedy, step_budget=data.draw(st.integers(1, 12)), stop_on_loop=stop_on_loop)
    flight = PolicyFlight(plan, replace(SeekSettings(), speed_m_s=2.0))
    for _ in fly(flight.step, LazyVehicle([*grid.centre_enu_m(start), 3.0]), limit_s=200.0):
        if flight.phase.over:
            break
    model = rollout(grid, greedy, grid.start_state(start), plan.step_budget)
    blocked = grid.is_blocked(grid.cell_of(model.states[-1]))
    expected = FlightPhase.SUCCEEDED if model.reached else FlightPhase.BLOCKED if blocked else FlightPhase.BUDGET_SPENT
    assert flight.phase is expected, flight.message
    assert flight.waypoints_reached == model.waypoints_reached or expected is FlightPhase.BUDGET_SPENT
    assert flight.steps == model.steps or (expected is FlightPhase.BUDGET_SPENT and stop_on_loop and flight.steps < model.steps)


@given(grids(), st.data())
def test_a_way_is_as_short_as_the_distance(grid: Grid, data: st.DataObject) -> None:
    start, goal = (data.draw(st.integers(0, grid.n_cells - 1)) for _ in range(2))
    distance = grid.distances_to(goal)[start]
    assume(distance >= 0 and not grid.is_blocked(goal) and not grid.is_blocked(start))
    way, cell = shortest_way(grid, start, goal), start
    for action in way:
        cell = grid.neighbour(cell, action)
        assert not grid.is_blocked(cell)
    assert (len(way), cell) == (distance, goal)


@given(st.binary(max_size=40), st.integers(0, 40))
def test_keys_do_not_depend_on_how_the_bytes_arrive(typed: bytes, cut: int) -> None:
    whole, rest = decode(typed)
    first, kept = decode(typed[:cut])
    second, left = decode(kept + typed[cut:])
    assert (first + second, left) == (whole, rest)
