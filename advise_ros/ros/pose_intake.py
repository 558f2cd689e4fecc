"""The newest pose that may be flown by, and why there is none."""

from __future__ import annotations

import time
from collections.abc import Mapping

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node

from advise_ros.core.flight.leg_follower import Pose
from advise_ros.core.guard.delay_watch import DelayWatch
from advise_ros.core.units import NS
from advise_ros.ros.arrival import ArrivalWatch
from advise_ros.ros.flying import PoseGate

# A pose that is refused now and then is no reason to warn; this long without one is (steady time).
WARN_AFTER_S = 1.0
# A sender whose poses are all late for this long may have a slow clock, or have paused: its flight has been given up,
# and the next one may begin.
NEW_CLOCK_S = 30.0


class PoseIntake:
    """Takes poses as they arrive.

    Args:
        timeout_s: an older pose is stale: one that came longer ago, or that was that much longer on its way than the
            fastest one seen.

    Attributes:
        pose: the newest good one, None before the first.
        waited_s: how long it had waited for its callback.
    """

    def __init__(self, node: Node, timeout_s: float) -> None:
        self._clock, self._timeout_s = node.get_clock(), timeout_s
        self._gate, self._arrivals, self._delays = PoseGate(), ArrivalWatch(), DelayWatch()
        self._late, self._in_time_s = '', time.monotonic()
        self._at_s = time.monotonic()
        self.pose: Pose | None = None
        self.waited_s = 0.0

    @property
    def refused(self) -> int:
        """How many poses were refused."""
        return self._gate.refused

    @property
    def age_s(self) -> float:
        """Of the newest pose, or since the beginning (steady time)."""
        return time.monotonic() - self._at_s

    def restart(self) -> None:
        """Between flights a clock may have been set back."""
        self._gate.restart()

    def take(self, message: PoseStamped, info: Mapping[str, int]) -> Pose | None:
        """The pose, or None when it may not be flown by; `info` is what rclpy hands to a callback beside the message."""
        waited_s = self._arrivals.waited_s(info)
        if waited_s > self._timeout_s:
            return None  # We were held up: it says where the vehicle was long ago.
        now_ns = self._clock.now().nanoseconds
        pose = self._gate.take(message, now_ns)
        if pose is None or self._is_late(pose, time.monotonic() - waited_s, now_ns - round(waited_s * NS)):
            return None
        self.pose, self.waited_s, self._at_s = pose, waited_s, time.monotonic() - waited_s
        return pose

    def _is_late(self, pose: Pose, now_s: float, now_ns: int) -> bool:
        late_s = self._delays.arrived(pose.stamp_ns, now_s, max(now_ns, 0))
        if late_s <= self._timeout_s:
            self._late, self._in_time_s = '', now_s
        elif now_s - self._in_time_s > NEW_CLOCK_S:
            self._late = ''
            self._delays.forget()
        else:
            self._late = f'poses arrive more than {self._timeout_s:g} s late'
        return bool(self._late)

    @property
    def problem(self) -> str:
        """Why the last pose may not be flown by; '' when it may."""
        return self._gate.problem or self._late

    @property
    def complaint(self) -> str:
        """What to warn of: no good pose for a while, or none at all."""
        lasting = self.pose is None or self.age_s > min(self._timeout_s, WARN_AFTER_S)
        return (self.problem or self.missing) if lasting else ''

    @property
    def missing(self) -> str:
        """Why there is no fresh pose; '' when there is one."""
        if self.pose is not None and self.age_s <= self._timeout_s:
            return ''
        return self.problem or 'no pose arrives'
