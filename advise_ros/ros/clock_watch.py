"""Whether there is a time to fly by: with use_sim_time and nobody on /clock there is none."""

from __future__ import annotations

from rclpy.node import Node

NO_CLOCK = (
    'there is no time: use_sim_time is set and nothing arrives on /clock; leave use_sim_time out, or start what '
    'publishes /clock (simulator, or mavlink_bridge with clock:=autopilot)'
)


class ClockWatch:
    """Looks at a node's clock."""

    def __init__(self, node: Node) -> None:
        self._clock = node.get_clock()
        self._simulated = bool(node.get_parameter('use_sim_time').value)

    @property
    def problem(self) -> str:
        """Why there is no time, with the remedy; '' when there is."""
        return NO_CLOCK if self._simulated and self._clock.now().nanoseconds <= 0 else ''
