"""The rule that turns positions into states."""

import math

import pytest

from advise_ros.core.errors import InputError
from advise_ros.core.grid.cell_tracker import CellTracker, Fix
from advise_ros.core.grid.grid import Grid

GRID = Grid(2.0, 4, 3, (0.0, 0.0), 5.0, waypoints=(3, 11, 0), blocked=(5,))
H = 0.2


def tracker(**limits: float) -> CellTracker:
    return CellTracker(GRID, H, **limits)  # type: ignore[arg-type]


def test_no_state_before_the_first_fix_inside() -> None:
    found = tracker()
    assert found.update(-1.0, 1.0) is None and found.update(math.nan, 1.0) is None
    assert found.update(1.0, 1.0) == 0


def test_a_border_counts_only_past_the_hysteresis() -> None:
    found = tracker()
    found.update(1.0, 1.0)
    assert [found.update(x, 1.0) for x in (2.1, 2.19, 2.21, 1.9, 1.81, 1.79)] == [0, 0, 1, 1, 1, 0]


def test_waypoints_move_the_state_to_the_next_layer() -> None:
    found = tracker()
    states = [found.update(x, 1.0) for x in (1.0, 3.0, 5.0, 7.0)]
    assert states == [0, 1, 2, GRID.state(1, 3)]


def test_fixes_outside_and_no_numbers_change_nothing() -> None:
    found = tracker()
    found.update(1.0, 1.0)
    assert found.update(-0.3, 1.0) == found.update(1.0, math.nan) == found.update(math.inf, 1.0) == 0
    assert found.update(-0.1, 1.0) == 0  # Outside by less than the hysteresis is the cell at the edge.


def test_terminal_states_stay() -> None:
    found = tracker()
    for x, y in ((3.0, 1.0), (3.0, 3.0), (3.0, 1.0)):
        state = found.update(x, y)
    assert state == 5 and found.finished


def test_a_diagonal_takes_the_border_that_the_line_crosses_first() -> None:
    for target, expected in (((6.6, 2.3), (1, 0)), ((6.3, 2.6), (0, 1))):
        found = tracker()
        found.step(Fix(0, 5.0, 1.0), Fix(0, 5.0, 1.0))
        step = found.step(Fix(0, 5.0, 1.0), Fix(1, *target))
        assert step is not None and step.actions == expected and not step.broken


def test_skipped_cells_are_filled_in_up_to_the_limit() -> None:
    found = tracker(max_skip_cells=2)
    found.update(1.0, 1.0)
    step = found.step(Fix(0, 1.0, 1.0), Fix(1, 7.0, 1.0))
    assert step is not None and step.actions == (1, 1, 1) and step.states == (1, 2, GRID.state(1, 3))
    short = tracker(max_skip_cells=1)
    short.update(1.0, 1.0)
    step = short.step(Fix(0, 1.0, 1.0), Fix(1, 7.0, 1.0))
    assert step is not None and step.broken and step.states == (GRID.state(1, 3),)


def test_skips_over_a_long_gap_or_through_a_blocked_cell_are_not_guessed() -> None:
    slow = tracker(max_gap_s=1.0)
    slow.update(1.0, 1.0)
    step = slow.step(Fix(0, 1.0, 1.0), Fix(1_100_000_000, 5.0, 1.0))
    assert step is not None and step.broken
    through = tracker()
    through.update(1.0, 3.0)
    step = through.step(Fix(0, 1.0, 3.0), Fix(1, 5.0, 3.0))
    assert step is not None and step.broken and step.states == (6,)


def test_a_neighbouring_cell_after_a_long_gap_is_a_move() -> None:
    slow = tracker(max_gap_s=1.0)
    slow.update(1.0, 1.0)
    step = slow.step(Fix(0, 1.0, 1.0), Fix(9_000_000_000, 3.0, 1.0))
    assert step is not None and step.actions == (1,)


@pytest.mark.parametrize('hysteresis_m', [1.0, 5.0, -0.1, math.nan])
def test_the_hysteresis_must_be_below_half_a_cell(hysteresis_m: float) -> None:
    with pytest.raises(InputError, match='below half a cell, 1 m'):
        CellTracker(GRID, hysteresis_m)
