"""Brings a vehicle back inside its fence: slowly, by the shortest way, and a little further than the border."""

from __future__ import annotations

import math
from bisect import bisect_left

from advise_ros.core.fence import Braking, Fence, Vector, keep_in, outside_m, place_inside, toward, way_deeper

SPEED_M_S = 0.5
# It ends this far inside, so that what drifts or is blown about does not go out at once again.
MARGIN_M = 0.5
# At most this share of the height of the fence.
LARGEST_SHARE = 0.25
# What was commanded is remembered for this long, seconds.
REMEMBERED_S = 30.0


class FlownPath:
    """How far the commands of the last REMEMBERED_S lead."""

    def __init__(self) -> None:
        self._times_s: list[float] = []
        self._reached: list[Vector] = []
        self._last: tuple[float, Vector] | None = None

    def add(self, velocity_enu_m_s: Vector, now_s: float) -> None:
        """This is commanded from now on."""
        at = self.reached(now_s)
        self._last = now_s, velocity_enu_m_s
        self._times_s.append(now_s)
        self._reached.append(at)
        if self._times_s[0] < now_s - 2.0 * REMEMBERED_S:
            old = bisect_left(self._times_s, now_s - REMEMBERED_S)
            del self._times_s[:old], self._reached[:old]

    def reached(self, now_s: float) -> Vector:
        """Where the commands lead until now, from where they began."""
        if self._last is None:
            return (0.0, 0.0, 0.0)
        last_s, velocity = self._last
        passed_s = now_s - last_s
        east, north, up = (at + passed_s * speed for at, speed in zip(self._reached[-1], velocity, strict=True))
        return east, north, up

    def since(self, then_s: float, now_s: float) -> Vector:
        """How far they led since then, metres."""
        if self._last is None:
            return (0.0, 0.0, 0.0)
        then = bisect_left(self._times_s, then_s)
        before = self._reached[then] if then < len(self._times_s) else self._reached[-1]
        east, north, up = (now - was for now, was in zip(self.reached(now_s), before, strict=True))
        return east, north, up


class ReturnInside:
    """Decides when the vehicle is brought back, and which way.

    Attributes:
        active: it is being brought back.
        reason: how far outside it is, in words; '' while it is not brought back.
    """

    def __init__(self, fence: Fence) -> None:
        self._fence = fence
        self.active = False
        self.reason = ''

    def end(self) -> None:
        """It is not brought back any more."""
        self.active, self.reason = False, ''

    def velocity(self, position: Vector, braking: Braking, *, spare_m: float = 0.0, climbs: bool = True) -> Vector | None:
        """What brings it back, None when it is inside by the margin or was never outside.

        Args:
            position: (3,), where it will be when what was commanded has been flown.
            braking: how it can stop.
            spare_m: it counts as outside already this far inside.
            climbs: whether it is known to fly; what stands on the ground is not lifted.
        """
        margin_m = spare_m + (MARGIN_M if self.active else 0.0)
        plan, up = self._in_plan(position, braking, margin_m), self._in_height(position[2], margin_m, climbs=climbs)
        self.active = plan is not None or up != 0.0
        self.reason = self._words(position) if self.active else ''
        return None if not self.active else (*(plan or (0.0, 0.0)), up)

    def _in_plan(self, position: Vector, braking: Braking, margin_m: float) -> tuple[float, float] | None:
        at = position[:2]
        if outside_m(self._fence, at) > 0.0:
            return toward(place_inside(at, self._fence, max(margin_m, MARGIN_M)), at, self._fence, SPEED_M_S, braking)
        deeper = way_deeper(at, self._fence, margin_m) if margin_m > 0.0 else None
        if deeper is None:
            return None
        return keep_in((SPEED_M_S * deeper[0], SPEED_M_S * deeper[1]), at, self._fence, braking)

    def _in_height(self, altitude_m: float, margin_m: float, *, climbs: bool) -> float:
        low, high = self._fence.low_m, self._fence.high_m
        margin_m = min(margin_m, LARGEST_SHARE * (high - low))
        if altitude_m > high - margin_m:
            return -SPEED_M_S
        return SPEED_M_S if climbs and altitude_m < low + margin_m else 0.0

    def _words(self, position: Vector) -> str:
        beyond_m = outside_m(self._fence, position[:2])
        where = [f'{beyond_m:.1f} m in plan'] if beyond_m > 0.0 else []
        if position[2] > self._fence.high_m:
            where.append(f'{position[2] - self._fence.high_m:.1f} m too high')
        if position[2] < self._fence.low_m:
            where.append(f'{self._fence.low_m - position[2]:.1f} m too low')
        return f'outside the fence ({", ".join(where)})' if where else 'too near to the fence'


def moved(position: Vector, by: Vector) -> Vector:
    """A position after a displacement, both (3,)."""
    return position[0] + by[0], position[1] + by[1], position[2] + by[2]


def as_good(velocity: Vector, way: Vector) -> bool:
    """Whether a velocity leads along a way at least as fast as that itself."""
    return sum(a * b for a, b in zip(velocity, way, strict=True)) >= math.hypot(*way) ** 2
