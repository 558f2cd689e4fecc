"""PX4's own messages (px4_msgs, by its uXRCE-DDS client) in the words of MAVLink, and back.

The state machine, the guard and the estimator's judge know an autopilot by MAVLink; so they fly PX4 by its topics, too,
and nothing of them exists twice. NED and FRD stay as they are: `vehicle.py` changes frames.
"""

from __future__ import annotations

import math
import re
from typing import Any

from advise_ros.core.errors import InputError
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.current_mode import CurrentMode
from advise_ros.mavlink.messages import Message, dialect

SCHEME = 'px4_dds:'
PREFIX = re.compile(r'/?([A-Za-z_][A-Za-z0-9_]*/)*')
US_PER_MS, US_PER_S = 1000, 1_000_000
ARMED = 2
# VehicleStatus.nav_state -> custom_mode of a heartbeat (main << 16 | sub << 24).
CUSTOM_MODES = {
    0: 0x00010000, 1: 0x00020000, 2: 0x00030000, 3: 0x04040000, 4: 0x03040000, 5: 0x05040000, 6: 0x02030000, 10: 0x00050000,
    12: 0x06040000, 14: 0x00060000, 15: 0x00070000, 17: 0x02040000, 18: 0x06040000, 19: 0x08040000, 20: 0x09040000,
    21: 0x01030000, 22: 0x0A040000,
}
# Any other nav_state: no mode of ours, and shown by its number.
OTHER_MODE = 0x000B0000
OFFBOARD, TAKING_OFF, LANDING = 14, 17, 18
# What the attitude and the count of resets come from may lag behind the position by this; PX4 sends both at 50 Hz or more.
TOGETHER_US = 500_000
# A rate that PX4 keeps not quite is kept all the same.
NEARLY = 0.9
# Each of the topics that a flight takes comes once a second or more; what is older counts as not said.
KEPT_S = 6.0
# Of ESTIMATOR_STATUS: attitude, velocity in plan and in height, position in plan (relative, absolute) and in height.
ATTITUDE, VELOCITY, CLIMB, PLAN, PLAN_ABSOLUTE, HEIGHT = 0x001, 0x002, 0x004, 0x008, 0x010, 0x020
_PLACE, _SPEED, _NO_YAW, _NO_YAW_RATE = (0x001, 0x002, 0x004), (0x008, 0x010, 0x020), 0x400, 0x800


def topic(name: str, kind: type) -> str:
    """A topic's name as PX4 gives it: with the version of its message, if that has one.

    Args:
        name: without its version.
        kind: its message.
    """
    version = getattr(kind, 'MESSAGE_VERSION', 0)
    return f'{name}_v{version}' if version else name


def prefix_of(url: str) -> str:
    """What the topics begin with.

    Args:
        url: px4_dds: or px4_dds:NAMESPACE, as PX4's client was started with.

    Raises:
        InputError: it is no namespace.
    """
    given = url.removeprefix(SCHEME)
    prefix = f'{given.rstrip("/")}/' if given.strip('/') else ''
    if not PREFIX.fullmatch(prefix):
        raise InputError(f"url is '{url}'; behind {SCHEME} it takes the namespace of PX4's topics, as px4_dds:/px4_1, or nothing")
    return prefix


