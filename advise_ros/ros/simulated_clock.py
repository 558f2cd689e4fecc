"""Whether a node that is to follow /clock has one to follow."""

from __future__ import annotations

from rclpy.node import Node

# Simulated time may wait for its companions; this long (steady) it has stopped.
STOPPED_S = 5.0
REMEDY = 'start what publishes it (the simulator, or mavlink_bridge with clock:=autopilot), or unset use_sim_time'


class SimulatedClock:
    """Watches the clock of a node that has use_sim_time set; of any other it finds nothing wrong."""

    def __init__(self, node: Node, *, simulated_time: bool) -> None:
        self._clock = node.get_clock()
        self._simulated_time = simulated_time
        self._seen: tuple[int, float] = (0, 0.0)

    def problem(self, now_s: float) -> str:
        """What is wrong with the clock, '' if nothing; call it once a second or more often.

        Args:
            now_s: steady time.
        """
        if not self._simulated_time:
            return ''
        now_ns = self._clock.now().nanoseconds
        if now_ns <= 0:
            return 'use_sim_time is set, but nothing arrives on /clock'
        if now_ns != self._seen[0]:
            self._seen = now_ns, now_s
        stood_s = now_s - self._seen[1]
        return f'use_sim_time is set, but /clock has stood still for {stood_s:.0f} s' if stood_s > STOPPED_S else ''


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
