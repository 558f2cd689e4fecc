"""The MAVLink messages that the package speaks, their numbers, and the fields that must be finite.

Source: https://mavlink.io/en/messages/ardupilotmega.html (a superset of common).
"""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega

from advise_ros.core.units import Vector
from advise_ros.mavlink import current_mode
from advise_ros.mavlink.frames import ned_from_enu, yaw_rate_enu_from_ned

Message = Any  # pymavlink has no types: a decoded dialect.MAVLink_message
dialect = ardupilotmega
MAVError = dialect.MAVError
current_mode.register()

HEARTBEAT = int(dialect.MAVLINK_MSG_ID_HEARTBEAT)
SYS_STATUS = int(dialect.MAVLINK_MSG_ID_SYS_STATUS)
ATTITUDE = int(dialect.MAVLINK_MSG_ID_ATTITUDE)
LOCAL_POSITION_NED = int(dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED)
COMMAND_ACK = int(dialect.MAVLINK_MSG_ID_COMMAND_ACK)
EKF_STATUS_REPORT = int(dialect.MAVLINK_MSG_ID_EKF_STATUS_REPORT)
EXTENDED_SYS_STATE = int(dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE)
GPS_RAW_INT = int(dialect.MAVLINK_MSG_ID_GPS_RAW_INT)
ESTIMATOR_STATUS = int(dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS)
ODOMETRY = int(dialect.MAVLINK_MSG_ID_ODOMETRY)
TIMESYNC = int(dialect.MAVLINK_MSG_ID_TIMESYNC)
POSITION_TARGET_LOCAL_NED = int(dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED)
PARAM_VALUE = int(dialect.MAVLINK_MSG_ID_PARAM_VALUE)
STATUSTEXT = int(dialect.MAVLINK_MSG_ID_STATUSTEXT)
CURRENT_MODE = current_mode.NUMBER

AUTOPILOT_ARDUPILOT = int(dialect.MAV_AUTOPILOT_ARDUPILOTMEGA)
AUTOPILOT_PX4 = int(dialect.MAV_AUTOPILOT_PX4)
AUTOPILOT_NAMES = {AUTOPILOT_ARDUPILOT: 'ardupilot', AUTOPILOT_PX4: 'px4'}

# MAV_STATE of an autopilot that a failsafe has: critical, emergency, termination.
FAILSAFE_STATES = frozenset((
    int(dialect.MAV_STATE_CRITICAL), int(dialect.MAV_STATE_EMERGENCY), int(dialect.MAV_STATE_FLIGHT_TERMINATION),
))

MODE_FLAG_ARMED = int(dialect.MAV_MODE_FLAG_SAFETY_ARMED)
HEALTH_PREARM_CHECK = int(dialect.MAV_SYS_STATUS_PREARM_CHECK)

CMD_TAKEOFF = int(dialect.MAV_CMD_NAV_TAKEOFF)
CMD_SET_MODE = int(dialect.MAV_CMD_DO_SET_MODE)
CMD_ARM = int(dialect.MAV_CMD_COMPONENT_ARM_DISARM)
CMD_RUN_PREARM_CHECKS = int(dialect.MAV_CMD_RUN_PREARM_CHECKS)
CMD_MESSAGE_INTERVAL = int(dialect.MAV_CMD_SET_MESSAGE_INTERVAL)

ACK_ACCEPTED = int(dialect.MAV_RESULT_ACCEPTED)
ACK_TEMPORARILY_REJECTED = int(dialect.MAV_RESULT_TEMPORARILY_REJECTED)
ACK_DENIED = int(dialect.MAV_RESULT_DENIED)
ACK_UNSUPPORTED = int(dialect.MAV_RESULT_UNSUPPORTED)
ACK_FAILED = int(dialect.MAV_RESULT_FAILED)
ACK_IN_PROGRESS = int(dialect.MAV_RESULT_IN_PROGRESS)
ACK_NAMES = {
    ACK_TEMPORARILY_REJECTED: 'temporarily rejected', ACK_DENIED: 'denied', ACK_UNSUPPORTED: 'unsupported',
    ACK_FAILED: 'failed',
}

ON_GROUND = int(dialect.MAV_LANDED_STATE_ON_GROUND)
IN_AIR = int(dialect.MAV_LANDED_STATE_IN_AIR)
TAKING_OFF = int(dialect.MAV_LANDED_STATE_TAKEOFF)
LANDING = int(dialect.MAV_LANDED_STATE_LANDING)

# Modes, arming and setpoints mean what is said here on these only: a plane's mode 4 is not GUIDED.
MULTICOPTER_TYPES = frozenset(int(kind) for kind in (
    dialect.MAV_TYPE_QUADROTOR, dialect.MAV_TYPE_COAXIAL, dialect.MAV_TYPE_HELICOPTER, dialect.MAV_TYPE_HEXAROTOR,
    dialect.MAV_TYPE_OCTOROTOR, dialect.MAV_TYPE_TRICOPTER, dialect.MAV_TYPE_DODECAROTOR, dialect.MAV_TYPE_DECAROTOR,
))