class TopicReader:
    """Makes MAVLink messages of what PX4 publishes; each method takes a message of px4_msgs and when it arrived.

    Nothing is passed on before the first VehicleStatus, which names the vehicle. A position counts only while attitude and
    the count of resets (VehicleOdometry) come with it, and readiness only while all that a flight takes comes.

    Args:
        rate_hz: positions passed on a second, of the 50 and more that PX4 sends.

    Attributes:
        nav_state: the mode that PX4 flies, by its own number; None before the first VehicleStatus.
    """

    def __init__(self, rate_hz: float) -> None:
        self._period_us = NEARLY * US_PER_S / rate_hz
        self._ids: tuple[int, int] | None = None
        self.nav_state: int | None = None
        self._landed_s = self._local_s = self._odometry_s = -math.inf
        self._attitude: tuple[int, Any] = (0, None)
        self._resets = 0
        self._position_us = 0
        self._battery = (0xFFFF, -1, -1)

    def vehicle_status(self, status: Any, at_s: float) -> list[Message]:
        """Mode, arming, failsafe and readiness."""
        self._ids, self.nav_state = (int(status.system_id), int(status.component_id)), int(status.nav_state)
        armed = status.arming_state == ARMED
        state = dialect.MAV_STATE_ACTIVE if armed else dialect.MAV_STATE_STANDBY
        flags = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (mav.MODE_FLAG_ARMED if armed else 0)
        mode, intended = (_custom_mode(number) for number in (status.nav_state, status.nav_state_user_intention))
        out = [
            dialect.MAVLink_heartbeat_message(
                int(status.system_type), mav.AUTOPILOT_PX4, flags, mode,
                dialect.MAV_STATE_CRITICAL if status.failsafe else state, 3),
            CurrentMode(0, mode, intended),
        ]
        if at_s - min(self._landed_s, self._local_s, self._odometry_s) <= KEPT_S:
            health = mav.HEALTH_PREARM_CHECK if status.pre_flight_checks_pass else 0
            voltage, current, remaining = self._battery
            out.append(dialect.MAVLink_sys_status_message(
                health, health, health, 0, voltage, current, remaining, 0, 0, 0, 0, 0, 0))
        return self._signed(out)

    def vehicle_land_detected(self, landed: Any, at_s: float) -> list[Message]:
        """Whether it is on the ground."""
        self._landed_s = at_s
        flying = {TAKING_OFF: mav.TAKING_OFF, LANDING: mav.LANDING}.get(self.nav_state or 0, mav.IN_AIR)
        return self._signed([dialect.MAVLink_extended_sys_state_message(0, mav.ON_GROUND if landed.landed else flying)])

    def vehicle_odometry(self, odometry: Any, at_s: float) -> list[Message]:
        """Attitude and resets of the estimator; the position is that of VehicleLocalPosition, which says whether it holds."""
        self._odometry_s, self._attitude = at_s, (int(odometry.timestamp), odometry.q)
        if odometry.reset_counter == self._resets:
            return []
        self._resets = int(odometry.reset_counter)
        return self._signed([self._odometry(int(odometry.timestamp))])

    def vehicle_local_position(self, local: Any, at_s: float) -> list[Message]:
        """Position and velocity, if PX4 stands by them."""
        self._local_s, now_us = at_s, int(local.timestamp)
        if 0 <= now_us - self._position_us < self._period_us:
            return []
        self._position_us = now_us
        flags = _estimator_flags(local)
        out = [
            dialect.MAVLink_estimator_status_message(now_us, flags, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, local.eph, local.epv),
            self._odometry(now_us),
        ]
        attitude_us, quaternion = self._attitude
        valid = local.xy_valid and local.z_valid and local.v_xy_valid and local.v_z_valid
        if valid and quaternion is not None and abs(now_us - attitude_us) <= TOGETHER_US:
            ms = now_us // US_PER_MS
            out.append(dialect.MAVLink_attitude_message(ms, *_roll_pitch_yaw(quaternion), 0.0, 0.0, 0.0))
            out.append(dialect.MAVLink_local_position_ned_message(ms, *(
                float(number) for number in (local.x, local.y, local.z, local.vx, local.vy, local.vz))))
        return self._signed(out)

    def battery_status(self, battery: Any, at_s: float) -> list[Message]:
        """Kept for the next status; of several batteries the last one."""
        known = battery.connected
        self._battery = (
            _whole(battery.voltage_v, 1000.0, 0xFFFE) if known else 0xFFFF,
            _whole(battery.current_a, 100.0, 0x7FFF) if known else -1,
            _whole(battery.remaining, 100.0, 100) if known else -1,
        )
        return []

    def vehicle_command_ack(self, ack: Any, at_s: float) -> list[Message]:
        """PX4's answer to a command; MAV_RESULT has the same numbers."""
        return self._signed([dialect.MAVLink_command_ack_message(
            int(ack.command), int(ack.result), 0, 0, int(ack.target_system), int(ack.target_component))])

    def _odometry(self, now_us: int) -> Message:
        unknown = [math.nan] * 21
        return dialect.MAVLink_odometry_message(
            now_us, mav.FRAME_LOCAL_NED, dialect.MAV_FRAME_BODY_FRD, *[math.nan] * 3, [math.nan] * 4, *[math.nan] * 6,
            unknown, unknown, self._resets, 0, 0)

    def _signed(self, messages: list[Message]) -> list[Message]:
        """From the vehicle's own ids; nothing while these are unknown."""
        if self._ids is None:
            return []
        for message in messages:
            message._header.srcSystem, message._header.srcComponent = self._ids
        return messages


