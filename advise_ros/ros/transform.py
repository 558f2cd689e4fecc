"""map -> base_link on /tf from a vehicle's poses, where a user asks for it; off, so that nothing fights a tree that is there."""

from __future__ import annotations

from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.node import Node

from advise_ros.core.errors import InputError
from advise_ros.ros import qos


class TransformTopic:
    """Publishes each pose as a transform.

    Args:
        node: that has the poses.
        child_frame: the vehicle's frame; '' publishes nothing.

    Raises:
        InputError: tf2_msgs is not installed.
    """

    def __init__(self, node: Node, child_frame: str) -> None:
        self._child_frame = child_frame
        self._publisher = None
        if child_frame:
            try:
                from tf2_msgs.msg import TFMessage  # noqa: PLC0415  not among what is installed without ROS
            except ImportError:
                raise InputError(
                    f"parameter 'tf_child_frame' is '{child_frame}' and the package tf2_msgs is not installed; "
                    'leave it empty, or install it: sudo apt install ros-jazzy-tf2-msgs'
                ) from None
            self._kind = TFMessage
            self._publisher = node.create_publisher(TFMessage, '/tf', qos.TRANSFORMS)

    def publish(self, pose: PoseStamped) -> None:
        """The vehicle's place in its pose's frame."""
        if self._publisher is None:
            return
        transform = TransformStamped(header=pose.header, child_frame_id=self._child_frame)
        to, at = transform.transform.translation, pose.pose.position
        to.x, to.y, to.z = at.x, at.y, at.z
        transform.transform.rotation = pose.pose.orientation
        self._publisher.publish(self._kind(transforms=[transform]))
