"""SET_POSITION_TARGET_LOCAL_NED -> what GUIDED shall do.

Masks and frames: https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_LOCAL_NED
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from advise_ros.core.units import Vector
from advise_ros.mavlink import frames

POSITION_BITS, VELOCITY_BITS, ACCELERATION_BITS = 0x007, 0x038, 0x1C0
DOWN_BIT = 0x004
YAW_BIT, YAW_RATE_BIT = 0x400, 0x800

LOCAL_NED, LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED = 1, 7, 8, 9
BODY_FRAMES = frozenset({BODY_NED, BODY_OFFSET_NED})
OFFSET_FRAMES = frozenset({LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED})
KNOWN_FRAMES = OFFSET_FRAMES | {LOCAL_NED}

# Slower than this, the nose keeps its heading instead of turning to the travel direction.
TURNING_SPEED_M_S = 0.25


class Setpoint(NamedTuple):
    """One decoded setpoint in ENU; with neither position nor velocity the craft stops.

    Attributes:
        altitude_m: held beside a horizontal velocity, which only PX4 does.
    """

    position_enu_m: Vector | None = None
    velocity_enu_m_s: Vector | None = None
    yaw_enu_rad: float | None = None
    yaw_rate_enu_rad_s: float = 0.0
    altitude_m: float | None = None


STOP = Setpoint()


def decode(message: Any, position_enu_m: Vector, yaw_enu_rad: float) -> Setpoint:
    """The setpoint of a message; what ArduCopter does not understand makes it stop, without a word.

    Args:
        message: a decoded SET_POSITION_TARGET_LOCAL_NED.
        position_enu_m, yaw_enu_rad: where the craft is, for body and offset frames.
    """
    mask, frame = message.type_mask, message.coordinate_frame
    position = None if mask & POSITION_BITS else (message.x, message.y, message.z)
    velocity = None if mask & VELOCITY_BITS else (message.vx, message.vy, message.vz)
    yaw = None if mask & YAW_BIT else message.yaw
    yaw_rate = 0.0 if mask & YAW_RATE_BIT else message.yaw_rate
    used = (*(position or ()), *(velocity or ()), *(() if yaw is None else (yaw,)), yaw_rate)
    if frame not in KNOWN_FRAMES or not all(map(math.isfinite, used)) or (position is None and velocity is None):
        return STOP
    heading = yaw_enu_rad if frame in BODY_FRAMES else None
    velocity_enu = None if velocity is None else _to_enu(velocity, heading)
    position_enu = None if position is None else _to_enu(position, heading)
    if position_enu is not None and frame in OFFSET_FRAMES:
        position_enu = _sum(position_enu, position_enu_m)
    return Setpoint(position_enu, velocity_enu, _yaw(mask, yaw, velocity_enu), frames.yaw_rate_enu_from_ned(yaw_rate))


PX4_FRAMES = frozenset({LOCAL_NED, BODY_NED})


def decode_px4(message: Any, yaw_enu_rad: float) -> tuple[Setpoint | None, str]:
    """The setpoint as PX4 takes it, None if it counts for nothing, and what PX4 says to it.

    A velocity beside a position is added to what the position asks for. All NaN is rejected in words, a NaN among
    velocities brakes, infinity changes nothing. With neither yaw nor yaw rate the nose holds its heading.

    Args:
        message: SET_POSITION_TARGET_LOCAL_NED.
        yaw_enu_rad: the present yaw.
    """
    mask, frame = message.type_mask, message.coordinate_frame
    motion = (message.x, message.y, message.z, message.vx, message.vy, message.vz)
    asked = [value for bit, value in enumerate(motion) if not mask & 1 << bit]
    in_body = frame == BODY_NED
    if frame not in PX4_FRAMES or not asked or any(map(math.isinf, asked)) or (in_body and mask & POSITION_BITS != POSITION_BITS):
        return None, ''
    if all(map(math.isnan, asked)):
        return None, 'Offboard setpoint rejected: all values are NaN'
    north, east, down, *velocity = (0.0 if mask & 1 << bit else value for bit, value in enumerate(motion))
    velocity_ned = (0.0, 0.0, 0.0) if any(map(math.isnan, velocity)) else (velocity[0], velocity[1], velocity[2])
    velocity_enu = _to_enu(velocity_ned, yaw_enu_rad if in_body else None)
    yaw = None if mask & YAW_BIT else frames.yaw_enu_from_ned(message.yaw)
    rate = 0.0 if mask & YAW_RATE_BIT or yaw is not None else frames.yaw_rate_enu_from_ned(message.yaw_rate)
    if mask & POSITION_BITS == 0 and not any(map(math.isnan, (north, east, down))):
        return Setpoint(frames.enu_from_ned((north, east, down)), velocity_enu, yaw, rate), ''
    altitude = None if mask & DOWN_BIT or math.isnan(down) else -down
    return Setpoint(None, velocity_enu, yaw, rate, altitude), ''


def _to_enu(vector: Vector, body_yaw_enu_rad: float | None) -> Vector:
    """North-east-down, or forward-right-down when a yaw is given, to ENU."""
    if body_yaw_enu_rad is None:
        return frames.enu_from_ned(vector)
    forward, left, up = frames.flu_from_frd(vector)
    sin, cos = math.sin(body_yaw_enu_rad), math.cos(body_yaw_enu_rad)
    return forward * cos - left * sin, forward * sin + left * cos, up


def _sum(one: Vector, other: Vector) -> Vector:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]


def _yaw(mask: int, yaw_ned_rad: float | None, velocity_enu_m_s: Vector | None) -> float | None:
    """The yaw asked for; with neither yaw nor yaw rate, the direction of travel; None: hold or turn at the rate."""
    if yaw_ned_rad is not None:
        return frames.yaw_enu_from_ned(yaw_ned_rad)
    if not mask & YAW_RATE_BIT or velocity_enu_m_s is None:
        return None
    east, north, _ = velocity_enu_m_s
    return math.atan2(north, east) if math.hypot(east, north) > TURNING_SPEED_M_S else None
