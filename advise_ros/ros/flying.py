"""What nodes that fly share: which poses are used, and how a command is published."""

from __future__ import annotations

import math
import time

from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from advise_ros.core.clock_steps import ClockSteps
from advise_ros.core.flight.leg_follower import Pose
from advise_ros.core.units import MAP_FRAME, NS, Vector
from advise_ros.ros.convert import stamp_from_ns, stamp_to_ns

# A node that flies wants the newest pose, not a queue of old ones.
NEWEST_POSE = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.VOLATILE,
)
# A pose further ahead of the node's clock is of another clock.
FUTURE_LIMIT_NS = 10 * NS
# Our clock and steady time part by this much: it was set. For a while stamps by the old and by the new time count.
CLOCK_SET_NS, CLOCK_SET_FOR_NS = NS, 5 * NS


def velocity_command(velocity_enu_m_s: Vector, stamp_ns: int) -> TwistStamped:
    """The command in the map frame.

    Args:
        velocity_enu_m_s: (east, north, up).
        stamp_ns: of its header.
    """
    out = TwistStamped()
    out.header.frame_id = MAP_FRAME
    out.header.stamp = stamp_from_ns(stamp_ns)
    out.twist.linear.x, out.twist.linear.y, out.twist.linear.z = velocity_enu_m_s
    return out


def between_poses_ns(clock_ns: int) -> int:
    """Stamp of a command that was not made from a pose: a nanosecond aside, so that no pose has the same.

    Args:
        clock_ns: the node's clock.
    """
    return clock_ns + 1


class PoseGate:
    """Lets poses pass that may be flown by.

    Stamps must grow. When our clock is set, those of the poses may go back with it, once.

    Attributes:
        problem: why the last pose was refused, in one sentence; empty when it passed.
        refused: how many were.
    """

    def __init__(self) -> None:
        self.problem = ''
        self.refused = 0
        self._last_ns = 0
        self._clock = ClockSteps(CLOCK_SET_NS, CLOCK_SET_FOR_NS)

    def take(self, message: PoseStamped, now_ns: int) -> Pose | None:
        """The pose, or None when it is refused.

        Args:
            message: that arrived.
            now_ns: the node's clock.
        """
        steady_ns = time.monotonic_ns()
        self._clock.look(now_ns, steady_ns)
        at = message.pose.position
        pose = Pose(stamp_to_ns(message.header.stamp), (at.x, at.y, at.z))
        self.problem = self._look(pose, message.header.frame_id, now_ns, clock_was_set=self._clock.was_set(steady_ns))
        if self.problem:
            self.refused += 1
            return None
        self._last_ns = pose.stamp_ns
        return pose

    def restart(self) -> None:
        """Between flights a clock may have been set back."""
        self._last_ns = 0

    def _look(self, pose: Pose, frame_id: str, now_ns: int, *, clock_was_set: bool) -> str:
        if frame_id != MAP_FRAME:
            return f"poses are in frame '{frame_id}' and not flown by; they must be in '{MAP_FRAME}' (ENU)"
        if not all(math.isfinite(value) for value in pose.position_enu_m):
            return f'a pose is not a number: {pose.position_enu_m}'
        if pose.stamp_ns <= 0:
            return 'poses have no stamp'
        behind_ns = self._last_ns - pose.stamp_ns
        if behind_ns >= 0 and not (clock_was_set and behind_ns > CLOCK_SET_NS):
            return f'a pose is {behind_ns / NS:.3f} s older than the one before it'
        if pose.stamp_ns - now_ns > FUTURE_LIMIT_NS and not clock_was_set:
            ahead_s = (pose.stamp_ns - now_ns) / NS
            return f"poses are {ahead_s:.0f} s ahead of this node's clock; set use_sim_time alike on all nodes"
        return ''
