"""/clock from an autopilot's time, and what to do about clocks of different speeds."""

from __future__ import annotations

from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.stamps import NS_PER_MS, REBOOT_MS
from advise_ros.ros import qos
from advise_ros.ros.convert import stamp_from_ns


class AutopilotClock:
    """Nanoseconds since the autopilot's first boot that was seen; after a reboot it goes on where it stood."""

    def __init__(self) -> None:
        self._boot_ms = -1
        self._before_ms = 0

    def advance_ns(self, time_boot_ms: int) -> int | None:
        """What to publish for a message of this time; None if it is no later than what was published."""
        if self._boot_ms - REBOOT_MS <= time_boot_ms <= self._boot_ms:
            return None
        if time_boot_ms < self._boot_ms:
            self._before_ms += self._boot_ms
        self._boot_ms = time_boot_ms
        return (self._before_ms + time_boot_ms) * NS_PER_MS


AUTOPILOT = 'autopilot'
TWO_CLOCKS = "the autopilot's clock and this node's run at different speeds: what compares stamps will drop messages; "
TWO_PUBLISHERS = 'somebody else publishes /clock too: stop that, or start this node with clock:=ros'


class ClockPublisher:
    """Publishes the autopilot's time on /clock when its node is to; the node then follows it as everybody else does."""

    def __init__(self, node: Node, source: str) -> None:
        self._node = node
        self._clock = AutopilotClock()
        self._publisher = None
        if source == AUTOPILOT:
            node.set_parameters([Parameter('use_sim_time', value=True)])
            self._publisher = node.create_publisher(Clock, '/clock', qos.COMMAND)

    def take(self, message: Message) -> None:
        """Publish the time of a message of the autopilot, if it has one that is news."""
        boot_ms = getattr(message, 'time_boot_ms', None)
        if self._publisher is None or boot_ms is None:
            return
        time_ns = self._clock.advance_ns(int(boot_ms))
        if time_ns is not None:
            self._publisher.publish(Clock(clock=stamp_from_ns(time_ns)))

    def problem(self, *, different_speeds: bool) -> str:
        """What is wrong with the clocks, with the remedy that helps here; '' if nothing is."""
        if self._publisher is not None:
            return TWO_PUBLISHERS if self._node.count_publishers('/clock') > 1 else ''
        if not different_speeds:
            return ''
        if self._node.count_publishers('/clock'):
            return f'{TWO_CLOCKS}set use_sim_time:=true for every node, as there is a /clock'
        return f'{TWO_CLOCKS}start this node with clock:=autopilot and every other one with use_sim_time:=true'
