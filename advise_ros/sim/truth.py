"""Where the vehicle truly is, for tests: SITL's own messages, which no autopilot in the air sends."""

from __future__ import annotations

import math
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.mavlink import frames
from advise_ros.sim.geography import ORIGIN_ALTITUDE_M, latitude_longitude_e7, ned
from advise_ros.sim.vehicle import SimulatedVehicle

Message = Any


def angles_ned_rad(vehicle: SimulatedVehicle) -> tuple[float, float, float]:
    """Roll, pitch and yaw of the FRD body in NED."""
    roll, pitch, yaw = vehicle.state.roll_pitch_yaw_rad
    roll, pitch, _ = frames.flu_from_frd((roll, pitch, 0.0))
    return roll, pitch, frames.yaw_enu_from_ned(yaw)


def quaternion_ned(vehicle: SimulatedVehicle) -> tuple[float, float, float, float]:
    """The same attitude as a quaternion [w, x, y, z]."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(angle / 2), math.cos(angle / 2)) for angle in angles_ned_rad(vehicle))
    return (
        cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
    )


def sim_state(vehicle: SimulatedVehicle) -> Message:
    """ArduPilot's SIM_STATE."""
    latitude, longitude = latitude_longitude_e7(vehicle.state.position_enu_m)
    zeros = [0.0] * 6
    return mavlink.MAVLink_sim_state_message(
        *quaternion_ned(vehicle), *angles_ned_rad(vehicle), *zeros, latitude / 1e7, longitude / 1e7,
        ORIGIN_ALTITUDE_M + vehicle.state.altitude_m, 0.0, 0.0, *ned(vehicle.state.velocity_enu_m_s), latitude, longitude,
    )


def simstate(vehicle: SimulatedVehicle) -> Message:
    """ArduPilot's older SIMSTATE, without a height."""
    return mavlink.MAVLink_simstate_message(
        *angles_ned_rad(vehicle), *[0.0] * 6, *latitude_longitude_e7(vehicle.state.position_enu_m),
    )


def hil_state_quaternion(vehicle: SimulatedVehicle) -> Message:
    """PX4's ground truth."""
    velocity_cm_s = (round(part * 100) for part in ned(vehicle.state.velocity_enu_m_s))
    return mavlink.MAVLink_hil_state_quaternion_message(
        vehicle.now_ns // 1000, quaternion_ned(vehicle), 0.0, 0.0, 0.0, *latitude_longitude_e7(vehicle.state.position_enu_m),
        round((ORIGIN_ALTITUDE_M + vehicle.state.altitude_m) * 1000), *velocity_cm_s, 0, 0, 0, 0, 0,
    )
