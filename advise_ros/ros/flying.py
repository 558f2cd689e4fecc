"""What nodes that fly share: which poses are used, and how a command is published."""

from __future__ import annotations

import math

from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from advise_ros.core.mover import Pose
from advise_ros.core.seeking import Vector
from advise_ros.ros.convert import MAP_FRAME, NS, stamp_from_ns, stamp_to_ns

# A node that flies wants the newest pose, not a queue of old ones.
NEWEST_POSE = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.VOLATILE,
)
# A pose further ahead of the node's clock is of another clock.
FUTURE_LIMIT_NS = 10 * NS


def velocity_command(velocity_enu_m_s: Vector, stamp_ns: int) -> TwistStamped:
    """The command in the map frame."""
    out = TwistStamped()
    out.header.frame_id = MAP_FRAME
    out.header.stamp = stamp_from_ns(stamp_ns)
    out.twist.linear.x, out.twist.linear.y, out.twist.linear.z = velocity_enu_m_s
    return out


def between_poses_ns(clock_ns: int) -> int:
    """Stamp of a command that was not made from a pose: a nanosecond aside, so that no pose has the same."""
    return clock_ns + 1


class PoseGate:
    """Lets poses pass that may be flown by.

    Attributes:
        problem: why the last pose was refused, in one sentence; empty when it passed.
        refused: how many were.
    """

    def __init__(self) -> None:
        self.problem = ''
        self.refused = 0
        self._last_ns = 0

    def take(self, message: PoseStamped, now_ns: int) -> Pose | None:
        """The pose, or None when it is refused."""
        at = message.pose.position
        pose = Pose(stamp_to_ns(message.header.stamp), (at.x, at.y, at.z))
        self.problem = self._look(pose, message.header.frame_id, now_ns)
        if self.problem:
            self.refused += 1
            return None
        self._last_ns = pose.stamp_ns
        return pose

    def restart(self) -> None:
        """Between flights a clock may have been set back."""
        self._last_ns = 0

    def _look(self, pose: Pose, frame_id: str, now_ns: int) -> str:
        if frame_id != MAP_FRAME:
            return f"poses are in frame '{frame_id}' and not flown by; they must be in '{MAP_FRAME}' (ENU)"
        if not all(math.isfinite(value) for value in pose.position_enu_m):
            return f'a pose is not a number: {pose.position_enu_m}'
        if pose.stamp_ns <= 0:
            return 'poses have no stamp'
        if pose.stamp_ns <= self._last_ns:
            return f'a pose is {(self._last_ns - pose.stamp_ns) / NS:.3f} s older than the one before it'
        if pose.stamp_ns - now_ns > FUTURE_LIMIT_NS:
            ahead_s = (pose.stamp_ns - now_ns) / NS
            return f"poses are {ahead_s:.0f} s ahead of this node's clock; set use_sim_time alike on all nodes"
        return ''
