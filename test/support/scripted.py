"""A scripted ArduCopter: answers as a test tells it to, also wrongly. The real behaviour is the simulator's."""

from __future__ import annotations

import math
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.framing import Framer
from advise_ros.mavlink.messages import dialect

GUIDED, LAND, RTL = 4, 9, 6
READY_EKF, READY_HEALTH = 0x33F, mav.HEALTH_PREARM_CHECK
CLIMB_M_S = 2.0
# What it can send; whatever else is asked for fails.
SENDS = frozenset({
    mav.HEARTBEAT, mav.LOCAL_POSITION_NED, mav.ATTITUDE, mav.EKF_STATUS_REPORT, mav.EXTENDED_SYS_STATE, mav.SYS_STATUS,
    mav.POSITION_TARGET_LOCAL_NED, mav.CURRENT_MODE, mav.GPS_RAW_INT,
})
# GUID_TIMEOUT: without setpoints for so long it stands.
GUIDED_TIMEOUT_S = 3.0
# Degrees, as GPS_RAW_INT counts them, to a metre at the equator.
E7_A_METRE = 89.83
ONLY_PLACE, ONLY_VELOCITY = 0x0DF8, 0x0C07
REFUSAL = 'Arm: Need Position Estimate'


@dataclass
class ScriptedCopter:
    """Messages in, messages out; `time_s` is moved by `step`.

    Attributes:
        refuse: command numbers that fail, with the text that is sent after the ACK.
        deaf: command numbers that get no answer and have no effect.
        lose_acks: command numbers that have their effect without an ACK.
        silent: message ids that are never sent, whatever is asked.
        unknown: message ids that it does not know.
        failsafe: whether its heartbeat says that a failsafe has it.
        target: mask, place and velocity (NED) that it follows in GUIDED, None before any.
        disturbed: setpoints that came during a take-off, which they would end.
    """

    ready: bool = True
    system_id: int = 1
    autopilot: int = mav.AUTOPILOT_ARDUPILOT
    refuse: dict[int, str] = field(default_factory=dict)
    deaf: set[int] = field(default_factory=set)
    lose_acks: set[int] = field(default_factory=set)
    silent: set[int] = field(default_factory=set)
    unknown: set[int] = field(default_factory=set)
    mode: int = 0
    armed: bool = False
    position_ned: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    velocity_ned: tuple[float, float, float] = (0.0, 0.0, 0.0)
    climb_to_m: float | None = None
    failsafe: bool = False
    target: tuple[int, tuple[float, ...], tuple[float, ...]] | None = None
    followed_s: float = -math.inf
    time_s: float = 0.0
    commands: list[int] = field(default_factory=list)
    setpoints: list[Any] = field(default_factory=list)
    disturbed: int = 0
    intervals_s: dict[int, float] = field(default_factory=lambda: {mav.HEARTBEAT: 0.2})
    due_s: dict[int, float] = field(default_factory=lambda: {mav.HEARTBEAT: 0.0})

    @property
    def altitude_m(self) -> float:
        return -self.position_ned[2]

    @property
    def landed_state(self) -> int:
        if self.altitude_m <= 0.01:
            return mav.ON_GROUND
        return mav.TAKING_OFF if self.climb_to_m is not None else mav.LANDING if self.mode == LAND else mav.IN_AIR

    def step(self, dt_s: float) -> list[Any]:
        """Move, and send what is due."""
        self.time_s += dt_s
        self._move(dt_s)
        out = []
        for message_id, due in list(self.due_s.items()):
            if self.time_s >= due and message_id not in self.silent:
                self.due_s[message_id] = self.time_s + self.intervals_s[message_id]
                if self.says(message_id):
                    out.append(self.build(message_id))
        return out

    def says(self, message_id: int) -> bool:
        """Whether there is anything to say: no target outside of GUIDED."""
        return message_id != mav.POSITION_TARGET_LOCAL_NED or (self.mode == GUIDED and self.target is not None)

    def target_message(self) -> Any:
        """What it follows."""
        assert self.target is not None
        mask, place, velocity = self.target
        return dialect.MAVLink_position_target_local_ned_message(
            int(self.time_s * 1000), 1, mask, *place, *velocity, 0.0, 0.0, 0.0, 0.0, 0.0)

    def follow(self, message: Any) -> None:
        """Take a setpoint, whoever sent it."""
        self.disturbed += self.climb_to_m is not None
        self.velocity_ned = (message.vx, message.vy, message.vz)
        if self.mode == GUIDED:
            place = (message.x, message.y, message.z)
            mask = ONLY_VELOCITY if message.type_mask & 7 == 7 else ONLY_PLACE
            self.target, self.followed_s = (mask, place, self.velocity_ned), self.time_s

    def _move(self, dt_s: float) -> None:
        if self.target is not None and self.target[0] == ONLY_VELOCITY and self.time_s - self.followed_s > GUIDED_TIMEOUT_S:
            self.velocity_ned = (0.0, 0.0, 0.0)
            self.target = ONLY_VELOCITY, (0.0, 0.0, 0.0), self.velocity_ned
        if self.climb_to_m is not None:
            self.position_ned[2] = max(-self.climb_to_m, self.position_ned[2] - CLIMB_M_S * dt_s)
            if self.altitude_m >= self.climb_to_m:
                self.climb_to_m = None
        elif self.mode == LAND and self.armed:
            self.position_ned[2] = min(0.0, self.position_ned[2] + CLIMB_M_S * dt_s)
            self.armed = self.altitude_m > 0.01
        elif self.mode == GUIDED and self.landed_state == mav.IN_AIR:
            for axis in range(3):
                self.position_ned[axis] += self.velocity_ned[axis] * dt_s

    def set_mode(self, mode: int) -> None:
        """A mode that somebody commands: GUIDED begins by standing."""
        if mode == GUIDED and self.mode != GUIDED:
            self.target = ONLY_VELOCITY, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        self.mode = mode

    def build(self, message_id: int) -> Any:
        """One message of what is true now."""
        ms = int(self.time_s * 1000)
        x, y, z = self.position_ned
        builders: dict[int, Callable[[], Any]] = {
            mav.HEARTBEAT: lambda: dialect.MAVLink_heartbeat_message(
                2, self.autopilot, 1 | (mav.MODE_FLAG_ARMED if self.armed else 0), self.mode, 5 if self.failsafe else 4, 3),
            mav.POSITION_TARGET_LOCAL_NED: self.target_message,
            mav.GPS_RAW_INT: lambda: dialect.MAVLink_gps_raw_int_message(
                ms * 1000, 3, round(x * E7_A_METRE), round(y * E7_A_METRE), 0, 100, 100, 0, 0, 10),
            mav.LOCAL_POSITION_NED: lambda: dialect.MAVLink_local_position_ned_message(ms, x, y, z, *self.velocity_ned),
            mav.ATTITUDE: lambda: dialect.MAVLink_attitude_message(ms, 0.0, 0.0, math.pi / 2, 0.0, 0.0, 0.0),
            mav.EKF_STATUS_REPORT: lambda: dialect.MAVLink_ekf_status_report_message(
                READY_EKF if self.ready else 0x80, 0.0, 0.0, 0.0, 0.0, 0.0),
            mav.EXTENDED_SYS_STATE: lambda: dialect.MAVLink_extended_sys_state_message(0, self.landed_state),
            mav.SYS_STATUS: lambda: dialect.MAVLink_sys_status_message(
                0, 0, READY_HEALTH if self.ready else 0, 0, 12600, 500, 80, 0, 0, 0, 0, 0, 0),
        }
        return builders[message_id]()

    def receive(self, message: Any) -> list[Any]:
        """Answers to one message of ours."""
        kind = message.get_type()
        if kind == 'SET_POSITION_TARGET_LOCAL_NED':
            self.setpoints.append(message)
            self.follow(message)
        if kind != 'COMMAND_LONG' or message.target_system != self.system_id:
            return []
        number = int(message.command)
        self.commands.append(number)
        if number in self.deaf:
            return []
        if number in self.refuse:
            return [self._ack(number, mav.ACK_FAILED), dialect.MAVLink_statustext_message(4, self.refuse[number].encode())]
        result = self._obey(number, message)
        return [] if number in self.lose_acks else [self._ack(number, result)]

    def _obey(self, number: int, message: Any) -> int:
        if number == mav.CMD_MESSAGE_INTERVAL:
            wanted = int(message.param1)
            if wanted not in SENDS or wanted in self.unknown:
                return int(mav.ACK_FAILED)
            self.intervals_s[wanted] = message.param2 / 1e6
            self.due_s[wanted] = self.time_s
        elif number == mav.CMD_SET_MODE:
            self.set_mode(int(message.param2))
        elif number == mav.CMD_ARM:
            self.armed = bool(message.param1)
        elif number == mav.CMD_TAKEOFF:
            if not self.armed or self.mode != GUIDED or self.altitude_m > 0.01:
                return mav.ACK_FAILED
            self.climb_to_m = float(message.param7)
            north, east, _ = self.position_ned
            self.target = ONLY_PLACE, (north, east, -self.climb_to_m), (0.0, 0.0, 0.0)
        else:
            return mav.ACK_UNSUPPORTED
        return mav.ACK_ACCEPTED

    @staticmethod
    def _ack(number: int, result: int) -> Any:
        return dialect.MAVLink_command_ack_message(number, result)


