"""Hand-made policies for tests of what flies them."""

from __future__ import annotations

from advise_msgs.msg import Policy
from advise_ros.core.grid.grid import Grid, optimal_actions
from advise_ros.ros.convert import grid_to_msg


def square(size: int = 3) -> Grid:
    """A round trip over the four corners of a square of 2 m cells, 3 m above the ground."""
    last = size - 1
    corners = ((last, 0), (last, last), (0, last), (0, 0))
    return Grid(2.0, size, size, (-1.0, -1.0), 3.0, tuple(y * size + x for x, y in corners))


def best(grid: Grid) -> tuple[int, ...]:
    """A right action for each state."""
    return tuple((optimal_actions(grid, state) or (0,))[0] for state in range(grid.n_states))


def policy_message(grid: Grid, greedy: tuple[int, ...], version: int = 1) -> Policy:
    """The message that the learner would publish, as far as the flight needs it."""
    return Policy(version=version, grid=grid_to_msg(grid), greedy=list(greedy))
