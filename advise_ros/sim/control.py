"""The autopilot's motion control: acceleration- and jerk-limited reference, position and velocity loops.

As in ArduCopter, a wanted velocity is first shaped into a reference that the craft can follow, and the
reference's position is held too, so wind does not carry the craft away. All vectors are ENU.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from advise_ros.config import SimulatorConfig
from advise_ros.mavlink.frames import wrap_rad

Array = NDArray[np.float64]

GRAVITY_M_S2 = 9.81
POSITION_GAIN_1_S = 1.0
VELOCITY_GAIN_1_S = np.array([4.0, 4.0, 6.0])
INTEGRAL_GAIN_1_S2 = 0.5
SEEKING_M_S2 = 1.7
SHAPING_GAIN_1_S = 6.0
REFERENCE_LEASH_M = 2.0
FOLLOWING_S = np.array([0.15, 0.15, 0.08])
INTEGRAL_LIMIT_M_S2 = 4.0
TILT_LIMIT_RAD = math.radians(35.0)
YAW_RATE_LIMIT_RAD_S = math.radians(60.0)


@dataclass(frozen=True)
class ControlLimits:
    """What the autopilot allows itself."""

    speed_m_s: float = SimulatorConfig.max_speed_m_s
    acceleration_m_s2: float = SimulatorConfig.acceleration_m_s2
    jerk_m_s3: float = SimulatorConfig.jerk_m_s3
    climb_m_s: float = 2.5
    descent_m_s: float = 1.5
    climb_acceleration_m_s2: float = 2.5


class Target(NamedTuple):
    """What the craft shall do now; an axis with a position seeks it, otherwise the velocity holds."""

    velocity_enu_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    east_north_m: tuple[float, float] | None = None
    altitude_m: float | None = None
    yaw_enu_rad: float | None = None
    yaw_rate_rad_s: float = 0.0
    climb_acceleration_m_s2: float | None = None
    # Fastest on the way to a position; by PX4's loops on the way to anywhere.
    speed_m_s: float = math.inf
    # By PX4's loops for setpoints from outside: velocity alone holds no position. Otherwise by a shaped reference.
    cascade: bool = False


class Reference(NamedTuple):
    """What the loops hold the craft to; all vectors (3,).

    The shaped velocity and acceleration lead; the position and velocity that the craft is compared with follow them
    by the time that a tilt takes, or the loops would make it overshoot to catch up with what it cannot do.
    """

    position_enu_m: Array
    velocity_enu_m_s: Array
    shaped_enu_m_s: Array
    acceleration_enu_m_s2: Array
    integral_m_s2: Array
    yaw_enu_rad: float


def at_rest(position_enu_m: Array, yaw_enu_rad: float) -> Reference:
    """A reference that stands still.

    Args:
        position_enu_m: (3,).
        yaw_enu_rad: counter-clockwise from east.
    """
    return Reference(position_enu_m.copy(), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), yaw_enu_rad)


def limited(vector: Array, length: float) -> Array:
    """The vector, shortened to at most `length`.

    Args:
        vector: (k,).
        length: at least 0.
    """
    size = math.sqrt(float(vector @ vector))
    return vector if size <= length else vector * (length / size)


def seek(error_m: Array, speed_m_s: float, acceleration_m_s2: float) -> Array:
    """Velocity towards a point from which one can still stop in time: linear near it, square root further away.

    Args:
        error_m: (k,) from here to the point.
        speed_m_s: at most.
        acceleration_m_s2: deceleration.
    """
    distance = math.sqrt(float(error_m @ error_m))
    if distance < 1e-9:
        return np.zeros_like(error_m)
    speed = min(speed_m_s, distance * POSITION_GAIN_1_S, math.sqrt(acceleration_m_s2 * distance))
    return error_m * (speed / distance)


def shape(velocity: Array, acceleration: Array, wanted: Array, limits: tuple[float, float], step_s: float) -> tuple[Array, Array]:
    """Velocity and acceleration one step later, on the way to a wanted velocity.

    Args:
        velocity, acceleration, wanted: vectors of the same length.
        limits: acceleration and jerk.
        step_s: length of the step.
    """
    most, jerk = limits
    error = wanted - velocity
    size = math.sqrt(float(error @ error))
    gain = min(SHAPING_GAIN_1_S, math.sqrt(2.0 * jerk / max(size, 1e-9)), most / max(size, 1e-9))
    acceleration = acceleration + limited(gain * error - acceleration, jerk * step_s)
    return velocity + acceleration * step_s, acceleration


def horizontal_acceleration(target: Target, limits: ControlLimits) -> float:
    """Positions are flown to more gently than velocities are changed."""
    return limits.acceleration_m_s2 if target.east_north_m is None else min(limits.acceleration_m_s2, SEEKING_M_S2)


def wanted_velocity(target: Target, position_enu_m: Array, limits: ControlLimits) -> Array:
    """The target as a velocity within the limits, (3,).

    Args:
        target: what is flown.
        position_enu_m: (3,).
        limits: speeds and accelerations.
    """
    wanted = np.array(target.velocity_enu_m_s)
    if target.east_north_m is not None:
        error = np.array(target.east_north_m) - position_enu_m[:2]
        wanted[:2] += seek(error, min(limits.speed_m_s, target.speed_m_s), horizontal_acceleration(target, limits))
    if target.altitude_m is not None:
        climb = target.climb_acceleration_m_s2 or limits.climb_acceleration_m_s2
        wanted[2] += seek(np.array([target.altitude_m - position_enu_m[2]]), limits.climb_m_s, climb)[0]
    wanted[:2] = limited(wanted[:2], limits.speed_m_s)
    wanted[2] = min(max(wanted[2], -limits.descent_m_s), limits.climb_m_s)
    return wanted


def advance(reference: Reference, target: Target, position_enu_m: Array, limits: ControlLimits, step_s: float) -> Reference:
    """The reference one step later; it never runs further than a leash ahead of the craft.

    Args:
        reference: now.
        target: what is flown.
        position_enu_m: (3,) of the craft.
        limits: speeds and accelerations.
        step_s: simulated.
    """
    wanted = wanted_velocity(target, reference.position_enu_m, limits)
    climb = target.climb_acceleration_m_s2 or limits.climb_acceleration_m_s2
    shaped, acceleration = np.empty(3), np.empty(3)
    for axes, most in ((slice(0, 2), horizontal_acceleration(target, limits)), (slice(2, 3), climb)):
        shaped[axes], acceleration[axes] = shape(
            reference.shaped_enu_m_s[axes], reference.acceleration_enu_m_s2[axes], wanted[axes],
            (most, limits.jerk_m_s3), step_s,
        )
    velocity = reference.velocity_enu_m_s + (shaped - reference.velocity_enu_m_s) * np.minimum(step_s / FOLLOWING_S, 1.0)
    ahead = limited(reference.position_enu_m + velocity * step_s - position_enu_m, REFERENCE_LEASH_M)
    yaw = _turned(reference, target, step_s)
    return Reference(position_enu_m + ahead, velocity, shaped, acceleration, reference.integral_m_s2, yaw)


def _turned(reference: Reference, target: Target, step_s: float) -> float:
    rate = target.yaw_rate_rad_s
    if target.yaw_enu_rad is not None:
        rate = wrap_rad(target.yaw_enu_rad - reference.yaw_enu_rad) / step_s
    rate = min(max(rate, -YAW_RATE_LIMIT_RAD_S), YAW_RATE_LIMIT_RAD_S)
    return wrap_rad(reference.yaw_enu_rad + rate * step_s)


def thrust_acceleration(
    reference: Reference, position_enu_m: Array, velocity_enu_m_s: Array, step_s: float,
) -> tuple[Array, Reference]:
    """Mass-normalised thrust and the reference with its integral updated.

    Args:
        reference: what the craft follows.
        position_enu_m, velocity_enu_m_s: (3,) of the craft.
        step_s: simulated.

    Returns:
        (3,) [m/s^2], gravity included; and the reference.
    """
    velocity = reference.velocity_enu_m_s + POSITION_GAIN_1_S * (reference.position_enu_m - position_enu_m)
    error = velocity - velocity_enu_m_s
    integral = limited(reference.integral_m_s2 + INTEGRAL_GAIN_1_S2 * error * step_s, INTEGRAL_LIMIT_M_S2)
    thrust = _within_tilt(reference.acceleration_enu_m_s2 + VELOCITY_GAIN_1_S * error + integral)
    return thrust, reference._replace(integral_m_s2=integral)


# PX4's MPC_XY_P and MPC_Z_P, MPC_XY_VEL_P_ACC and MPC_Z_VEL_P_ACC, MPC_XY_VEL_I_ACC and MPC_Z_VEL_I_ACC.
CASCADE_POSITION_1_S = np.array([0.95, 0.95, 1.0])
CASCADE_VELOCITY_1_S = np.array([1.8, 1.8, 4.0])
CASCADE_INTEGRAL_1_S2 = np.array([0.4, 0.4, 2.0])


def carried(reference: Reference, target: Target, position_enu_m: Array, velocity_enu_m_s: Array, step_s: float) -> Reference:
    """A reference that goes along with the craft, for loops that need none.

    Args:
        reference: before.
        target: what is flown.
        position_enu_m, velocity_enu_m_s: (3,) of the craft.
        step_s: simulated.
    """
    return Reference(
        position_enu_m, velocity_enu_m_s, velocity_enu_m_s, np.zeros(3), reference.integral_m_s2,
        _turned(reference, target, step_s),
    )


def cascaded_acceleration(reference: Reference, target: Target, limits: ControlLimits, step_s: float) -> tuple[Array, Reference]:
    """As `thrust_acceleration`, by PX4's cascade: a distance makes a velocity, to which the wanted one is added.

    Args:
        reference: carried along with the craft.
        target: what is flown.
        limits: speeds and accelerations.
        step_s: simulated.
    """
    wanted = np.array(target.velocity_enu_m_s)
    if target.east_north_m is not None:
        wanted[:2] += CASCADE_POSITION_1_S[:2] * (np.array(target.east_north_m) - reference.position_enu_m[:2])
    if target.altitude_m is not None:
        wanted[2] += CASCADE_POSITION_1_S[2] * (target.altitude_m - reference.position_enu_m[2])
    wanted[:2] = limited(wanted[:2], min(limits.speed_m_s, target.speed_m_s))
    wanted[2] = min(max(wanted[2], -limits.descent_m_s), limits.climb_m_s)
    error = wanted - reference.velocity_enu_m_s
    integral = limited(reference.integral_m_s2 + CASCADE_INTEGRAL_1_S2 * error * step_s, INTEGRAL_LIMIT_M_S2)
    return _within_tilt(CASCADE_VELOCITY_1_S * error + integral), reference._replace(integral_m_s2=integral)


def _within_tilt(acceleration_m_s2: Array) -> Array:
    """The thrust of an acceleration, gravity included, within what tilt and rotors can do."""
    thrust = acceleration_m_s2.copy()
    thrust[2] = min(max(thrust[2] + GRAVITY_M_S2, 0.2 * GRAVITY_M_S2), 1.8 * GRAVITY_M_S2)
    thrust[:2] = limited(thrust[:2], thrust[2] * math.tan(TILT_LIMIT_RAD))
    return thrust


def attitude(thrust_m_s2: Array, yaw_enu_rad: float) -> Array:
    """Quaternion [i, j, k, w] that points the rotors along the thrust and the nose along the yaw.

    Args:
        thrust_m_s2: (3,).
        yaw_enu_rad: counter-clockwise from east.
    """
    up = thrust_m_s2 / math.sqrt(float(thrust_m_s2 @ thrust_m_s2))
    # The shortest turn from vertical, after the yaw: q = tilt * yaw keeps the nose's heading at every tilt flown here.
    tilt = np.array([-up[1], up[0], 0.0, 1.0 + up[2]])
    tilt /= math.sqrt(float(tilt @ tilt))
    sin, cos = math.sin(yaw_enu_rad / 2), math.cos(yaw_enu_rad / 2)
    i, j, _, w = tilt
    return np.array([i * cos + j * sin, j * cos - i * sin, w * sin, w * cos])
