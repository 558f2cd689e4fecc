"""What a node says of itself on /diagnostics."""

from __future__ import annotations

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
PERIOD_S = 1.0


class Diagnostics:
    """One DiagnosticStatus of a node, published every second (steady time) and at every change."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._status = DiagnosticStatus(name=node.get_fully_qualified_name(), level=OK, message='starting')
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._timer = node.create_timer(PERIOD_S, self._publish, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def set(self, level: bytes, message: str, values: Mapping[str, object] | None = None) -> None:
        """State the node's level and one sentence; what changes is published at once."""
        changed = (level, message) != (self._status.level, self._status.message)
        self._status.level, self._status.message = level, message
        self._status.values = [KeyValue(key=key, value=str(value)) for key, value in (values or {}).items()]
        if changed:
            self._publish()

    def _publish(self) -> None:
        array = DiagnosticArray(status=[self._status])
        array.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(array)
