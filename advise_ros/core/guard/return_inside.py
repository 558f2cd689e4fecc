"""Brings a vehicle back inside its fence: slowly, by the shortest way, and a little further than the border."""

from __future__ import annotations

import math

from advise_ros.core.guard.fence import (
    Braking,
    Fence,
    keep_in,
    outside_m,
    place_inside,
    stopping_speed_m_s,
    toward,
    way_deeper,
)
from advise_ros.core.units import Vector

SPEED_M_S = 0.5
# It ends this far inside, so that what drifts or is blown about does not go out at once again.
MARGIN_M = 0.5
# At most this share of the height of the fence.
LARGEST_SHARE = 0.25


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
        plan, up = self._in_plan(position, braking, margin_m), self._in_height(position[2], braking, margin_m, climbs=climbs)
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

    def _in_height(self, altitude_m: float, braking: Braking, margin_m: float, *, climbs: bool) -> float:
        """So slow that it does not leave again on the other side."""
        low, high = self._fence.low_m, self._fence.high_m
        margin_m = min(margin_m, LARGEST_SHARE * (high - low))
        if altitude_m > high - margin_m:
            return -min(SPEED_M_S, stopping_speed_m_s(min(altitude_m, high) - low, *braking))
        if climbs and altitude_m < low + margin_m:
            return min(SPEED_M_S, stopping_speed_m_s(high - max(altitude_m, low), *braking))
        return 0.0

    def _words(self, position: Vector) -> str:
        beyond_m = outside_m(self._fence, position[:2])
        where = [f'{beyond_m:.1f} m in plan'] if beyond_m > 0.0 else []
        if position[2] > self._fence.high_m:
            where.append(f'{position[2] - self._fence.high_m:.1f} m too high')
        if position[2] < self._fence.low_m:
            where.append(f'{self._fence.low_m - position[2]:.1f} m too low')
        return f'outside the fence ({", ".join(where)})' if where else 'too near to the fence'


def as_good(velocity: Vector, way: Vector) -> bool:
    """Whether a velocity leads along a way at least as fast as that itself does.

    Args:
        velocity, way: (east, north, up) [m/s].
    """
    return sum(a * b for a, b in zip(velocity, way, strict=True)) >= math.hypot(*way) ** 2
