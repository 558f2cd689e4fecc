"""Where commands lead that were given, and those that may still be on their way to the vehicle."""

from __future__ import annotations

import math
from bisect import bisect_left

from advise_ros.core.units import Vector

# What was commanded is remembered for this long, seconds.
REMEMBERED_S = 30.0
# An autopilot that gets nothing new flies its last command on; links that pause again and again make it do so with old ones.
FLOWN_ON_S = 0.5


class FlownPath:
    """How far the commands of the last REMEMBERED_S lead."""

    def __init__(self) -> None:
        self._times_s: list[float] = []
        self._reached: list[Vector] = []
        self._velocities: list[Vector] = []
        self._last: tuple[float, Vector] | None = None
        self._answered_s: float | None = None

    def add(self, velocity_enu_m_s: Vector, now_s: float) -> None:
        """This is commanded from now on.

        Args:
            velocity_enu_m_s: (east, north, up).
            now_s: steady time.
        """
        at = self.reached(now_s)
        self._last = now_s, velocity_enu_m_s
        self._times_s.append(now_s)
        self._reached.append(at)
        self._velocities.append(velocity_enu_m_s)
        if self._times_s[0] < now_s - 2.0 * REMEMBERED_S:
            old = bisect_left(self._times_s, now_s - REMEMBERED_S)
            del self._times_s[:old], self._reached[:old], self._velocities[:old]

    def reached(self, now_s: float) -> Vector:
        """Displacement that the commands lead to until now, from where they began [m].

        Args:
            now_s: steady time.
        """
        if self._last is None:
            return (0.0, 0.0, 0.0)
        last_s, velocity = self._last
        passed_s = now_s - last_s
        east, north, up = (at + passed_s * speed for at, speed in zip(self._reached[-1], velocity, strict=True))
        return east, north, up

    def since(self, then_s: float, now_s: float) -> Vector:
        """Displacement that they led to since then [m].

        Args:
            then_s, now_s: steady times.
        """
        if self._last is None:
            return (0.0, 0.0, 0.0)
        then = bisect_left(self._times_s, then_s)
        before = self._reached[then] if then < len(self._times_s) else self._reached[-1]
        east, north, up = (now - was for now, was in zip(self.reached(now_s), before, strict=True))
        return east, north, up

    def answered(self, asked_s: float) -> None:
        """The vehicle has answered what was asked then: what was commanded before has reached it, or never will.

        Args:
            asked_s: steady time of the question.
        """
        self._answered_s = max(asked_s, self._answered_s or asked_s)

    def under_way(self, now_s: float) -> Vector:
        """Displacement by those commands that may not have reached the vehicle yet [m]; 0 while it answers nothing.

        The fastest of them counts for FLOWN_ON_S more.

        Args:
            now_s: steady time.
        """
        if self._answered_s is None or not self._velocities:
            return (0.0, 0.0, 0.0)
        flown_now = max(0, bisect_left(self._times_s, self._answered_s) - 1)
        fastest = max(self._velocities[flown_now:], key=lambda velocity: math.hypot(velocity[0], velocity[1]))
        upright = max((velocity[2] for velocity in self._velocities[flown_now:]), key=abs)
        east, north, up = self.since(self._answered_s, now_s)
        return east + FLOWN_ON_S * fastest[0], north + FLOWN_ON_S * fastest[1], up + FLOWN_ON_S * upright


def moved(position: Vector, by: Vector) -> Vector:
    """A position after a displacement.

    Args:
        position, by: (east, north, up) [m].
    """
    return position[0] + by[0], position[1] + by[1], position[2] + by[2]
