"""The grid: what it refuses, and routes counted by hand."""

from __future__ import annotations

import math
from typing import Any

import pytest

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Action, Grid, optimal_actions

ROUTE: dict[str, Any] = {
    'resolution_m': 2.0, 'width': 3, 'height': 2, 'origin_enu_m': (-1.0, -1.0), 'altitude_m': 5.0, 'waypoints': (2, 0),
}


def grid(**changed: Any) -> Grid:
    return Grid(**{**ROUTE, **changed})


@pytest.mark.parametrize(
    ('changed', 'sentence'),
    [
        ({'resolution_m': 0.0}, 'resolution is 0.0; it must be a positive number'),
        ({'resolution_m': math.nan}, 'resolution is nan'),
        ({'width': 0}, 'width is 0'),
        ({'height': -1}, 'height is -1'),
        ({'altitude_m': math.inf}, 'altitude is inf'),
        ({'origin_enu_m': (0.0, math.nan)}, 'origin is .*two finite numbers'),
        ({'waypoints': ()}, 'waypoints is empty'),
        ({'waypoints': (2, 6)}, 'waypoint 6 lies outside the 3 x 2 grid .cells 0 to 5'),
        ({'waypoints': (-1, 2)}, 'waypoint -1 lies outside'),
        ({'blocked': (9,)}, 'blocked cell 9 lies outside'),
        ({'waypoints': (2, 0), 'blocked': (2,)}, r'waypoint \[2, 0\] is a blocked cell'),
        ({'waypoints': (2, 2, 0)}, r'waypoint \[2, 0\] stands twice in a row'),
        ({'blocked': (1, 4)}, r'no way from waypoint \[2, 0\] to the final position \[0, 0\]; free some of the 2 blocked'),
        ({'width': 2000, 'height': 2000}, '8000000 states; at most 1000000 are supported, use larger cells'),
    ],
)
def test_each_mistake_is_one_sentence(changed: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence) as caught:
        grid(**changed)
    assert '\n' not in str(caught.value)


def test_states_are_numbered_layer_by_layer() -> None:
    assert grid().n_states == 12
    assert grid().state(1, 4) == 10
    assert (grid().next_waypoint(10), grid().cell_of(10)) == (1, 4)
    assert grid().goal_state == 6


def test_reaching_a_waypoint_moves_on_to_the_next_layer() -> None:
    assert grid().successor(grid().state(0, 1), Action.EAST) == grid().state(1, 2)


def test_the_last_waypoint_ends_the_flight() -> None:
    goal = grid().successor(grid().state(1, 1), Action.WEST)
    assert goal == grid().goal_state
    assert grid().is_terminal(goal)
    assert [grid().successor(goal, action) for action in Action] == [goal] * 4


def test_the_last_cell_is_no_end_in_an_earlier_layer() -> None:
    assert not grid().is_terminal(grid().state(0, 0))


def test_a_move_off_the_grid_stays() -> None:
    corner = grid().state(1, 5)
    assert grid().successor(corner, Action.NORTH) == corner
    assert grid().successor(corner, Action.EAST) == corner


def test_a_blocked_cell_ends_the_flight_in_every_layer() -> None:
    blocked = grid(blocked=(4,))
    for layer in (0, 1):
        assert blocked.is_terminal(blocked.successor(blocked.state(layer, 3), Action.EAST))


def test_borders_belong_to_the_upper_right_cell() -> None:
    assert grid().cell_at(1.0, -1.0) == 1
    assert grid().cell_at(0.999, -1.0) == 0
    assert grid().cell_at(5.0, 0.0) is None
    assert grid().cell_at(0.0, -1.001) is None


def test_a_flight_starts_in_the_final_position_unless_told() -> None:
    assert grid().start_state() == grid().state(0, 0)
    assert grid().start_state(5) == grid().state(0, 5)
    assert grid().start_state(2) == grid().state(1, 2)  # On the first waypoint already.


@pytest.mark.parametrize('cell', [-1, 6, 4])
def test_a_start_outside_or_in_a_blocked_cell_is_refused(cell: int) -> None:
    with pytest.raises(InputError, match=f'start cell {cell} is blocked or outside the 3 x 2 grid'):
        grid(blocked=(4,)).start_state(cell)


def test_distances_go_around_blocked_cells() -> None:
    assert grid(blocked=(1,)).distances_to(0) == [0, -1, 4, 1, 2, 3]


def test_optimal_actions_by_hand() -> None:
    assert optimal_actions(grid(), grid().state(0, 3)) == (Action.EAST, Action.SOUTH)
    assert optimal_actions(grid(), grid().goal_state) == ()
    assert optimal_actions(grid(blocked=(1,)), grid().state(1, 2)) == (Action.NORTH,)