def _custom_mode(nav_state: int) -> int:
    return CUSTOM_MODES.get(int(nav_state), OTHER_MODE | int(nav_state) << 24)


def _estimator_flags(local: Any) -> int:
    """What dead reckoning carries on is no position to fly by."""
    held = local.xy_valid and not local.dead_reckoning
    valid = (
        (local.v_xy_valid, VELOCITY), (local.v_z_valid, CLIMB), (local.z_valid, HEIGHT), (held, PLAN),
        (held and local.xy_global, PLAN_ABSOLUTE),
    )
    return ATTITUDE | sum(flag for holds, flag in valid if holds)


def _roll_pitch_yaw(quaternion_wxyz: Any) -> tuple[float, float, float]:
    w, x, y, z = (float(number) for number in quaternion_wxyz)
    return (
        math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))),
        math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )


def _whole(value: float, scale: float, most: int) -> int:
    """A whole number that MAVLink has room for; -1 where PX4 knows none."""
    return -1 if not math.isfinite(value) or value < 0.0 else min(most, round(value * scale))


# -- what is sent ----------------------------------------------------------------------------
def trajectory_setpoint(message: Message) -> dict[str, Any]:
    """The fields of a TrajectorySetpoint: SET_POSITION_TARGET_LOCAL_NED with NaN for what its mask leaves out.

    Args:
        message: in NED.
    """
    mask = message.type_mask
    place, speed = (message.x, message.y, message.z), (message.vx, message.vy, message.vz)
    nothing = [math.nan] * 3
    return {
        'position': [math.nan if mask & bit else value for value, bit in zip(place, _PLACE, strict=True)],
        'velocity': [math.nan if mask & bit else value for value, bit in zip(speed, _SPEED, strict=True)],
        'acceleration': nothing, 'jerk': nothing,
        'yaw': math.nan if mask & _NO_YAW else message.yaw,
        'yawspeed': math.nan if mask & _NO_YAW_RATE else message.yaw_rate,
    }


def offboard_control_mode(message: Message) -> dict[str, bool]:
    """What of a setpoint is to be controlled, as PX4 itself has it of MAVLink.

    Args:
        message: SET_POSITION_TARGET_LOCAL_NED.
    """
    mask = message.type_mask
    return {'position': any(not mask & bit for bit in _PLACE), 'velocity': any(not mask & bit for bit in _SPEED)}


def vehicle_command(message: Message, source: tuple[int, int]) -> dict[str, Any]:
    """The fields of a VehicleCommand.

    Args:
        message: COMMAND_LONG.
        source: our system and component id, which PX4 answers to.
    """
    return {
        'command': int(message.command), **{f'param{n}': float(getattr(message, f'param{n}')) for n in range(1, 8)},
        'target_system': int(message.target_system), 'target_component': int(message.target_component),
        'source_system': source[0], 'source_component': source[1], 'from_external': True,
    }