class UdpPeer:
    """A scripted copter behind a UDP socket, in real time, in a thread.

    Args:
        copter: what to say.
        port: the bridge's udpin port.
    """

    def __init__(self, copter: ScriptedCopter, port: int) -> None:
        self.copter = copter
        self.muted = threading.Event()
        self._to = ('127.0.0.1', port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.settimeout(0.005)
        self._codec = dialect.MAVLink(None, copter.system_id, 1)
        self._framer = Framer()
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> UdpPeer:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join(5)
        self._socket.close()

    def send(self, message: Any) -> None:
        """Send a message of one's own, e.g. a text or NaN."""
        self.send_bytes(bytes(message.pack(self._codec)))

    def send_bytes(self, data: bytes) -> None:
        self._socket.sendto(data, self._to)

    def _run(self) -> None:
        last_s = time.monotonic()
        while not self._end.is_set():
            messages = self._hear()
            now_s = time.monotonic()
            messages += self.copter.step(now_s - last_s)
            last_s = now_s
            if not self.muted.is_set():
                for message in messages:
                    self.send(message)

    def _hear(self) -> list[Any]:
        try:
            data = self._socket.recv(65536)
        except TimeoutError:
            return []
        if self.muted.is_set():
            return []
        return [answer for message in self._framer.datagram(data) for answer in self.copter.receive(message)]
