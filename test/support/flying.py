"""Messages that tests of flying nodes send."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped

from support.graph import Graph

POSE_COUNTS = ('poses', 'pose')


def velocity(east: float, north: float, up: float = 0.0, frame: str = 'map') -> TwistStamped:
    """A command without a stamp; metres a second."""
    message = TwistStamped()
    message.header.frame_id = frame
    linear = message.twist.linear
    linear.x, linear.y, linear.z = east, north, up
    return message


def pose(east: float, north: float, up: float, frame: str = 'map') -> PoseStamped:
    """A level pose without a stamp; metres."""
    message = PoseStamped()
    message.header.frame_id = frame
    at = message.pose.position
    at.x, at.y, at.z = east, north, up
    message.pose.orientation.w = 1.0
    return message


def until_positions_arrive(graph: Graph, *names: str, timeout_s: float) -> None:
    """Wait until each of these nodes counts positions: what flies before that is lost on them, by best effort."""
    for name in names:
        graph.wait_for('/diagnostics', DiagnosticArray, lambda a, name=name: _counts_positions(a, name), timeout_s=timeout_s)


def _counts_positions(array: DiagnosticArray, name: str) -> bool:
    said = [pair for status in array.status if status.name.endswith(name) for pair in status.values]
    return any(pair.key.endswith(POSE_COUNTS) and pair.value.isdigit() and int(pair.value) > 0 for pair in said)
