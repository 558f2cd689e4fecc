"""The plane that the simulator flies over, and where it touches the earth."""

from __future__ import annotations

import math
from typing import Any

from advise_ros.mavlink import frames

ORIGIN_LATITUDE_DEG, ORIGIN_LONGITUDE_DEG, ORIGIN_ALTITUDE_M = 47.397742, 8.545594, 488.0
EARTH_RADIUS_M = 6_378_137.0


def ned(vector_enu: Any) -> tuple[float, float, float]:
    """North, east and down of a vector (3,)."""
    east, north, up = (float(part) for part in vector_enu)
    return frames.ned_from_enu((east, north, up))


def latitude_longitude_e7(position_enu_m: Any) -> tuple[int, int]:
    """On a plane that touches the earth at the origin."""
    east, north, _ = (float(part) for part in position_enu_m)
    latitude = ORIGIN_LATITUDE_DEG + math.degrees(north / EARTH_RADIUS_M)
    longitude = ORIGIN_LONGITUDE_DEG + math.degrees(east / (EARTH_RADIUS_M * math.cos(math.radians(ORIGIN_LATITUDE_DEG))))
    return round(latitude * 1e7), round(longitude * 1e7)


def metres_from_degrees(north_deg: float, east_deg: float) -> tuple[float, float]:
    """East and north [m] of a difference in latitude and longitude.

    Args:
        north_deg, east_deg: the difference.
    """
    metres = math.radians(1.0) * EARTH_RADIUS_M
    return east_deg * metres * math.cos(math.radians(ORIGIN_LATITUDE_DEG)), north_deg * metres
