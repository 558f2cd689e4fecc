"""Stamps in our clock for an autopilot's own times, evenly spaced and strictly increasing."""

from __future__ import annotations

NS_PER_MS = 1_000_000
DEVIATION_NS = 1_000_000_000
# Simulated time runs many times faster than messages travel: a busy moment looks like a minute.
SIMULATED_DEVIATION_NS = 60_000_000_000
# A busy moment delays a few messages; a clock that was set keeps its distance.
DEVIATIONS = 5
# Two good clocks drift a second apart in hours; fixes closer than this tell of clocks of different speeds.
CALM_NS = 300_000_000_000


class Stamper:
    """Autopilot time plus an offset to our clock that is fixed at the first message.

    The offset is fixed anew when the two clocks stay more than 1 s apart (60 s when `simulated`): the
    autopilot rebooted, or our clock was set. An offset below that is taken for 0 when `simulated`: the
    simulator gives us the same time.
    """

    def __init__(self, *, simulated: bool) -> None:
        self._simulated = simulated
        self._offset_ns: int | None = None
        self._deviations = 0
        self._last_ns = -1
        self._fixes = 0
        self._fixed_ns = 0

    @property
    def refixed(self) -> int:
        """How often the offset was fixed anew in a row; often: the clocks run at different speeds."""
        return max(0, self._fixes - 1)

    @property
    def newest_ns(self) -> int:
        """The last stamp given, -1 before the first."""
        return self._last_ns

    def stamp_ns(self, time_boot_ms: int, now_ns: int) -> int | None:
        """The stamp of a message of `time_boot_ms` that arrived at `now_ns`.

        None if it is a repetition or our clock has not begun.
        """
        if now_ns <= 0:
            return None
        if abs(now_ns - self._fixed_ns) > CALM_NS:
            self._fixes = min(self._fixes, 1)
        boot_ns = time_boot_ms * NS_PER_MS
        if self._offset_ns is None or self._deviates(boot_ns, now_ns):
            self._fix(boot_ns, now_ns)
        stamp = boot_ns + (self._offset_ns or 0)
        if stamp <= self._last_ns:
            return None
        self._last_ns = stamp
        return stamp

    def _deviates(self, boot_ns: int, now_ns: int) -> bool:
        limit_ns = SIMULATED_DEVIATION_NS if self._simulated else DEVIATION_NS
        far = abs(boot_ns + (self._offset_ns or 0) - now_ns) > limit_ns
        self._deviations = self._deviations + 1 if far else 0
        return self._deviations >= DEVIATIONS

    def _fix(self, boot_ns: int, now_ns: int) -> None:
        offset = now_ns - boot_ns
        self._offset_ns = 0 if self._simulated and abs(offset) <= SIMULATED_DEVIATION_NS else offset
        self._deviations, self._fixed_ns = 0, now_ns
        self._fixes += 1
        if boot_ns + self._offset_ns + DEVIATION_NS < self._last_ns:
            self._last_ns = -1  # Our clock was set back: stamps go back with it.
