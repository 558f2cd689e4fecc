"""Routes over the grid as nav_msgs/Path, for RViz, Foxglove and whatever follows paths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path

from advise_ros.config import PolicyConfig
from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.grid.grid import Grid
from advise_ros.core.planning.rollout import rollout, step_budget
from advise_ros.core.units import MAP_FRAME
from advise_ros.ros.convert import stamp_from_ns

if TYPE_CHECKING:  # What records imports nothing that learns.
    from advise_ros.core.learning.learner import Learned


def learnt_path(learned: Learned) -> Path:
    """Where the policy leads from the start, by cell centres, as far as its budget of steps; without stamps."""
    grid, start = learned.grid, learned.grid.start_state()
    states = rollout(grid, learned.greedy.tolist(), start, step_budget(grid, start, PolicyConfig.step_budget_factor)).states
    return _path(grid, states, [0] * len(states))


def demonstrated_path(demonstration: Demonstration) -> Path:
    """The moves of a demonstration, by cell centres, each with its stamp; the cell that the last move led to ends it."""
    grid, states, stamps_ns = demonstration.grid, list(demonstration.states), list(demonstration.stamps_ns)
    if states:
        states.append(grid.successor(states[-1], demonstration.actions[-1]))
        stamps_ns.append(stamps_ns[-1])
    return _path(grid, states, stamps_ns)


def stamp(path: Path, stamp_ns: int) -> None:
    """The stamp of a path that is published now, in its poses too."""
    path.header.stamp = stamp_from_ns(stamp_ns)
    for pose in path.poses:
        pose.header.stamp = path.header.stamp


def _path(grid: Grid, states: Sequence[int], stamps_ns: Sequence[int]) -> Path:
    path = Path()
    path.header.frame_id = MAP_FRAME
    path.header.stamp = stamp_from_ns(stamps_ns[-1] if stamps_ns else 0)
    for state, stamp_ns in zip(states, stamps_ns, strict=True):
        pose = PoseStamped()
        pose.header.frame_id, pose.header.stamp = MAP_FRAME, stamp_from_ns(stamp_ns)
        at = pose.pose.position
        at.x, at.y = grid.centre_enu_m(grid.cell_of(state))
        at.z = grid.altitude_m
        path.poses.append(pose)
    return path
