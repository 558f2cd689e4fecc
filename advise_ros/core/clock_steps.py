"""Whether our own clock was set: it then parts from steady time.

Everything that judges stamps by the node's clock (guard, policy) asks here first. The stamps of a recorded stream alone are
sorted by core/demonstrations/timeline.py, an autopilot's time since boot becomes stamps in mavlink/stamps.py.
"""

from __future__ import annotations


class ClockSteps:
    """Compares a clock with steady time, each time that it is looked at.

    Args:
        step_ns: the clock was set when the difference changed by more than this since the last look.
        remembered_ns: for this long it counts as set; stamps by its old time are still on their way.
    """

    def __init__(self, step_ns: int, remembered_ns: int) -> None:
        self._step_ns, self._remembered_ns = step_ns, remembered_ns
        self._offset_ns: int | None = None
        self._before_ns = 0
        self._set_at_ns: int | None = None

    def look(self, clock_ns: int, steady_ns: int) -> bool:
        """Whether the clock was set since the last look.

        Args:
            clock_ns: what the clock shows now.
            steady_ns: steady time now.
        """
        offset_ns = clock_ns - steady_ns
        before_ns, self._offset_ns = self._offset_ns, offset_ns
        if before_ns is None or abs(offset_ns - before_ns) <= self._step_ns:
            return False
        self._before_ns, self._set_at_ns = before_ns, steady_ns
        return True

    def was_set(self, steady_ns: int) -> bool:
        """Whether it was set less than `remembered_ns` ago.

        Args:
            steady_ns: steady time now.
        """
        return self._set_at_ns is not None and steady_ns - self._set_at_ns < self._remembered_ns

    def unset_ns(self, steady_ns: int) -> int:
        """What the clock would show had it not been set the last time.

        Args:
            steady_ns: steady time now.
        """
        return steady_ns + self._before_ns
