"""How many ticks are due: simulated time follows steady time at a given speed. Pure: steady time comes in as a number."""

from __future__ import annotations

from advise_ros.core.units import NS

MAX_DEBT_NS = NS // 4
WINDOW_NS = 2 * NS


class Pacer:
    """Ticks due at a steady time, and the speed that was really reached.

    What the machine cannot do in time is given up after a quarter of a second, so simulated time runs
    slower than asked for, and `falls_behind` says so; it never jumps.
    """

    def __init__(self, speedup: float, step_ns: int) -> None:
        self.speedup = speedup
        self._step_ns = step_ns
        self._anchor: tuple[int, int] | None = None
        self._done = 0
        self._window: tuple[int, int] | None = None
        self.achieved: float | None = None
        self.falls_behind = False

    def due(self, steady_ns: int) -> int:
        """Ticks to do now; with speedup 0 always one more.

        Args:
            steady_ns: steady time.
        """
        self._measure(steady_ns)
        if self.speedup == 0.0:
            return 1
        if self._anchor is None:
            self._anchor = (steady_ns, self._done)
        since_ns, since_done = self._anchor
        debt = int((steady_ns - since_ns) * self.speedup) // self._step_ns + since_done - self._done
        late_ns = int((debt - 1) * self._step_ns / self.speedup)  # A tick that has just come due is not late.
        if late_ns > MAX_DEBT_NS:
            self._anchor = (steady_ns, self._done)
            return 1
        return max(0, debt)  # The one tick after a debt was given up is ahead of its time.

    def run_at(self, speedup: float, steady_ns: int) -> None:
        """Go on at another speed, from now.

        Args:
            speedup: simulated seconds a second.
            steady_ns: steady time.
        """
        if speedup != self.speedup:
            self.speedup, self.falls_behind, self._window = speedup, False, None
            self.forgive(steady_ns)

    def forgive(self, steady_ns: int) -> None:
        """Drop the ticks that are due: time stood still on purpose and does not catch up.

        Args:
            steady_ns: steady time.
        """
        self._anchor = (steady_ns, self._done)

    def did(self, ticks: int) -> None:
        """Count ticks that were done."""
        self._done += ticks

    def _measure(self, steady_ns: int) -> None:
        if self._window is None:
            self._window = (steady_ns, self._done)
        since_ns, since_done = self._window
        if steady_ns - since_ns >= WINDOW_NS:
            self.achieved = (self._done - since_done) * self._step_ns / (steady_ns - since_ns)
            self.falls_behind = self.speedup > 0.0 and self.achieved < 0.97 * self.speedup
            self._window = (steady_ns, self._done)


class Patience:
    """Whether simulated time should wait for a companion whose setpoint grows old.

    At high speed a companion's delay of some milliseconds is a long time in the simulation. Time then waits
    at `lead_s` after the newest setpoint, but never longer than `LONGEST_WAIT_NS` for the same one.
    """

    LONGEST_WAIT_NS = 3 * NS // 10

    def __init__(self, lead_s: float) -> None:
        self._lead_s = lead_s
        self._since_ns: int | None = None

    def waits(self, setpoint_age_s: float, steady_ns: int) -> bool:
        """Whether simulated time stands still now.

        Args:
            setpoint_age_s: in simulated time; 0 while no setpoint moves the vehicle.
            steady_ns: steady time.
        """
        if self._lead_s == 0.0 or setpoint_age_s < self._lead_s:
            self._since_ns = None
            return False
        if self._since_ns is None:
            self._since_ns = steady_ns
        return steady_ns - self._since_ns < self.LONGEST_WAIT_NS
