"""Stamps from the future or the past, and clocks that are set while we fly."""

from __future__ import annotations

from advise_ros.core.clock_steps import ClockSteps
from advise_ros.core.units import NS

# Generous, as simulated clocks that run fast arrive late.
FUTURE_NS, PAST_NS, BACKWARD_NS = 5_000_000_000, 30_000_000_000, 1_000_000_000
# After our clock was set, stamps by the old one are still on their way for this long.
CLOCK_SET_NS = 2 * NS


class StampWatch:
    """Judges the stamps of one topic against our clock.

    A clock that is set (by minutes, in flight) makes no doubt: stamps by the old and by the new time both
    count for a while. Staleness is never judged by stamps, only by the steady time of arrival.

    Args:
        what: 'command' or 'pose', for the words.
        forget_s: after this long without a message any order is new.
    """

    def __init__(self, what: str, forget_s: float) -> None:
        self._what = what
        self._forget_s = forget_s
        self._newest_ns = 0
        self._seen_s = 0.0
        self._clock = ClockSteps(BACKWARD_NS, CLOCK_SET_NS)

    def doubt(self, stamp_ns: int, now_ns: int, now_s: float) -> str:
        """What is wrong with a stamp, or ''; a stamp of 0 says nothing.

        Args:
            stamp_ns: of the message.
            now_ns: our clock, 0 if it has not begun.
            now_s: steady time.
        """
        if now_s - self._seen_s > self._forget_s:
            self._newest_ns = 0
        self._seen_s = now_s
        clocks = self._clocks(now_ns, now_s)
        if stamp_ns <= 0:
            return ''
        why = self._out_of_time(stamp_ns, clocks) if now_ns > 0 else ''
        why = why or self._backward(stamp_ns, clocks)
        if not why and len(clocks) == 1:
            self._newest_ns = max(self._newest_ns, stamp_ns)
        return why

    def _clocks(self, now_ns: int, now_s: float) -> tuple[int, ...]:
        """Our clock, and for a while also what it would be had it not been set."""
        steady_ns = round(now_s * NS)
        if self._clock.look(now_ns, steady_ns):
            self._newest_ns = 0
        return (now_ns, self._clock.unset_ns(steady_ns)) if self._clock.was_set(steady_ns) else (now_ns,)

    def _out_of_time(self, stamp_ns: int, clocks: tuple[int, ...]) -> str:
        ahead_ns = [stamp_ns - clock for clock in clocks]
        if any(-PAST_NS <= ahead <= FUTURE_NS for ahead in ahead_ns):
            return ''
        nearest = min(ahead_ns, key=abs)
        when = 'in the future' if nearest > 0 else 'in the past'
        return f'its stamp is {abs(nearest) / NS:.1f} s {when}; is use_sim_time the same everywhere?'

    def _backward(self, stamp_ns: int, clocks: tuple[int, ...]) -> str:
        if stamp_ns + BACKWARD_NS >= self._newest_ns or len(clocks) > 1:
            return ''
        if self._what == 'command':
            late_s = (self._newest_ns - stamp_ns) / NS
            return f'its stamp is {late_s:.1f} s before that of another command; let one node fly at a time'
        return f'its stamp is {(self._newest_ns - stamp_ns) / NS:.1f} s before that of the last one'
