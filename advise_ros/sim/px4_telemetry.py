"""What PX4 sends that ArduCopter does not."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink
from scipy.spatial.transform import Rotation

from advise_ros.mavlink import frames
from advise_ros.mavlink.current_mode import NUMBER as CURRENT_MODE
from advise_ros.mavlink.current_mode import CurrentMode
from advise_ros.sim import telemetry, truth
from advise_ros.sim.geography import ned
from advise_ros.sim.px4_vehicle import Px4Vehicle
from advise_ros.sim.satellites import PX4_ALL_WELL, PX4_STANDS_STILL

Message = Any


def estimator_status(vehicle: Px4Vehicle) -> Message:
    """How well the filter is; on the ground it stands still, and says so."""
    filter_ = vehicle.estimator
    flags = filter_.flags | (0 if vehicle.airborne else PX4_STANDS_STILL)
    off_m = 0.25 if filter_.flags == PX4_ALL_WELL else 10.0
    return mavlink.MAVLink_estimator_status_message(
        vehicle.now_ns // 1000, flags, 0.05, 0.05, 0.05, 0.02, 0.0, 0.0, off_m, 0.5,
    )


def odometry(vehicle: Px4Vehicle) -> Message:
    """The estimate, with the counter of its jumps; the velocity is in the body's frame."""
    state = vehicle.state
    position = ned(state.estimated_position_enu_m)
    return mavlink.MAVLink_odometry_message(
        vehicle.now_ns // 1000, mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_BODY_FRD, *position,
        truth.quaternion_ned(vehicle), *_velocity_frd(vehicle), 0.0, 0.0, 0.0, [math.nan] * 21, [math.nan] * 21,
        vehicle.estimator.resets, mavlink.MAV_ESTIMATOR_TYPE_AUTOPILOT, 0,
    )


def current_mode(vehicle: Px4Vehicle) -> Message:
    """The mode that is flown, and the one that was commanded: in a failsafe they differ."""
    return CurrentMode(0, int(vehicle.mode), int(vehicle.intended if vehicle.in_failsafe else vehicle.mode))


def _velocity_frd(vehicle: Px4Vehicle) -> tuple[float, float, float]:
    axes = Rotation.from_quat(vehicle.state.body['q']).as_matrix()  # The body's, as columns in ENU, (3, 3).
    forward, left, up = (float(part) for part in vehicle.state.estimated_velocity_enu_m_s @ axes)
    return frames.flu_from_frd((forward, left, up))


BUILDERS: dict[int, Callable[[Any], Message | None]] = {
    number: build for number, build in telemetry.BUILDERS.items()
    if number not in (
        mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT, mavlink.MAVLINK_MSG_ID_SIM_STATE, mavlink.MAVLINK_MSG_ID_SIMSTATE,
    )
} | {
    mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS: estimator_status,
    mavlink.MAVLINK_MSG_ID_ODOMETRY: odometry,
    CURRENT_MODE: current_mode,
    mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION: truth.hil_state_quaternion,
}
