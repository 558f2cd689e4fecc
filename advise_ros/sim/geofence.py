"""The autopilots' own fences around home: a height and a circle."""

from __future__ import annotations

import math
from typing import NamedTuple


class Geofence(NamedTuple):
    """Greatest height above home and distance from it, metres; infinite where there is none."""

    height_m: float = math.inf
    radius_m: float = math.inf

    @property
    def is_on(self) -> bool:
        """There is a limit at all."""
        return self.height_m < math.inf or self.radius_m < math.inf

    def outside(self, east_m: float, north_m: float, up_m: float) -> bool:
        """Whether a place relative to home is beyond it."""
        return up_m > self.height_m or math.hypot(east_m, north_m) > self.radius_m


def of_arducopter(values: dict[str, float]) -> Geofence:
    """FENCE_ENABLE with FENCE_TYPE's bits 1 (height) and 2 (circle)."""
    kinds = round(values['FENCE_TYPE']) if values['FENCE_ENABLE'] else 0
    return Geofence(
        values['FENCE_ALT_MAX'] if kinds & 1 else math.inf, values['FENCE_RADIUS'] if kinds & 2 else math.inf,
    )


def of_px4(values: dict[str, float]) -> Geofence:
    """GF_MAX_VER_DIST and GF_MAX_HOR_DIST; 0 is none."""
    return Geofence(values['GF_MAX_VER_DIST'] or math.inf, values['GF_MAX_HOR_DIST'] or math.inf)
