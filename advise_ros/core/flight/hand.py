"""A person's stick, and the velocity that it asks for."""

from __future__ import annotations

import math

from advise_ros.core.grid.grid import ACTION_STEP
from advise_ros.core.units import ZERO, Vector

# Input that is older commands nothing: a hand that is gone, a window that is busy, a line that is cut.
FRESH_S = 0.3
# Zero velocity is sent this long after the stick is let go, then nothing: another node may fly.
HOLD_S = 1.0
# Of the way of the stick; less is a stick at rest.
DEAD_ZONE = 0.15


def along_one_axis(east: float, north: float) -> tuple[float, float]:
    """A diagonal stick as the discretiser reads its commands: the direction wanted most, the earlier one of two alike.

    Args:
        east, north: -1 to 1.

    Returns:
        (east, north), one of them 0.
    """
    towards = [step[0] * east + step[1] * north for step in ACTION_STEP]
    best = max(range(len(towards)), key=towards.__getitem__)
    return ACTION_STEP[best][0] * towards[best], ACTION_STEP[best][1] * towards[best]


class HandStick:
    """The newest position of a person's stick; without a fresh one there is zero velocity, and then no command.

    Args:
        speed_m_s, climb_m_s: at full stick.
    """

    def __init__(self, speed_m_s: float, climb_m_s: float) -> None:
        self._speed_m_s, self._climb_m_s = speed_m_s, climb_m_s
        self._velocity = ZERO
        self._at_s = self._moved_s = -math.inf
        self._shortest_s = math.inf

    def move(self, stick: Vector, sent_s: float, now_s: float) -> bool:
        """Take a position of the stick; False when it was on its way for too long, and is not used.

        Args:
            stick: (east, north, up), each -1 to 1.
            sent_s: when it was so, by the sender's clock, which may have any zero.
            now_s: steady time.
        """
        if not all(map(math.isfinite, (*stick, sent_s))):
            return False
        self._shortest_s = min(self._shortest_s, now_s - sent_s)
        if now_s - sent_s - self._shortest_s > FRESH_S:
            return False
        east, north, up = (0.0 if abs(value) < DEAD_ZONE else min(max(value, -1.0), 1.0) for value in stick)
        east, north = along_one_axis(east, north)
        self._velocity = (east * self._speed_m_s, north * self._speed_m_s, up * self._climb_m_s)
        self._at_s = now_s
        return True

    def let_go(self) -> None:
        """Zero velocity from now on, and then no command."""
        self._velocity, self._at_s = ZERO, -math.inf

    def velocity(self, now_s: float) -> Vector | None:
        """(east, north, up) in m/s in the map frame; None: no command.

        Args:
            now_s: steady time.
        """
        velocity = self._velocity if now_s - self._at_s <= FRESH_S else ZERO
        if velocity != ZERO:
            self._moved_s = now_s
        return velocity if now_s - self._moved_s <= HOLD_S else None
