"""What a node says of itself on /diagnostics."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from advise_ros.core.units import NS
from advise_ros.ros.waits import StartWaits

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
PERIOD_S = 1.0
# Who listens discovers a new node some tenths of a second after its first words: it repeats them sooner at first.
EARLY_PERIOD_S, EARLY_TIMES = 0.2, 10
STARTING = 'starting'
# Seconds from the start of the process to the first status that is not STARTING.
AT_WORK_AFTER = 'at work after (s)'


class Meter:
    """How often something comes, and how long ago it came last; steady time."""

    def __init__(self, now_s: float) -> None:
        self._count, self._since_s, self._last_s, self._rate_hz = 0, now_s, -math.inf, 0.0

    def tick(self, now_s: float) -> None:
        """It has come now.

        Args:
            now_s: steady time.
        """
        self._count, self._last_s = self._count + 1, now_s

    def values(self, what: str, now_s: float) -> dict[str, str]:
        """Rate over the last period of a second or more, and age.

        Args:
            what: the topic, for the keys.
            now_s: steady time.
        """
        if now_s - self._since_s >= PERIOD_S:
            self._rate_hz, self._count, self._since_s = self._count / (now_s - self._since_s), 0, now_s
        age_s = now_s - self._last_s
        return {f'{what} rate (Hz)': f'{self._rate_hz:.1f}', f'{what} age (s)': f'{age_s:.2f}' if age_s < math.inf else 'never'}


class Diagnostics:
    """One DiagnosticStatus of a node, published every second (steady time), five times a second at first, and at every change.

    Attributes:
        state: of a managed node's life cycle, '' for other nodes.
        idle: why a managed node does nothing now, '' when it is active; nothing else is said meanwhile.
    """

    def __init__(self, node: Node, report: Callable[[], None] = lambda: None) -> None:
        """Begin to publish.

        Args:
            node: whose status it is.
            report: called before each regular publication; calls `set`.
        """
        self._node, self._report = node, report
        self._status = DiagnosticStatus(name=node.get_fully_qualified_name(), level=OK, message=STARTING)
        self._values: dict[str, object] = {}
        self._at_work_after: dict[str, str] = {}
        self._meters: dict[str, Meter] = {}
        self._waits = StartWaits()
        self.state = self.idle = ''
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._early = EARLY_TIMES
        self._timer = node.create_timer(0.0, self._on_timer, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def set(self, level: bytes, message: str, values: Mapping[str, object] | None = None) -> None:
        """State the node's level and one sentence; what changes is published at once."""
        if self.idle:
            level, message = max(level, WARN), self.idle
        changed = (level, message) != (self._status.level, self._status.message)
        self._status.level, self._status.message = level, message
        self._values = dict(values or {})
        if not self._at_work_after and message != STARTING:
            self._at_work_after = {AT_WORK_AFTER: f'{age_of_process_s():.2f}'}
        if changed:
            self.publish()  # Before the log, whose first line takes rclpy a tenth of a second.
            for sentence in self._waits.news(message):
                self._node.get_logger().info(sentence)

    def meter(self, *names: str) -> None:
        """Report rate and age of these topics from now on."""
        self._meters.update({name: Meter(time.monotonic()) for name in names})

    def tick(self, name: str) -> None:
        """One of them has come."""
        self._meters[name].tick(time.monotonic())

    def _on_timer(self) -> None:
        self._early -= self._early > 0
        self._timer.timer_period_ns = round((EARLY_PERIOD_S if self._early else PERIOD_S) * NS)
        self._report()
        self.publish()

    def publish(self) -> None:
        """Say it all again now, with new rates and ages."""
        now_s = time.monotonic()
        values: dict[str, object] = {'state': self.state} if self.state else {}
        values.update(self._values | self._at_work_after)
        for name, meter in self._meters.items():
            values.update(meter.values(name, now_s))
        self._status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        array = DiagnosticArray(status=[self._status])
        array.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(array)


def age_of_process_s() -> float:
    """Seconds since this process was started (Linux), by the 10 ms of its clock."""
    after_name = Path('/proc/self/stat').read_text(encoding='ascii').rpartition(')')[2].split()
    return time.clock_gettime(time.CLOCK_BOOTTIME) - int(after_name[19]) / os.sysconf('SC_CLK_TCK')
