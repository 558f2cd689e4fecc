"""A companion that talks to a simulated autopilot object, without a socket."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.config import SimulatorConfig, build
from advise_ros.sim.arducopter import ArduCopter

ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4
ARM, SET_MODE, TAKEOFF, LAND, RTL, INTERVAL, REQUEST = 400, 176, 22, 21, 20, 511, 512
LOCAL_POSITION, ATTITUDE, EKF, SYS_STATUS, BATTERY, EXTENDED, GPS, GLOBAL, VERSION = 32, 30, 193, 1, 147, 245, 24, 33, 148
VELOCITY_ONLY, WITH_YAW_RATE, POSITION_ONLY = 0x0DC7, 0x05C7, 0x0DF8


class Companion:
    """Talks to an autopilot object as a companion would, and remembers what it was told."""

    def __init__(self, system_id: int = 1, dialect: Any = ArduCopter, **values: Any) -> None:
        config = build(SimulatorConfig, {'ready_after_s': 2.0, 'system_id': system_id, **values})
        self.autopilot = dialect(config, np.random.default_rng(config.seed))
        self.vehicle = self.autopilot.vehicle
        self._wire = mavlink.MAVLink(None, srcSystem=1, srcComponent=191)
        self.heard: list[Any] = []

    def say(self, message: Any, source: tuple[int, int] = (1, 191)) -> list[Any]:
        """Over the codec and back, as on a wire; returns the replies."""
        wire = mavlink.MAVLink(None, srcSystem=source[0], srcComponent=source[1])
        replies = self.autopilot.receive(self._wire.decode(bytearray(message.pack(wire))))
        self.heard += replies
        return replies

    def command(self, number: int, *params: float, to: int = 1, component: int = 1) -> int | None:
        """The result of a COMMAND_LONG; None when there is no ACK."""
        padded = [*params, *[0.0] * (7 - len(params))]
        replies = self.say(mavlink.MAVLink_command_long_message(to, component, number, 0, *padded))
        acks = [reply for reply in replies if reply.get_type() == 'COMMAND_ACK']
        assert all(ack.command == number and ack.target_system == 1 and ack.target_component == 191 for ack in acks)
        return acks[0].result if acks else None

    def setpoint(self, *velocity_ned: float, mask: int = WITH_YAW_RATE, frame: int = 1, **parts: float) -> None:
        names = ('x', 'y', 'z', 'vx', 'vy', 'vz', 'afx', 'afy', 'afz', 'yaw', 'yaw_rate')
        values = {**dict.fromkeys(names, 0.0), **dict(zip(('vx', 'vy', 'vz'), velocity_ned, strict=False)), **parts}
        fields = [values[name] for name in names]
        assert self.say(mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *fields)) == []

    def run(self, seconds: float, *velocity_ned: float, **setpoint: Any) -> list[Any]:
        """Simulate; with a velocity, stream it at 20 Hz. Returns the messages sent meanwhile."""
        sent = []
        for tick in range(round(seconds / 0.025)):
            if (velocity_ned or setpoint) and tick % 2 == 0:
                self.setpoint(*velocity_ned, **setpoint)
            sent += self.autopilot.step()
        self.heard += sent
        return sent

    def texts(self) -> list[str]:
        return [message.text for message in self.heard if message.get_type() == 'STATUSTEXT']

    def guided(self) -> Companion:
        self.run(2.5)
        assert self.command(SET_MODE, 1, 4) == ACCEPTED
        return self

    def flying(self, altitude_m: float = 5.0) -> Companion:
        self.guided()
        assert self.command(ARM, 1) == ACCEPTED
        assert self.command(TAKEOFF, 0, 0, 0, 0, 0, 0, altitude_m) == ACCEPTED
        self.run(10.0)
        assert self.altitude == pytest.approx(altitude_m, abs=0.1)
        return self

    @property
    def altitude(self) -> float:
        return self.vehicle.state.altitude_m

    @property
    def speed(self) -> float:
        return float(np.linalg.norm(self.vehicle.state.velocity_enu_m_s))

    @property
    def ned(self) -> tuple[float, float, float]:
        """Position as LOCAL_POSITION_NED tells it."""
        self.command(REQUEST, LOCAL_POSITION)
        message = next(m for m in reversed(self.heard) if m.get_type() == 'LOCAL_POSITION_NED')
        return message.x, message.y, message.z


def of(messages: list[Any], name: str) -> list[Any]:
    return [message for message in messages if message.get_type() == name]
