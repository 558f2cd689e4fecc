"""What the vehicle tells: one function a MAVLink message, and when each is due.

Messages: https://mavlink.io/en/messages/common.html and ardupilotmega.html
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.mavlink import frames
from advise_ros.sim.vehicle import Vehicle

Message = Any
NS = 1_000_000_000

FILTER_SETTLED, FILTER_STARTING = 0x33F, 0xA7  # the second one has 0x80: constant position, no aiding
PREARM_CHECK = mavlink.MAV_SYS_STATUS_PREARM_CHECK
SENSORS = (
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO | mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL | mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mavlink.MAV_SYS_STATUS_SENSOR_GPS | mavlink.MAV_SYS_STATUS_AHRS | mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
)
ORIGIN_LATITUDE_DEG, ORIGIN_LONGITUDE_DEG, ORIGIN_ALTITUDE_M = 47.397742, 8.545594, 488.0
EARTH_RADIUS_M = 6_378_137.0


def _ms(vehicle: Vehicle) -> int:
    return vehicle.now_ns // 1_000_000


def _ned(vector_enu: Any) -> tuple[float, float, float]:
    east, north, up = (float(part) for part in vector_enu)
    return frames.ned_from_enu((east, north, up))


def _angles_ned_rad(vehicle: Vehicle) -> tuple[float, float, float]:
    roll, pitch, yaw = vehicle.state.roll_pitch_yaw_rad
    roll, pitch, _ = frames.flu_from_frd((roll, pitch, 0.0))
    return roll, pitch, frames.yaw_enu_from_ned(yaw)


def heartbeat(vehicle: Vehicle) -> Message:
    flags = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if vehicle.armed else 0)
    status = mavlink.MAV_STATE_ACTIVE if vehicle.armed else mavlink.MAV_STATE_STANDBY
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_QUADROTOR, vehicle.autopilot_id, flags, int(vehicle.mode), status, 3,
    )


def sys_status(vehicle: Vehicle) -> Message:
    health = SENSORS | (PREARM_CHECK if vehicle.healthy else 0)
    battery = vehicle.battery
    return mavlink.MAVLink_sys_status_message(
        SENSORS | PREARM_CHECK, SENSORS | PREARM_CHECK, health, 0,
        round(battery.voltage_v * 1000), round(battery.current_a * 100), math.ceil(battery.remaining * 100), 0, 0, 0, 0, 0, 0,
    )


def battery_status(vehicle: Vehicle) -> Message:
    battery = vehicle.battery
    unknown = 0xFFFF
    return mavlink.MAVLink_battery_status_message(
        0, mavlink.MAV_BATTERY_FUNCTION_ALL, mavlink.MAV_BATTERY_TYPE_LIPO, 0x7FFF,
        [round(battery.voltage_v * 1000), *[unknown] * 9], round(battery.current_a * 100), -1, -1,
        math.ceil(battery.remaining * 100),
    )


def local_position_ned(vehicle: Vehicle) -> Message | None:
    if not vehicle.has_position:
        return None
    state = vehicle.state
    position, velocity = _ned(state.estimated_position_enu_m), _ned(state.estimated_velocity_enu_m_s)
    return mavlink.MAVLink_local_position_ned_message(_ms(vehicle), *position, *velocity)


def attitude(vehicle: Vehicle) -> Message:
    forward, left, up = (float(rate) for rate in vehicle.state.body['w'])
    rates = frames.flu_from_frd((forward, left, up))
    return mavlink.MAVLink_attitude_message(_ms(vehicle), *_angles_ned_rad(vehicle), *rates)


def ekf_status_report(vehicle: Vehicle) -> Message:
    flags = FILTER_SETTLED if vehicle.filter_settled else FILTER_STARTING
    return mavlink.MAVLink_ekf_status_report_message(flags, 0.05, 0.03, 0.04, 0.02, 0.0, 0.0)


def extended_sys_state(vehicle: Vehicle) -> Message:
    return mavlink.MAVLink_extended_sys_state_message(mavlink.MAV_VTOL_STATE_UNDEFINED, _landed_state(vehicle))


def _landed_state(vehicle: Vehicle) -> int:
    if not vehicle.airborne:
        return int(mavlink.MAV_LANDED_STATE_ON_GROUND)
    if vehicle.flight.takeoff_to_m is not None:
        return int(mavlink.MAV_LANDED_STATE_TAKEOFF)
    if vehicle.mode.name == 'LAND':
        return int(mavlink.MAV_LANDED_STATE_LANDING)
    return int(mavlink.MAV_LANDED_STATE_IN_AIR)


def _latitude_longitude_e7(position_enu_m: Any) -> tuple[int, int]:
    """On a plane that touches the earth at the origin."""
    east, north, _ = (float(part) for part in position_enu_m)
    latitude = ORIGIN_LATITUDE_DEG + math.degrees(north / EARTH_RADIUS_M)
    longitude = ORIGIN_LONGITUDE_DEG + math.degrees(east / (EARTH_RADIUS_M * math.cos(math.radians(ORIGIN_LATITUDE_DEG))))
    return round(latitude * 1e7), round(longitude * 1e7)


def gps_raw_int(vehicle: Vehicle) -> Message:
    if not vehicle.has_position:
        return mavlink.MAVLink_gps_raw_int_message(vehicle.now_ns // 1000, 1, 0, 0, 0, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF, 0)
    north, east, _ = _ned(vehicle.state.velocity_enu_m_s)
    course = round(math.degrees(math.atan2(east, north)) * 100) % 36000
    place = _latitude_longitude_e7(vehicle.state.position_enu_m)
    return mavlink.MAVLink_gps_raw_int_message(
        vehicle.now_ns // 1000, 6, *place, round((ORIGIN_ALTITUDE_M + vehicle.state.altitude_m) * 1000),
        121, 200, round(math.hypot(north, east) * 100), course, 10,
    )


def global_position_int(vehicle: Vehicle) -> Message | None:
    if not vehicle.has_position:
        return None
    north, east, down = (round(part * 100) for part in _ned(vehicle.state.estimated_velocity_enu_m_s))
    height = round(vehicle.state.estimated_altitude_m * 1000)
    heading = round(math.degrees(_angles_ned_rad(vehicle)[2]) * 100) % 36000
    place = _latitude_longitude_e7(vehicle.state.estimated_position_enu_m)
    return mavlink.MAVLink_global_position_int_message(
        _ms(vehicle), *place, round(ORIGIN_ALTITUDE_M * 1000) + height, height,
        north, east, down, heading,
    )


def autopilot_version(vehicle: Vehicle) -> Message:
    capabilities = (
        mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2 | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
        | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    )
    return mavlink.MAVLink_autopilot_version_message(capabilities, 0x04070000, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0)


BUILDERS: dict[int, Callable[[Vehicle], Message | None]] = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: heartbeat,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: sys_status,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: gps_raw_int,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: attitude,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: local_position_ned,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: global_position_int,
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: battery_status,
    mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: autopilot_version,
    mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT: ekf_status_report,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: extended_sys_state,
}
PX4_BUILDERS = {number: build for number, build in BUILDERS.items() if number != mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT}


class Streams:
    """Which messages are sent by themselves, and when; times are simulated nanoseconds."""

    def __init__(self) -> None:
        self._interval_ns = {int(mavlink.MAVLINK_MSG_ID_HEARTBEAT): NS}
        self._due_ns = {int(mavlink.MAVLINK_MSG_ID_HEARTBEAT): 0}

    def set(self, message_id: int, interval_ns: int, now_ns: int) -> None:
        """Send a message whenever the time is a multiple of the interval, so that stamps are evenly spaced."""
        self._interval_ns[message_id] = interval_ns
        self._due_ns[message_id] = _next_multiple(interval_ns, now_ns)

    def hurry(self, message_id: int, now_ns: int) -> None:
        """Send a message that is sent anyway with the next tick."""
        if message_id in self._due_ns:
            self._due_ns[message_id] = now_ns

    def stop(self, message_id: int) -> None:
        """Send a message no more."""
        self._interval_ns.pop(message_id, None)
        self._due_ns.pop(message_id, None)

    def due(self, now_ns: int) -> list[int]:
        """The messages whose time has come; what was missed is not made up for."""
        ready = [message_id for message_id, due_ns in self._due_ns.items() if due_ns <= now_ns]
        for message_id in ready:
            self._due_ns[message_id] = _next_multiple(self._interval_ns[message_id], now_ns)
        return ready


def _next_multiple(interval_ns: int, now_ns: int) -> int:
    return (now_ns // interval_ns + 1) * interval_ns
