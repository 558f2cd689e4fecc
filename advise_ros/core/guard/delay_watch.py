"""How late messages arrive, by their stamps: the smallest delay seen counts as none, and clocks may be anywhere.

The sender's clock is `offset` seconds behind our steady one. Each arrival says that the offset is at most
arrival minus stamp; the answer to a question of ours says that it is at least the question's time minus stamp.
A link that became slower and a sender that was paused (a simulation) look alike by the first; the second
distinguishes them. Without it they count as late, which is the safe side.
"""

from __future__ import annotations

from advise_ros.core.clock_steps import ClockSteps
from advise_ros.core.units import NS

# Two crystals drift apart by no more than this; a delay that grows more slowly is not seen.
DRIFT = 200e-6
# Reading two clocks, and stamps in whole milliseconds, leave this.
TOLERANCE_S = 0.01
# A stamp this far ahead of all others counts when it is borne out by as many in a row.
STEP_S, CONFIRMED = 0.1, 3
# Stamps that go back by more belong to a sender that started anew, once no newer one came for this long.
BACKWARD_S, REBOOT_S = 1.0, 1.0
# After our clock was set, stamps by the old one are still on their way for this long.
CLOCK_SET_NS = 5 * NS
# A bound by a question is of no use any more after this, because of the drift.
BOUND_KEPT_S = 300.0


class SmallestOffset:
    """The smallest offset of a sender's clock to one of ours, which drifts; a single stamp that is ahead does not count.

    Attributes:
        offset_s: None before the first.
    """

    def __init__(self) -> None:
        self.offset_s: float | None = None
        self._at_s = 0.0
        self._ahead: list[float] = []

    @property
    def is_ahead(self) -> bool:
        """The last stamp is ahead of what was borne out so far."""
        return bool(self._ahead)

    def set(self, offset_s: float, now_s: float) -> None:
        """The clock was set, or stood still.

        Args:
            offset_s: the new one.
            now_s: steady time.
        """
        self.offset_s, self._at_s, self._ahead = offset_s, now_s, []

    def seen(self, offset_s: float, now_s: float, *, settled: bool = True) -> float:
        """A stamp arrived at `now_s`; returns by how much later than the fastest, seconds.

        Args:
            offset_s: arrival minus stamp.
            now_s: steady time.
            settled: whether our clock was not set just now.
        """
        if self.offset_s is None:
            self.set(offset_s, now_s)
            return 0.0
        self.offset_s += DRIFT * (now_s - self._at_s)
        self._at_s = now_s
        if offset_s < self.offset_s - STEP_S:
            self._ahead = [*self._ahead[1 - CONFIRMED:], offset_s]
            if settled and len(self._ahead) == CONFIRMED:
                self.set(max(self._ahead), now_s)
        else:
            self._ahead = []
            self.offset_s = min(self.offset_s, offset_s)
        return max(0.0, offset_s - self.offset_s)


class DelayWatch:
    """Judges the delay of one sender's messages.

    Robust to drift, to a sender that starts anew, to clocks that are set (ours, both, or the sender's forward),
    and to simulations: one that is faster than real time makes up for a pause by itself; one that is not needs
    `bounded` or our own simulated clock (`now_ns`).

    Args:
        allowed_s: what a round trip may take at best, and is allowed for elsewhere (`vehicle_delay_s`).
    """

    def __init__(self, allowed_s: float = 0.0) -> None:
        self._allowed_s = allowed_s
        self.forget()

    def forget(self) -> None:
        """The next message is on time, whatever its stamp."""
        self._steady, self._clock = SmallestOffset(), SmallestOffset()
        self._newest_s = self._back_since_s = 0.0
        self._least_s: float | None = None
        self._least_at_s = 0.0
        self._ours = ClockSteps(round(STEP_S * NS), CLOCK_SET_NS)

    def arrived(self, stamp_ns: int, now_s: float, now_ns: int = 0) -> float:
        """A message arrives; returns by how much it is late, seconds.

        Args:
            stamp_ns: its time, by any clock of its sender that runs with real or simulated time.
            now_s: steady time.
            now_ns: our node's clock, if that may be the sender's, too; 0: it is not.
        """
        stamp_s = stamp_ns / NS
        by_clock_s = self._by_clock(stamp_s, now_s, now_ns) if now_ns > 0 else float('inf')
        if stamp_s < self._newest_s - BACKWARD_S and by_clock_s > BACKWARD_S:
            return self._behind(stamp_s, now_s)
        if stamp_s < self._newest_s - BACKWARD_S:  # The clock that both have was set back.
            self._steady.set(now_s - stamp_s, now_s)
            self._newest_s = stamp_s
        self._back_since_s = 0.0
        late_s = min(self._by_steady(now_s - stamp_s, now_s), by_clock_s)
        if not self._steady.is_ahead:
            self._newest_s = max(stamp_s, self._newest_s)
        return late_s

    def _behind(self, stamp_s: float, now_s: float) -> float:
        """Overtaken, or of a sender that started anew: which, shows when nothing newer comes."""
        self._back_since_s = self._back_since_s or now_s
        if now_s - self._back_since_s < REBOOT_S:
            return self._newest_s - stamp_s
        self.forget()
        self._newest_s = stamp_s
        return self._steady.seen(now_s - stamp_s, now_s)

    def _by_steady(self, offset_s: float, now_s: float) -> float:
        if self._least_s is not None and offset_s < self._bound(now_s) - TOLERANCE_S:
            self._least_s = None  # Its clock was set forward, or is fast.
        return self._steady.seen(offset_s, now_s) + self.unknown_s(now_s)

    def _by_clock(self, stamp_s: float, now_s: float, now_ns: int) -> float:
        """By our node's clock, which may be set, or be a simulation's that pauses with the sender."""
        steady_ns = round(now_s * NS)
        self._ours.look(now_ns, steady_ns)
        return self._clock.seen(now_ns / NS - stamp_s, now_s, settled=not self._ours.was_set(steady_ns))

    # -- what a round trip shows -------------------------------------------------------------
    def bounded(self, low_s: float, high_s: float, now_s: float) -> bool:
        """Our steady clock minus the sender's is between these: a question was answered.

        Returns:
            Whether the sender's clock stood still, so that what seemed late was not.

        Args:
            low_s: when we asked (steady), minus the sender's time when it answered.
            high_s: when the answer arrived, minus the same.
            now_s: steady time.
        """
        if self._steady.offset_s is None:
            return False
        known_s = self._bound(now_s)
        stood_still = low_s > self._steady.offset_s + TOLERANCE_S  # Asked after the last ones of before.
        went_ahead = high_s < known_s - TOLERANCE_S
        self._least_s = low_s if stood_still or went_ahead else max(known_s, low_s)
        self._least_at_s = now_s
        if stood_still or high_s < self._steady.offset_s:
            self._steady.set(high_s, now_s)
        return stood_still

    @property
    def bounded_now(self) -> bool:
        """Round trips distinguish a late link from a sender that was paused."""
        return self._least_s is not None

    def _bound(self, now_s: float) -> float:
        if self._least_s is None or now_s - self._least_at_s > BOUND_KEPT_S:
            return float('-inf')
        return self._least_s - DRIFT * (now_s - self._least_at_s)

    def unknown_s(self, now_s: float) -> float:
        """What the fastest message may have been late itself, beyond what is allowed for; 0 while nothing is known.

        Args:
            now_s: steady time.
        """
        bound_s = self._bound(now_s)
        if self._steady.offset_s is None or bound_s == float('-inf'):
            return 0.0
        return max(0.0, self._steady.offset_s - bound_s - self._allowed_s)