# Largest magnitudes of what reaches a controller: metres, metres a second, radians, radians a second.
FURTHEST_M, FASTEST_M_S, LARGEST_RAD, FASTEST_RAD_S = 100_000.0, 200.0, 6.4, 100.0
_BOUNDS: dict[int, tuple[tuple[str, float], ...]] = {
    LOCAL_POSITION_NED: (
        ('x', FURTHEST_M), ('y', FURTHEST_M), ('z', FURTHEST_M),
        ('vx', FASTEST_M_S), ('vy', FASTEST_M_S), ('vz', FASTEST_M_S),
    ),
    ATTITUDE: (
        ('roll', LARGEST_RAD), ('pitch', LARGEST_RAD), ('yaw', LARGEST_RAD),
        ('rollspeed', FASTEST_RAD_S), ('pitchspeed', FASTEST_RAD_S), ('yawspeed', FASTEST_RAD_S),
    ),
}

# Velocity and yaw rate; position, acceleration and yaw are ignored. With yaw rate 0 the nose holds its heading.
MASK_VELOCITY_YAW_RATE = 0x05C7
# The bits of x, y, z and of vx, vy, vz in a mask; set: ignored. Acceleration and yaw are ignored, the yaw rate where it is 0.
_BITS_OF_PLACE, _BITS_OF_VELOCITY = (0x001, 0x002, 0x004), (0x008, 0x010, 0x020)
_MASK_OTHERS, _BIT_OF_YAW_RATE = 0x05C0, 0x800
FRAME_LOCAL_NED = int(dialect.MAV_FRAME_LOCAL_NED)


def is_multicopter(heartbeat_message: Message) -> bool:
    """Whether a HEARTBEAT is of ArduPilot or PX4 on a multicopter; cameras, gimbals and transponders name autopilots, too."""
    return heartbeat_message.autopilot in AUTOPILOT_NAMES and heartbeat_message.type in MULTICOPTER_TYPES


def is_plausible(message: Message) -> bool:
    """Whether every number that reaches a controller is finite and within what a multicopter can do.

    NaN, infinity and nonsense pass the checksum. Messages that no controller reads are not looked at.
    """
    bounds = _BOUNDS.get(message.get_msgId())
    return bounds is None or all(abs(getattr(message, name)) <= bound for name, bound in bounds)


def heartbeat(*, as_ground_station: bool = False) -> Message:
    """Ours: an onboard computer, no autopilot; or a ground station, because PX4 sends its texts to those only."""
    kind = dialect.MAV_TYPE_GCS if as_ground_station else dialect.MAV_TYPE_ONBOARD_CONTROLLER
    return dialect.MAVLink_heartbeat_message(kind, dialect.MAV_AUTOPILOT_INVALID, 0, 0, dialect.MAV_STATE_ACTIVE, 3)


def command(target: tuple[int, int], number: int, *params: float) -> Message:
    """COMMAND_LONG to (system, component); parameters that are not named are 0."""
    seven = [*params, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0][:7]
    return dialect.MAVLink_command_long_message(*target, number, 0, *seven)


def message_interval(target: tuple[int, int], message_id: int, rate_hz: float) -> Message:
    """SET_MESSAGE_INTERVAL, which wants microseconds.

    Args:
        target: system and component id.
        message_id: what is asked for.
        rate_hz: how often.
    """
    return command(target, CMD_MESSAGE_INTERVAL, float(message_id), round(1e6 / rate_hz))


def velocity_setpoint(target: tuple[int, int], time_boot_ms: int, velocity_enu_m_s: Vector, yaw_rate_rad_s: float) -> Message:
    """SET_POSITION_TARGET_LOCAL_NED with a velocity.

    Args:
        target: system and component id.
        time_boot_ms: ours.
        velocity_enu_m_s: (east, north, up).
        yaw_rate_rad_s: counter-clockwise seen from above.
    """
    return dialect.MAVLink_set_position_target_local_ned_message(
        time_boot_ms & 0xFFFFFFFF, *target, FRAME_LOCAL_NED, MASK_VELOCITY_YAW_RATE,
        0.0, 0.0, 0.0, *ned_from_enu(velocity_enu_m_s), 0.0, 0.0, 0.0,
        0.0, yaw_rate_enu_from_ned(yaw_rate_rad_s),
    )


def place_setpoint(
    target: tuple[int, int], time_boot_ms: int, place_enu_m: tuple[float | None, float | None, float | None],
    velocity_enu_m_s: Vector, yaw_rate_rad_s: float,
) -> Message:
    """SET_POSITION_TARGET_LOCAL_NED with a place where there is one, else the velocity, axis by axis in ENU.

    What is ignored is 0, never NaN; with no yaw rate PX4 holds its heading.

    Args:
        target: system and component id.
        time_boot_ms: ours.
        place_enu_m: (east, north, up); None on an axis without a place.
        velocity_enu_m_s: (east, north, up), where there is no place.
        yaw_rate_rad_s: counter-clockwise seen from above.
    """
    east, north, up = place_enu_m
    places = north, east, None if up is None else -up
    velocities = ned_from_enu(velocity_enu_m_s)
    mask = _MASK_OTHERS | (0 if yaw_rate_rad_s else _BIT_OF_YAW_RATE)
    for place, of_place, of_velocity in zip(places, _BITS_OF_PLACE, _BITS_OF_VELOCITY, strict=True):
        mask |= of_place if place is None else of_velocity
    return dialect.MAVLink_set_position_target_local_ned_message(
        time_boot_ms & 0xFFFFFFFF, *target, FRAME_LOCAL_NED, mask,
        *(place or 0.0 for place in places),
        *(velocity if place is None else 0.0 for place, velocity in zip(places, velocities, strict=True)),
        0.0, 0.0, 0.0, 0.0, yaw_rate_enu_from_ned(yaw_rate_rad_s),
    )
