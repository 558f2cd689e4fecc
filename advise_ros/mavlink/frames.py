"""NED <-> ENU and FRD <-> FLU: the only place where the package changes frames (REP-103)."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from advise_ros.core.units import Vector


def enu_from_ned(vector_ned: Vector) -> Vector:
    """North-east-down to east-north-up.

    Args:
        vector_ned: [m] or [m/s].
    """
    north, east, down = vector_ned
    return east, north, -down


def enu_rows_from_ned(rows_ned: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """As `enu_from_ned`, many at once.

    Args:
        rows_ned: (n, 3).
    """
    return rows_ned[:, [1, 0, 2]] * np.array([1.0, 1.0, -1.0])


def ned_from_enu(vector_enu: Vector) -> Vector:
    """East-north-up to north-east-down.

    Args:
        vector_enu: [m] or [m/s].
    """
    east, north, up = vector_enu
    return north, east, -up


def flu_from_frd(vector_frd: Vector) -> Vector:
    """Forward-right-down to forward-left-up; also its own inverse.

    Args:
        vector_frd: of the body.
    """
    forward, right, down = vector_frd
    return forward, -right, -down


def wrap_rad(angle_rad: float) -> float:
    """The same angle in [-pi, pi).

    Args:
        angle_rad: any.
    """
    return (angle_rad + math.pi) % (2 * math.pi) - math.pi


def yaw_enu_from_ned(yaw_ned_rad: float) -> float:
    """Heading clockwise from north to yaw counter-clockwise from east; also its own inverse.

    Args:
        yaw_ned_rad: clockwise from north.
    """
    return wrap_rad(math.pi / 2 - yaw_ned_rad)


def yaw_rate_enu_from_ned(rate_ned_rad_s: float) -> float:
    """Yaw rates have opposite signs; also its own inverse.

    Args:
        rate_ned_rad_s: clockwise seen from above.
    """
    return -rate_ned_rad_s
