"""A scripted PX4: OFFBOARD lives by the stream of setpoints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from advise_ros.mavlink import messages as mav
from support.scripted import CLIMB_M_S, ScriptedCopter

OFFBOARD, LOITER, LAND = 0x00060000, 0x03040000, 0x06040000
LOSS_S = 1.0


@dataclass
class ScriptedPx4(ScriptedCopter):
    """As seen on SITL: OFFBOARD without a stream is refused, or accepted while disarmed and then no arming."""

    autopilot: int = mav.AUTOPILOT_PX4
    mode: int = LOITER
    streamed_s: float = -100.0
    wants_offboard: bool = False
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
            self.position_ned = [p + v * dt_s for p, v in zip(self.position_ned, self.velocity_ned, strict=True)]
            self.position_ned[2] = min(0.0, self.position_ned[2])
        elif self.mode == LAND and self.armed:
            self.position_ned[2] = min(0.0, self.position_ned[2] + CLIMB_M_S * dt_s)
            self.armed = self.altitude_m > 0.01

    def receive(self, message: Any) -> list[Any]:
        if message.get_type() == 'SET_POSITION_TARGET_LOCAL_NED':
            self.streamed_s = self.time_s
        return super().receive(message)

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
