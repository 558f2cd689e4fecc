"""Messages that tests of flying nodes send."""

from __future__ import annotations

from geometry_msgs.msg import PoseStamped, TwistStamped


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
