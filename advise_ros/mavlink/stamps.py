"""Stamps in our clock for an autopilot's own times: right however late they arrive, and strictly increasing."""

from __future__ import annotations

from collections import deque
from statistics import median

from advise_ros.core.units import NS
from advise_ros.mavlink.timesync import Bounds

NS_PER_MS = 1_000_000
# Simulated time runs many times faster than messages travel: a busy moment looks like a minute.
SIMULATED_DEVIATION_NS = 60 * NS
# A busy moment delays a few messages; a clock that was set keeps its distance.
DEVIATIONS = 5
# Two stamps are this far apart at least, also while a better offset is taken over.
STEP_NS = NS_PER_MS
# The ROS clock and the steady one are read one after the other: no news below this.
READING_NS = 20 * NS_PER_MS
# Set back by more than this, our clock takes the stamps with it.
SET_BACK_NS = NS
# This many messages in a row that are older than the newest by more than this, each later than the one before, come
# from an autopilot that rebooted; fewer, or in disorder, are late messages.
REBOOT_MS, REBOOT_MESSAGES = 5000, 8
# Where TIMESYNC is not answered, the smallest delay of this long counts as none.
WINDOW_S = 5.0
# The clocks run at different speeds when most of this many seconds say so; a pause is in one of them.
SECONDS, DIFFERENT = 10, 0.1


class BootOrder:
    """Which messages of an autopilot are news: repeated and overtaken ones are not, a reboot begins anew."""

    def __init__(self) -> None:
        self._newest_ms = -1
        self._older_ms: list[int] = []
        self.reboots = 0

    def is_news(self, time_boot_ms: int) -> bool:
        """Whether a message is later than those before it, or the first that shows a reboot."""
        if time_boot_ms <= self._newest_ms:
            if not self._shows_reboot(time_boot_ms):
                return False
            self.reboots += 1
        self._newest_ms = time_boot_ms
        self._older_ms.clear()
        return True

    def _shows_reboot(self, time_boot_ms: int) -> bool:
        if time_boot_ms + REBOOT_MS >= self._newest_ms:
            return False
        if self._older_ms and time_boot_ms <= self._older_ms[-1]:
            self._older_ms.clear()
        self._older_ms.append(time_boot_ms)
        return len(self._older_ms) >= REBOOT_MESSAGES


class ClockOffset:
    """Our steady clock minus the autopilot's, seconds.

    Each message bounds it by its arrival minus its time: the smallest one was delayed least. Only
    TIMESYNC can show that it has grown (the autopilot paused, or its clock is slow) and not the delay.

    Attributes:
        offset_s: None before the first message.
    """

    def __init__(self) -> None:
        self.offset_s: float | None = None
        self._bounded_s = float('-inf')
        self._latest_s = float('inf')
        self._least: deque[tuple[float, float]] = deque()
        self._history: deque[tuple[float, float]] = deque(maxlen=SECONDS + 1)

    def seen(self, boot_s: float, at_s: float) -> float:
        """Take the time of a message; returns the offset [s].

        Args:
            boot_s: the autopilot's time since boot.
            at_s: steady time of arrival.
        """
        self._latest_s = high_s = at_s - boot_s
        self._window(high_s, at_s)
        if self.offset_s is None or high_s < self.offset_s:
            self.offset_s = high_s
        elif at_s - self._bounded_s > WINDOW_S:
            self.offset_s = self._least[0][1]
        if not self._history or at_s - self._history[-1][0] >= 1.0:
            self._history.append((at_s, self.offset_s))
        return self.offset_s

    def _window(self, high_s: float, at_s: float) -> None:
        """Keep the smallest of the last WINDOW_S at the front."""
        while self._least and self._least[-1][1] >= high_s:
            self._least.pop()
        self._least.append((at_s, high_s))
        while at_s - self._least[0][0] > WINDOW_S:
            self._least.popleft()

    def bounded(self, bounds: Bounds, at_s: float) -> None:
        """A TIMESYNC answer; one of another time base (above what the last message allows) is no use.

        Args:
            bounds: of the offset.
            at_s: steady time of arrival.
        """
        if self.offset_s is None or bounds.low_s > self._latest_s:
            return
        self._bounded_s = at_s
        self.offset_s = min(max(self.offset_s, bounds.low_s), max(bounds.high_s, bounds.low_s))

    @property
    def different_speeds(self) -> bool:
        """Whether the autopilot's seconds are shorter or longer than ours; a pause or a late message is no such thing."""
        if len(self._history) <= SECONDS:
            return False
        pairs = zip(list(self._history)[:-1], list(self._history)[1:], strict=True)
        return abs(median((after[1] - before[1]) / (after[0] - before[0]) for before, after in pairs)) > DIFFERENT


