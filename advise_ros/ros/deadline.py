"""A steady timer that is put off by whatever it waits for."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

# A period is set anew when it differs by more than this.
SLACK_NS = 2_000_000


class Deadline:
    """Calls `missed` once when `came` was not called for `after_s`; exact, where a periodic look comes up to a period late.

    Args:
        node: its executor calls.
        after_s: how long; steady time.
        missed: called in the executor's thread. The deadline is off then, until `came`.
    """

    def __init__(self, node: Node, after_s: float, missed: Callable[[], None]) -> None:
        self._missed, self._after_s = missed, after_s
        self._timer = node.create_timer(after_s, self._over, clock=Clock(clock_type=ClockType.STEADY_TIME), autostart=False)

    def came(self, ago_s: float = 0.0) -> None:
        """Wait anew, from now on or from a little while ago.

        Args:
            ago_s: how long ago it came.
        """
        period_ns = round(max(self._after_s - ago_s, 0.0) * 1e9)
        if abs(period_ns - self._timer.timer_period_ns) > SLACK_NS:
            self._timer.timer_period_ns = period_ns
        self._timer.reset()

    def wait(self, after_s: float) -> None:
        """Wait for this long from now on, once something comes.

        Args:
            after_s: how long; steady time.
        """
        self._after_s = after_s

    def cancel(self) -> None:
        """Nothing is waited for."""
        self._timer.cancel()

    def _over(self) -> None:
        self._timer.cancel()
        self._missed()
