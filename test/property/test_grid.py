"""Laws of the grid."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from advise_ros.core.grid.grid import Action, Grid, optimal_actions


@st.composite
def grids(draw: st.DrawFn) -> Grid:
    """Grids up to 7 x 7 whose blocked cells leave the first row and the first column free."""
    width, height = draw(st.integers(2, 7)), draw(st.integers(2, 7))
    inner = [y * width + x for y in range(1, height) for x in range(1, width)]
    blocked = draw(st.sets(st.sampled_from(inner), max_size=len(inner) // 2))
    free = [y * width + x for y in range(height) for x in range(width) if x == 0 or y == 0]
    waypoints = draw(st.lists(st.sampled_from(free), min_size=1, max_size=4))
    return Grid(
        resolution_m=draw(st.floats(0.1, 50.0)),
        width=width,
        height=height,
        origin_enu_m=(draw(st.floats(-1e4, 1e4)), draw(st.floats(-1e4, 1e4))),
        altitude_m=draw(st.floats(0.5, 100.0)),
        waypoints=tuple(cell for cell, before in zip(waypoints, [None, *waypoints], strict=False) if cell != before),
        blocked=tuple(blocked),
    )


@given(grids())
def test_cells_round_trip(grid: Grid) -> None:
    for cell in range(grid.n_cells):
        assert grid.cell(*grid.xy(cell)) == cell
        assert grid.contains(*grid.xy(cell))
        assert grid.cell_at(*grid.centre_enu_m(cell)) == cell


@given(grids())
def test_states_round_trip(grid: Grid) -> None:
    for state in range(grid.n_states):
        assert grid.state(grid.next_waypoint(state), grid.cell_of(state)) == state
        assert 0 <= grid.next_waypoint(state) < grid.n_layers


@given(grids(), st.floats(0.01, 0.99), st.floats(0.01, 0.99), st.data())
def test_every_point_within_a_cell_belongs_to_it(grid: Grid, dx: float, dy: float, data: st.DataObject) -> None:
    cell = data.draw(st.integers(0, grid.n_cells - 1))
    x, y = grid.xy(cell)
    east = grid.origin_enu_m[0] + (x + dx) * grid.resolution_m
    north = grid.origin_enu_m[1] + (y + dy) * grid.resolution_m
    assert grid.cell_at(east, north) == cell


@given(grids())
def test_moves_change_one_coordinate_by_one_and_can_be_taken_back(grid: Grid) -> None:
    for cell in range(grid.n_cells):
        for action in Action:
            there = grid.neighbour(cell, action)
            (x, y), (to_x, to_y) = grid.xy(cell), grid.xy(there)
            assert abs(x - to_x) + abs(y - to_y) == (there != cell)
            if there != cell:
                assert grid.neighbour(there, (action + 2) % 4) == cell


@given(grids())
def test_a_move_goes_on_by_one_layer_at_its_waypoint_and_else_stays_in_its_own(grid: Grid) -> None:
    for state in range(grid.n_states):
        layer = grid.next_waypoint(state)
        for action in Action:
            after = grid.successor(state, action)
            assert 0 <= after < grid.n_states
            if grid.is_terminal(state):
                assert after == state
                continue
            assert grid.cell_of(after) == grid.neighbour(grid.cell_of(state), action)
            reached = grid.cell_of(after) == grid.waypoints[layer] and layer < grid.n_layers - 1
            assert grid.next_waypoint(after) == layer + reached


@given(grids())
def test_following_optimal_actions_visits_the_waypoints_in_order_in_the_fewest_moves(grid: Grid) -> None:
    state, moves, visited = grid.start_state(), 0, []
    if grid.n_layers == 1:  # It would start on its goal.
        return
    stops = [grid.waypoints[-1], *grid.waypoints]
    fewest = sum(grid.distances_to(stop)[before] for before, stop in pairwise(stops))
    while not grid.is_terminal(state):
        before = grid.next_waypoint(state)
        state = grid.successor(state, optimal_actions(grid, state)[0])
        moves += 1
        if grid.next_waypoint(state) != before:
            visited.append(grid.cell_of(state))
    # A route whose first waypoint is its start counts as there already.
    assert visited == list(grid.waypoints[grid.next_waypoint(grid.start_state()):-1])
    assert moves == fewest


@given(grids())
def test_distances_change_by_at_most_one_between_free_neighbours(grid: Grid) -> None:
    distance = grid.distances_to(grid.waypoints[-1])
    for cell in range(grid.n_cells):
        for action in Action:
            there = grid.neighbour(cell, action)
            if distance[cell] >= 0 and distance[there] >= 0:
                assert abs(distance[cell] - distance[there]) <= 1
