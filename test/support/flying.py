"""Messages that tests of flying nodes send."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped

from advise_ros.ros.receivers import counted
from support.graph import Graph


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


def until_heard(graph: Graph, topic: str, *nodes: str, timeout_s: float) -> None:
    """Wait until each of these nodes, by its full name, counts messages of a topic: what comes before is lost on it."""
    for node in nodes:
        def counts(array: DiagnosticArray, node: str = node) -> bool:
            return any(status.name == node and counted(status, topic) > 0 for status in array.status)

        graph.wait_for('/diagnostics', DiagnosticArray, counts, timeout_s=timeout_s)
