"""Flying to a cell over free cells."""

import pytest

from advise_ros.core.errors import InputError
from advise_ros.core.flight.transit import Transit, shortest_way
from advise_ros.core.flight.velocity_law import SeekSettings
from advise_ros.core.grid.grid import Action, Grid
from support.policies import square
from support.vehicle import LazyVehicle, fly

N, E, S, W = Action
WALL = Grid(2.0, 3, 3, (-1.0, -1.0), 3.0, (2, 0), blocked=(1, 4))  # Cells [1, 0] and [1, 1] are a wall.


def test_the_way_is_shortest_turns_little_and_goes_round_what_is_blocked() -> None:
    assert shortest_way(square(3), 0, 8) == (N, N, E, E)
    assert shortest_way(square(3), 8, 0) == (S, S, W, W)
    assert shortest_way(WALL, 0, 2) == (N, N, E, E, S, S)
    assert shortest_way(WALL, 5, 5) == ()


def test_a_blocked_cell_can_be_left() -> None:
    assert shortest_way(WALL, 4, 6) == (N, W)


def test_no_way_is_said() -> None:
    closed = Grid(2.0, 3, 1, (0.0, 0.0), 3.0, (0,), blocked=(1,))
    with pytest.raises(InputError, match=r'no way over free cells from \[2, 0\] to \[0, 0\]'):
        shortest_way(closed, 2, 0)


@pytest.mark.parametrize('start', [(0.0, 0.0), (0.9, -0.9), (2.0, 2.0), (-3.0, 1.0), (4.0, 0.0)])
def test_it_arrives_at_the_centre_and_stays_there(start: tuple[float, float]) -> None:
    transit = Transit(WALL, 2, SeekSettings())
    vehicle = LazyVehicle([*start, 3.0])
    entered = set()
    for _ in fly(transit.step, vehicle, limit_s=60.0):
        entered.add(WALL.cell_at(vehicle.position[0], vehicle.position[1]))
        if transit.finished:
            break
    assert transit.finished
    assert vehicle.position[:2] == pytest.approx(WALL.centre_enu_m(2), abs=0.35)
    began_in = WALL.cell_at(*start)
    assert not (entered - {began_in}) & set(WALL.blocked)


def test_one_that_starts_in_the_goal_goes_to_its_centre_only() -> None:
    transit = Transit(square(3), 4, SeekSettings())
    vehicle = LazyVehicle([2.7, 1.4, 3.0])
    commands = []
    for _, command in fly(transit.step, vehicle, limit_s=20.0):
        commands.append(command)
        if transit.finished:
            break
    assert transit.finished
    assert commands[0][0] < 0.0 < commands[0][1]