class Stamper:
    """Gives messages of an autopilot their stamps in the ROS clock.

    Args:
        simulated: our clock is /clock, which runs at the autopilot's speed. Its stamps are taken as they are
            when the two are less than a minute apart: the publisher of /clock gives us the same time.

    Attributes:
        newest_ns: the last stamp given, -1 before the first.
    """

    def __init__(self, *, simulated: bool) -> None:
        self._simulated = simulated
        self._clock = ClockOffset()
        self._boot_ms = -1
        self._ours_ns: int | None = None
        self._apart: int | None = None
        self._deviations = 0
        self._rebooted = False
        self.newest_ns = -1

    @property
    def different_speeds(self) -> bool:
        """Whether stamps cannot follow both clocks; never with a clock that keeps the autopilot's time."""
        return not self._simulated and self._clock.different_speeds

    def bounded(self, bounds: Bounds, at_s: float) -> None:
        """TIMESYNC was answered.

        Args:
            bounds: of the offset.
            at_s: steady time of arrival.
        """
        self._clock.bounded(bounds, at_s)

    def stamp_ns(self, time_boot_ms: int, at_s: float, now_ns: int, now_s: float) -> int | None:
        """The stamp of a message.

        Args:
            time_boot_ms: the autopilot's time since boot in it.
            at_s: when it arrived, steady.
            now_ns, now_s: the ROS clock and the steady one now.

        Returns:
            None if it is a repetition, was overtaken, or the ROS clock has not begun.
        """
        if now_ns <= 0 or not self._follows(time_boot_ms):
            return None
        boot_ns = time_boot_ms * NS_PER_MS
        if self._simulated:
            wanted = boot_ns + self._apart_ns(boot_ns, now_ns)
        else:
            offset_ns = round(self._clock.seen(boot_ns / NS, at_s) * NS)
            wanted = boot_ns + offset_ns + self._between_ns(now_ns - round(now_s * NS))
        if wanted + SET_BACK_NS < self.newest_ns and now_ns + SET_BACK_NS < self.newest_ns:
            self.newest_ns = -1  # Our clock was set back: stamps go back with it.
        self.newest_ns = max(wanted, self.newest_ns + STEP_NS)
        return self.newest_ns

    def _follows(self, boot_ms: int) -> bool:
        """Whether a message is later than the last one; one that is much older comes after a reboot (see BootOrder)."""
        if self._boot_ms - REBOOT_MS <= boot_ms <= self._boot_ms:
            return False
        if boot_ms < self._boot_ms:
            self._clock, self._rebooted = ClockOffset(), True
        self._boot_ms = boot_ms
        return True

    def _between_ns(self, ours_ns: int) -> int:
        """The ROS clock minus the steady one, without the jitter of reading both."""
        if self._ours_ns is None or abs(ours_ns - self._ours_ns) > READING_NS:
            self._ours_ns = ours_ns
        return self._ours_ns

    def _apart_ns(self, boot_ns: int, now_ns: int) -> int:
        """/clock minus the autopilot's time: nothing, unless it is a clock of something else."""
        far = abs(boot_ns + (self._apart or 0) - now_ns) > SIMULATED_DEVIATION_NS
        self._deviations = self._deviations + 1 if far else 0
        if self._apart is None or self._rebooted or self._deviations >= DEVIATIONS:
            clock_goes_on = self._rebooted and now_ns + SIMULATED_DEVIATION_NS > self.newest_ns > boot_ns + SIMULATED_DEVIATION_NS
            same = abs(now_ns - boot_ns) <= SIMULATED_DEVIATION_NS and not clock_goes_on
            self._apart, self._deviations, self._rebooted = 0 if same else now_ns - boot_ns, 0, False
        return self._apart
