"""What the vehicle sends: one function a MAVLink message.

Messages: https://mavlink.io/en/messages/common.html and ardupilotmega.html
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.mavlink import frames
from advise_ros.sim import truth
from advise_ros.sim.geography import ORIGIN_ALTITUDE_M, latitude_longitude_e7, ned
from advise_ros.sim.setpoints import ACCELERATION_BITS, POSITION_BITS, VELOCITY_BITS, YAW_BIT, YAW_RATE_BIT, Setpoint
from advise_ros.sim.vehicle import BOOTED_AT_UNIX_S, SimulatedVehicle

Message = Any

FILTER_STARTING = 0xA7  # With 0x80: constant position, no aiding.
PREARM_CHECK = mavlink.MAV_SYS_STATUS_PREARM_CHECK
SENSORS = (
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO | mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL | mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mavlink.MAV_SYS_STATUS_SENSOR_GPS | mavlink.MAV_SYS_STATUS_AHRS | mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
)
OTHER_BITS = ACCELERATION_BITS | YAW_BIT | YAW_RATE_BIT


def heartbeat(vehicle: SimulatedVehicle) -> Message:
    flags = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if vehicle.armed else 0)
    status = mavlink.MAV_STATE_ACTIVE if vehicle.armed else mavlink.MAV_STATE_STANDBY
    status = mavlink.MAV_STATE_CRITICAL if vehicle.in_failsafe else status
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_QUADROTOR, vehicle.autopilot_id, flags, int(vehicle.mode), status, 3,
    )


def sys_status(vehicle: SimulatedVehicle) -> Message:
    health = SENSORS | (PREARM_CHECK if vehicle.healthy else 0)
    battery = vehicle.battery
    return mavlink.MAVLink_sys_status_message(
        SENSORS | PREARM_CHECK, SENSORS | PREARM_CHECK, health, 0,
        round(battery.voltage_v * 1000), round(battery.current_a * 100), math.ceil(battery.remaining * 100), 0, 0, 0, 0, 0, 0,
    )


def battery_status(vehicle: SimulatedVehicle) -> Message:
    battery = vehicle.battery
    unknown = 0xFFFF
    return mavlink.MAVLink_battery_status_message(
        0, mavlink.MAV_BATTERY_FUNCTION_ALL, mavlink.MAV_BATTERY_TYPE_LIPO, 0x7FFF,
        [round(battery.voltage_v * 1000), *[unknown] * 9], round(battery.current_a * 100), -1, -1,
        math.ceil(battery.remaining * 100),
    )


def local_position_ned(vehicle: SimulatedVehicle) -> Message | None:
    if not vehicle.has_position:
        return None
    state = vehicle.state
    position, velocity = ned(state.estimated_position_enu_m), ned(state.estimated_velocity_enu_m_s)
    return mavlink.MAVLink_local_position_ned_message(vehicle.stamp_ms, *position, *velocity)


def attitude(vehicle: SimulatedVehicle) -> Message:
    forward, left, up = (float(rate) for rate in vehicle.state.body['w'])
    rates = frames.flu_from_frd((forward, left, up))
    return mavlink.MAVLink_attitude_message(vehicle.stamp_ms, *truth.angles_ned_rad(vehicle), *rates)


def ekf_status_report(vehicle: SimulatedVehicle) -> Message:
    flags = vehicle.filter.flags if vehicle.filter_settled else FILTER_STARTING
    return mavlink.MAVLink_ekf_status_report_message(flags, 0.05, vehicle.filter.variance, 0.04, 0.02, 0.0, 0.0)


def extended_sys_state(vehicle: SimulatedVehicle) -> Message:
    return mavlink.MAVLink_extended_sys_state_message(mavlink.MAV_VTOL_STATE_UNDEFINED, _landed_state(vehicle))


def _landed_state(vehicle: SimulatedVehicle) -> int:
    if not vehicle.airborne:
        return int(mavlink.MAV_LANDED_STATE_ON_GROUND)
    if vehicle.flight.takeoff_to_m is not None:
        return int(mavlink.MAV_LANDED_STATE_TAKEOFF)
    if vehicle.mode.name == 'LAND':
        return int(mavlink.MAV_LANDED_STATE_LANDING)
    return int(mavlink.MAV_LANDED_STATE_IN_AIR)


def gps_raw_int(vehicle: SimulatedVehicle) -> Message:
    if not vehicle.satellites or not vehicle.sees_satellites:
        return mavlink.MAVLink_gps_raw_int_message(vehicle.now_ns // 1000, 1, 0, 0, 0, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF, 0)
    north, east, _ = ned(vehicle.state.velocity_enu_m_s)
    course = round(math.degrees(math.atan2(east, north)) * 100) % 36000
    place = latitude_longitude_e7(vehicle.state.position_enu_m + np.array([*vehicle.satellite_shift_m, 0.0]))
    return mavlink.MAVLink_gps_raw_int_message(
        vehicle.now_ns // 1000, 6, *place, round((ORIGIN_ALTITUDE_M + vehicle.state.altitude_m) * 1000),
        121, 200, round(math.hypot(north, east) * 100), course, 10,
    )


def global_position_int(vehicle: SimulatedVehicle) -> Message | None:
    if not vehicle.has_position:
        return None
    north, east, down = (round(part * 100) for part in ned(vehicle.state.estimated_velocity_enu_m_s))
    height = round(vehicle.state.estimated_altitude_m * 1000)
    heading = round(math.degrees(truth.angles_ned_rad(vehicle)[2]) * 100) % 36000
    place = latitude_longitude_e7(vehicle.state.estimated_position_enu_m)
    return mavlink.MAVLink_global_position_int_message(
        vehicle.stamp_ms, *place, round(ORIGIN_ALTITUDE_M * 1000) + height, height,
        north, east, down, heading,
    )


def system_time(vehicle: SimulatedVehicle) -> Message:
    """Its unix time goes as fast as the simulated one."""
    return mavlink.MAVLink_system_time_message(BOOTED_AT_UNIX_S * 1_000_000 + vehicle.now_ns // 1000, vehicle.stamp_ms)


def position_target(vehicle: SimulatedVehicle) -> Message | None:
    """The setpoint that is being flown, of any sender; only in the mode that takes setpoints."""
    if vehicle.mode.name not in ('GUIDED', 'OFFBOARD'):
        return None
    setpoint = vehicle.flight.shown(vehicle.now_s) or Setpoint(velocity_enu_m_s=(0.0, 0.0, 0.0))
    position, velocity = setpoint.position_enu_m, setpoint.velocity_enu_m_s
    mask = (POSITION_BITS if position is None else 0) | (VELOCITY_BITS if velocity is None else 0) | OTHER_BITS
    return mavlink.MAVLink_position_target_local_ned_message(
        vehicle.stamp_ms, mavlink.MAV_FRAME_LOCAL_NED, mask, *ned(position or (0.0, 0.0, 0.0)),
        *ned(velocity or (0.0, 0.0, 0.0)), 0.0, 0.0, 0.0, 0.0, 0.0,
    )


def autopilot_version(vehicle: SimulatedVehicle) -> Message:
    capabilities = (
        mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2 | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
        | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    )
    return mavlink.MAVLink_autopilot_version_message(capabilities, 0x04070000, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0)


BUILDERS: dict[int, Callable[[SimulatedVehicle], Message | None]] = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: heartbeat,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: sys_status,
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: system_time,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: gps_raw_int,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: attitude,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: local_position_ned,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: global_position_int,
    mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: position_target,
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: battery_status,
    mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: autopilot_version,
    mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT: ekf_status_report,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: extended_sys_state,
    mavlink.MAVLINK_MSG_ID_SIM_STATE: truth.sim_state,
    mavlink.MAVLINK_MSG_ID_SIMSTATE: truth.simstate,
}


class AddressedTimesync(mavlink.MAVLink_timesync_message):  # type: ignore[misc]
    """An answer for one peer; ids are extension fields, which the checksum's seed does not cover."""

    def __init__(self, tc1: int, ts1: int, target_system: int, target_component: int) -> None:
        super().__init__(tc1, ts1)
        self._target = target_system, target_component

    def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
        """The frame, as pymavlink makes those of its own messages."""
        payload = struct.pack('<qqBB', self.tc1, self.ts1, *self._target)
        return bytes(self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1))
