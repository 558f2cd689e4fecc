"""Whether the setpoints that an ArduPilot follows are ours.

It reports its target in POSITION_TARGET_LOCAL_NED: our velocity to 1e-6, 60 ms after it came, or what another
sender asked for since. On the way our setpoints may be lost, late or overtaken, so a target counts as ours if it is
any that we sent before, or a slower one that the autopilot made of ours: it stands when they cease (GUID_TIMEOUT)
and brakes before its own fence.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from advise_ros.core.units import ZERO, Vector
from advise_ros.mavlink.messages import Message

# Velocities are remembered for longer than a link may delay them there and their echo back: half a minute of ever
# new ones at 50 Hz. By number, not by age: what was sent before a link was lost is followed until the link is back.
REMEMBERED = 1500
# A report older than the newest by more than this is no late one: the autopilot has started anew.
OVERTAKEN_MS = 30_000
# Equal: within this, metres a second, and this share of the speed.
SAME_M_S, SAME_SHARE = 1e-3, 1e-4
# This many foreign velocities within this time are no chance; a position or an acceleration, which we never send, is enough once.
FOREIGN_REPORTS, FOREIGN_WITHIN_S = 2, 3.0
# What the autopilot has made of a setpoint may be one that came this much later than the last one seen unchanged.
MADE_OF_LATER_S = 1.0
IGNORES_PLACE, IGNORES_VELOCITY = 0x007, 0x038


class Sent(NamedTuple):
    """One velocity (NED, metres a second) and when it was sent first and last (steady)."""

    velocity_ned_m_s: Vector
    first_s: float
    last_s: float


class SetpointWatch:
    """Compares the autopilot's targets with what we sent; once ours was seen, any other is from another sender.

    Attributes:
        foreign: what setpoints of another sender ask for, in words; '' while there are none.
    """

    def __init__(self) -> None:
        self._newest_ms = -1
        self.begin_anew()

    def begin_anew(self, patience_s: float = 0.0) -> None:
        """We begin to send.

        Args:
            patience_s: how long velocities of an earlier sender may go on to be reported; a take-off leaves none.
        """
        self.foreign = ''
        self._patience_s = patience_s
        self._sent: deque[Sent] = deque(maxlen=REMEMBERED)
        self._first_s = math.inf
        self._seen_sent_s: float | None = None
        self._place_seen = self._place_left = False
        self._seen_s = -math.inf
        self._strange_s: deque[float] = deque(maxlen=FOREIGN_REPORTS)

    @property
    def seen(self) -> bool:
        """It was seen to follow us."""
        return self._seen_sent_s is not None

    def sent(self, velocity_ned_m_s: Vector, now_s: float) -> None:
        """We send this velocity.

        Args:
            velocity_ned_m_s: (north, east, down).
            now_s: steady time.
        """
        self._first_s = min(self._first_s, now_s)
        if self._sent and self._sent[-1].velocity_ned_m_s == velocity_ned_m_s:
            self._sent[-1] = self._sent[-1]._replace(last_s=now_s)
        else:
            self._sent.append(Sent(velocity_ned_m_s, now_s, now_s))

    def report(self, target: Message, now_s: float) -> None:
        """The autopilot says what it follows (POSITION_TARGET_LOCAL_NED); reports that were overtaken are no news.

        Args:
            target: the message.
            now_s: steady time of arrival.
        """
        if 0 <= self._newest_ms - int(target.time_boot_ms) < OVERTAKEN_MS:
            return
        self._newest_ms = int(target.time_boot_ms)
        velocity = float(target.vx), float(target.vy), float(target.vz)
        place = target.type_mask & IGNORES_PLACE != IGNORES_PLACE
        if not place and not target.type_mask & IGNORES_VELOCITY:
            self._compare(velocity, now_s)
        elif not place:
            self.foreign = 'an acceleration' if self.seen else ''
        elif self._place_left:
            self.foreign = 'a position'
        else:
            self._place_seen = True

    def _compare(self, velocity: Vector, now_s: float) -> None:
        ours = next((sent for sent in reversed(self._sent) if _is_same(sent.velocity_ned_m_s, velocity)), None)
        if ours is not None:
            self._seen_sent_s, self._seen_s = ours.last_s, now_s
            # A take-off stands by zero velocity before it and by a place after it; ours ends that for good.
            self._place_left = self._place_left or self._place_seen or not _is_same(velocity, ZERO)
            return
        if now_s - self._first_s < (0.0 if self.seen else self._patience_s) or self._is_made_of_ours(velocity, now_s):
            return
        self._strange_s.append(now_s)
        if len(self._strange_s) == FOREIGN_REPORTS and now_s - self._strange_s[0] <= FOREIGN_WITHIN_S:
            north, east, down = velocity
            self.foreign = f'{math.hypot(*velocity):.1f} m/s (east {east:.1f}, north {north:.1f}, up {-down:.1f})'

    def _is_made_of_ours(self, velocity: Vector, now_s: float) -> bool:
        """Zero, or one of ours without what led towards something: it lies in the ball over ours as its diameter."""
        if _is_same(velocity, ZERO):
            return True
        if self._seen_sent_s is None:
            return False
        seen_sent_s = self._seen_sent_s
        until_s = seen_sent_s + (now_s - self._seen_s) + MADE_OF_LATER_S
        return any(
            sum((of_ours - left) * left for of_ours, left in zip(sent.velocity_ned_m_s, velocity, strict=True)) >= 0.0
            for sent in self._sent if sent.last_s >= seen_sent_s and sent.first_s <= until_s
        )


def _is_same(one: Vector, other: Vector) -> bool:
    return math.dist(one, other) <= SAME_M_S + SAME_SHARE * math.hypot(*one)
