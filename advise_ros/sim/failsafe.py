"""What ends a flight from within: ArduCopter's ground station failsafe, and the fences of both autopilots around home."""

from __future__ import annotations

import math
from typing import NamedTuple

from advise_ros.sim.modes import Mode

GROUND_STATION_SYSTEM_ID = 255
LAND_OPTION = 5.0


class GroundStationFailsafe:
    """Watches heartbeats of system 255. It acts once a silence; the mode before is not given back."""

    def __init__(self) -> None:
        self._heartbeat_s: float | None = None
        self._acted = False

    def heartbeat(self, now_s: float) -> None:
        """A heartbeat of the ground station.

        Args:
            now_s: simulated time.
        """
        self._heartbeat_s, self._acted = now_s, False

    def wanted(self, option: float, timeout_s: float, now_s: float) -> Mode | None:
        """The mode to change to now, or None.

        Args:
            option: FS_GCS_ENABLE; 0: off, 5: land, any other: return.
            timeout_s: FS_GCS_TIMEOUT.
            now_s: simulated time.
        """
        silent = self._heartbeat_s is not None and now_s - self._heartbeat_s > timeout_s
        if option == 0.0 or self._acted or not silent:
            return None
        self._acted = True
        return Mode.LAND if option == LAND_OPTION else Mode.RTL


class Geofence(NamedTuple):
    """Greatest height above home and distance from it, metres; infinite where there is none."""

    height_m: float = math.inf
    radius_m: float = math.inf

    @property
    def is_on(self) -> bool:
        """There is a limit at all."""
        return self.height_m < math.inf or self.radius_m < math.inf

    def outside(self, east_m: float, north_m: float, up_m: float) -> bool:
        """Whether a place relative to home is beyond it.

        Args:
            east_m, north_m, up_m: from home.
        """
        return up_m > self.height_m or math.hypot(east_m, north_m) > self.radius_m


def fence_of_arducopter(values: dict[str, float]) -> Geofence:
    """FENCE_ENABLE with FENCE_TYPE's bits 1 (height) and 2 (circle).

    Args:
        values: parameters by their names.
    """
    kinds = round(values['FENCE_TYPE']) if values['FENCE_ENABLE'] else 0
    return Geofence(
        values['FENCE_ALT_MAX'] if kinds & 1 else math.inf, values['FENCE_RADIUS'] if kinds & 2 else math.inf,
    )


def fence_of_px4(values: dict[str, float]) -> Geofence:
    """GF_MAX_VER_DIST and GF_MAX_HOR_DIST; 0 is none.

    Args:
        values: parameters by their names.
    """
    return Geofence(values['GF_MAX_VER_DIST'] or math.inf, values['GF_MAX_HOR_DIST'] or math.inf)
