"""What an autopilot has said of itself so far: facts only, no decisions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.frames import Vector, enu_from_ned, yaw_enu_from_ned
from advise_ros.mavlink.messages import Message

# What reaches a controller: NaN in these is refused.
CONTROL_IDS = frozenset({mav.ATTITUDE, mav.LOCAL_POSITION_NED})

# A fact that was not repeated for this long is no fact any more; each is asked for twice a second or more.
FACT_S = 6.0


class Attitude(NamedTuple):
    """Body axes against the map: roll and pitch in the FLU sense, yaw counter-clockwise from east; radians."""

    roll_rad: float
    pitch_rad: float
    yaw_rad: float


class Motion(NamedTuple):
    """Position and velocity in the map frame (ENU) at an autopilot time, and when it arrived (monotonic)."""

    time_boot_ms: int
    position_enu_m: Vector
    velocity_enu_m_s: Vector
    at_s: float


class Battery(NamedTuple):
    """NaN where the autopilot does not know; `remaining` from 0 to 1."""

    voltage_v: float
    current_a: float
    remaining: float


class Ack(NamedTuple):
    """Result of one command, and when it arrived (monotonic)."""

    command: int
    result: int
    at_s: float


@dataclass
class Vehicle:
    """One autopilot, chosen by its first heartbeat.

    Only messages of its (system, component) count: other links' heartbeats are forwarded by many autopilots.
    """

    heartbeat_timeout_s: float
    own_system: int = 1
    target: tuple[int, int] | None = None
    autopilot: int = 0
    heartbeat_at_s: float = -math.inf
    armed: bool = False
    custom_mode: int | None = None
    health: int | None = None
    ekf_flags: int | None = None
    landed_state: int = 0
    attitude: Attitude | None = None
    motion: Motion | None = None
    battery: Battery | None = None
    text: str = ''
    text_at_s: float = -math.inf
    acks: list[Ack] = field(default_factory=list)
    boots: int = 0
    refused_numbers: int = 0
    heard_at_s: dict[int, float] = field(default_factory=dict)
    _chunks: dict[int, str] = field(default_factory=dict)

    def connected(self, now_s: float) -> bool:
        """Whether heartbeats arrive."""
        return now_s - self.heartbeat_at_s <= self.heartbeat_timeout_s

    @property
    def name(self) -> str:
        """'ardupilot', 'px4' or '' before the first heartbeat."""
        return mav.AUTOPILOT_NAMES.get(self.autopilot, '')

    @property
    def in_air(self) -> bool:
        """Off the ground, by the autopilot's own word."""
        return self.landed_state in (mav.IN_AIR, mav.TAKING_OFF, mav.LANDING)

    def observe(self, message: Message, now_s: float) -> bool:
        """Take a message in; False if it is somebody else's or not finite."""
        message_id = message.get_msgId()
        source = (message.get_srcSystem(), message.get_srcComponent())
        if self.target is None and message_id == mav.HEARTBEAT and message.autopilot in mav.AUTOPILOT_NAMES:
            self.target = source
        if source != self.target:
            return False
        if message_id in CONTROL_IDS and not mav.is_finite(message):
            self.refused_numbers += 1
            return False
        self.heard_at_s[message_id] = now_s
        handler = _HANDLERS.get(message_id)
        if handler is not None:
            handler(self, message, now_s)
        return True

    def _on_heartbeat(self, message: Message, now_s: float) -> None:
        if message.autopilot not in mav.AUTOPILOT_NAMES:
            return
        self.autopilot = int(message.autopilot)
        self.armed = bool(message.base_mode & mav.MODE_FLAG_ARMED)
        self.custom_mode = int(message.custom_mode)
        self.heartbeat_at_s = now_s

    def _on_sys_status(self, message: Message, now_s: float) -> None:
        self.health = int(message.onboard_control_sensors_health)
        unknown = math.nan
        self.battery = Battery(
            voltage_v=unknown if message.voltage_battery == 0xFFFF else message.voltage_battery / 1000,
            current_a=unknown if message.current_battery < 0 else message.current_battery / 100,
            remaining=unknown if message.battery_remaining < 0 else message.battery_remaining / 100,
        )

    def _on_ekf(self, message: Message, now_s: float) -> None:
        self.ekf_flags = int(message.flags)

    def _on_landed(self, message: Message, now_s: float) -> None:
        self.landed_state = int(message.landed_state)

    def _on_attitude(self, message: Message, now_s: float) -> None:
        # FRD against NED to FLU against ENU: roll keeps its sign, pitch flips (y points the other way).
        self.attitude = Attitude(float(message.roll), -float(message.pitch), yaw_enu_from_ned(float(message.yaw)))

    def _on_position(self, message: Message, now_s: float) -> None:
        boot_ms = int(message.time_boot_ms)
        if self.motion is not None and boot_ms + 1000 < self.motion.time_boot_ms:
            self._reboot()
        self.motion = Motion(
            boot_ms, enu_from_ned((message.x, message.y, message.z)),
            enu_from_ned((message.vx, message.vy, message.vz)), now_s,
        )

    def _reboot(self) -> None:
        """The autopilot's clock went back: what it said before is void."""
        self.boots += 1
        self.health = self.ekf_flags = self.attitude = None
        self.landed_state = 0
        self.heard_at_s.clear()

    def _on_ack(self, message: Message, now_s: float) -> None:
        if message.target_system not in (0, self.own_system):
            return  # The answer to somebody else's command.
        self.acks.append(Ack(int(message.command), int(message.result), now_s))
        del self.acks[:-50]

    def _on_text(self, message: Message, now_s: float) -> None:
        part = message.text if isinstance(message.text, str) else bytes(message.text).decode('utf-8', 'replace')
        if message.id and message.chunk_seq:
            part = self._chunks.get(message.id, '') + part
        if message.id:
            self._chunks = {message.id: part}
        self.text, self.text_at_s = part.strip(), now_s

    def forget_silent(self, now_s: float) -> None:
        """Readiness and landed state that were not heard lately are unknown."""
        for message_id, name, unknown in (
            (mav.EKF_STATUS_REPORT, 'ekf_flags', None), (mav.SYS_STATUS, 'health', None),
            (mav.EXTENDED_SYS_STATE, 'landed_state', 0),
        ):
            if now_s - self.heard_at_s.get(message_id, -math.inf) > FACT_S:
                setattr(self, name, unknown)

    def ack_since(self, command: int, since_s: float) -> int | None:
        """Result of a command that was sent at `since_s`, or None so far."""
        for ack in reversed(self.acks):
            if ack.command == command and ack.at_s >= since_s:
                return ack.result
        return None


_HANDLERS: dict[int, Callable[[Vehicle, Message, float], None]] = {
    mav.HEARTBEAT: Vehicle._on_heartbeat,
    mav.SYS_STATUS: Vehicle._on_sys_status,
    mav.EKF_STATUS_REPORT: Vehicle._on_ekf,
    mav.EXTENDED_SYS_STATE: Vehicle._on_landed,
    mav.ATTITUDE: Vehicle._on_attitude,
    mav.LOCAL_POSITION_NED: Vehicle._on_position,
    mav.COMMAND_ACK: Vehicle._on_ack,
    mav.STATUSTEXT: Vehicle._on_text,
}
