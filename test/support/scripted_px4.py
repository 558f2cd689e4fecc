"""A scripted PX4: OFFBOARD lives by the stream of setpoints."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from advise_ros.mavlink import messages as mav
from support.scripted import CLIMB_M_S, ScriptedCopter

OFFBOARD, LOITER, LAND = 0x00060000, 0x03040000, 0x06040000
LOSS_S = 1.0


@dataclass
class ScriptedPx4(ScriptedCopter):
    """As seen on SITL: OFFBOARD without a stream is refused, or accepted while disarmed and then no arming.

    Attributes:
        drift_ned: how far off its own word its velocity is, metres a second: with velocity alone it wanders.
        place_ned: what it holds of each axis, None where it flies a velocity.
    """

    autopilot: int = mav.AUTOPILOT_PX4
    mode: int = LOITER
    streamed_s: float = -100.0
    wants_offboard: bool = False
    drift_ned: tuple[float, float, float] = (0.0, 0.0, 0.0)
    place_ned: list[float | None] = field(default_factory=lambda: [None, None, None])
    asked_without_stream: int = 0

    @property
    def streaming(self) -> bool:
        return self.time_s - self.streamed_s < LOSS_S

    @property
    def landed_state(self) -> int:
        if self.altitude_m <= 0.01:
            return mav.ON_GROUND
        return mav.LANDING if self.mode == LAND else mav.IN_AIR

    def _move(self, dt_s: float) -> None:
        if self.mode == OFFBOARD and not self.streaming:
            self.mode = LOITER
        elif self.mode == LOITER and self.wants_offboard and self.streaming:
            self.mode = OFFBOARD  # It comes back by itself.
        if self.mode == OFFBOARD and self.armed:
            self._fly(dt_s)
            self.position_ned[2] = min(0.0, self.position_ned[2])
        elif self.mode == LAND and self.armed:
            self.position_ned[2] = min(0.0, self.position_ned[2] + CLIMB_M_S * dt_s)
            self.armed = self.altitude_m > 0.01

    def _fly(self, dt_s: float) -> None:
        for axis, (place, drift) in enumerate(zip(self.place_ned, self.drift_ned, strict=True)):
            if place is not None:
                wanted = min(3.0, max(-3.0, place - self.position_ned[axis])) - drift
                self.velocity_ned = (*self.velocity_ned[:axis], wanted, *self.velocity_ned[axis + 1:])
            self.position_ned[axis] += (self.velocity_ned[axis] + (drift if self.altitude_m > 0.01 else 0.0)) * dt_s

    def receive(self, message: Any) -> list[Any]:
        if message.get_type() != 'SET_POSITION_TARGET_LOCAL_NED':
            return super().receive(message)
        before, answers = self.velocity_ned, super().receive(message)
        fields = message.x, message.y, message.z, message.vx, message.vy, message.vz
        assert all(math.isfinite(value) for value in fields)
        self.streamed_s = self.time_s
        self.place_ned = [None if message.type_mask & 1 << axis else fields[axis] for axis in range(3)]
        flown = [fields[3 + axis] if place is None else before[axis] for axis, place in enumerate(self.place_ned)]
        self.velocity_ned = flown[0], flown[1], flown[2]
        return answers

    def _obey(self, number: int, message: Any) -> int:
        if number == mav.CMD_SET_MODE:
            return self._offboard(message)
        if number == mav.CMD_ARM and message.param1 == 1.0 and not (self.ready and self.streaming):
            return int(mav.ACK_TEMPORARILY_REJECTED)
        if number == mav.CMD_TAKEOFF:
            return int(mav.ACK_DENIED)
        return super()._obey(number, message)

    def _offboard(self, message: Any) -> int:
        params = message.param1, message.param2, message.param3, message.param4
        if params == (1.0, 4.0, 6.0, 0.0):
            self.mode, self.wants_offboard = LAND, False
            return int(mav.ACK_ACCEPTED)
        if params != (1.0, 6.0, 0.0, 0.0):
            return int(mav.ACK_DENIED)
        if not self.streaming:
            self.asked_without_stream += 1
            return int(mav.ACK_TEMPORARILY_REJECTED)
        self.mode, self.wants_offboard = OFFBOARD, True
        return int(mav.ACK_ACCEPTED)
