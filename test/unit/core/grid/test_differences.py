"""In which values two grids differ."""

from __future__ import annotations

from dataclasses import replace

from advise_ros.core.grid.differences import what_differs
from advise_ros.core.grid.grid import Grid

GRID = Grid(2.0, 4, 3, (-1.0, -1.0), 5.0, (3, 11, 0))


def test_the_same_grid_differs_in_nothing() -> None:
    assert not what_differs(GRID, replace(GRID))


def test_each_value_is_named_with_both() -> None:
    other = Grid(1.0, 5, 3, (-1.0, 0.0), 4.0, (4, 0))
    assert what_differs(GRID, other) == (
        'resolution 2.0 m there and 1.0 m here, size 4 x 3 cells there and 5 x 3 cells here, '
        'origin [-1.0, -1.0] m there and [-1.0, 0.0] m here, altitude 5.0 m there and 4.0 m here, '
        'waypoints [[3, 0], [3, 2], [0, 0]] there and [[4, 0], [0, 0]] here'
    )


def test_of_many_blocked_cells_those_of_one_grid_alone_are_named() -> None:
    wide = Grid(1.0, 30, 30, (0.0, 0.0), 5.0, (899,))
    there, here = replace(wide, blocked=tuple(range(1, 20))), replace(wide, blocked=(1, 2, 40))
    assert what_differs(there, here) == (
        'blocked cells 19 ([3, 0], [4, 0], [5, 0], [6, 0], [7, 0], [8, 0], [9, 0], [10, 0], ... only) there '
        'and 3 ([10, 1] only) here'
    )
