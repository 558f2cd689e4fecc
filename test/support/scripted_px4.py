"""A scripted PX4: OFFBOARD lives by the stream of setpoints."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.current_mode import CurrentMode
from advise_ros.mavlink.messages import dialect
from support.scripted import CLIMB_M_S, READY_HEALTH, ScriptedCopter

OFFBOARD, LOITER, LAND = 0x00060000, 0x03040000, 0x06040000
LOSS_S = 1.0
# From the first setpoint to an arming that is accepted.
SETTLED_S = 0.1


@dataclass
class ScriptedPx4(ScriptedCopter):
    """As seen on SITL: OFFBOARD lives by the stream, and comes back by itself when the stream does.

    Disarmed in OFFBOARD it stays there, stream or no stream, but its pre-arm check passes only with one. After a
    landing out of OFFBOARD it goes back there. Arming straight after the first setpoint is refused.

    Attributes:
        commanded: the mode that somebody commanded last.
        drift_ned: how far off its own word its velocity is, metres a second: with velocity alone it wanders.
        place_ned: what it holds of each axis, None where it flies a velocity.
    """

    autopilot: int = mav.AUTOPILOT_PX4
    mode: int = LOITER
    streamed_s: float = -100.0
    stream_began_s: float = -100.0
    commanded: int = 0
    flew_offboard: bool = False
    intervals_s: dict[int, float] = field(default_factory=lambda: {mav.HEARTBEAT: 1.0})
    drift_ned: tuple[float, float, float] = (0.0, 0.0, 0.0)
    place_ned: list[float | None] = field(default_factory=lambda: [None, None, None])
    asked_without_stream: int = 0

    def __post_init__(self) -> None:
        self.commanded = self.mode

    @property
    def streaming(self) -> bool:
        return self.time_s - self.streamed_s < LOSS_S

    @property
    def landed_state(self) -> int:
        if self.altitude_m <= 0.01:
            return mav.ON_GROUND
        return mav.LANDING if self.mode == LAND else mav.IN_AIR

    def set_mode(self, mode: int) -> None:
        """A mode that somebody commands."""
        self.mode = self.commanded = mode

    def fail(self, mode: int) -> None:
        """A failsafe sets a mode; the one that was commanded waits for its end."""
        self.mode, self.failsafe = mode, True

    def recover(self) -> None:
        """The cause of a failsafe is gone: it goes back to what was commanded, in OFFBOARD if the stream is on."""
        self.failsafe = False
        if self.commanded != OFFBOARD or self.streaming:
            self.mode = self.commanded

    def _move(self, dt_s: float) -> None:
        if self.armed and self.mode == OFFBOARD and not self.streaming:
            self.mode = LOITER
        elif self.armed and self.mode == LOITER and self.commanded == OFFBOARD and self.streaming and not self.failsafe:
            self.mode = OFFBOARD  # It comes back by itself.
        self.flew_offboard = self.armed and (self.flew_offboard or self.mode == OFFBOARD)
        if self.mode == OFFBOARD and self.armed:
            self._fly(dt_s)
            self.position_ned[2] = min(0.0, self.position_ned[2])
        elif self.mode == LAND and self.armed:
            self.position_ned[2] = min(0.0, self.position_ned[2] + CLIMB_M_S * dt_s)
            if self.altitude_m <= 0.01:
                self.armed = False
                self.mode = self.commanded = OFFBOARD if self.flew_offboard else LOITER

    def says(self, message_id: int) -> bool:
        return message_id != mav.POSITION_TARGET_LOCAL_NED

    def build(self, message_id: int) -> Any:
        if message_id == mav.CURRENT_MODE:
            return CurrentMode(0, self.mode, self.commanded)
        if message_id == mav.SYS_STATUS:
            mute = not self.armed and self.mode == OFFBOARD and not self.streaming
            health = READY_HEALTH if self.ready and not mute else 0
            return dialect.MAVLink_sys_status_message(0, 0, health, 0, 12600, 500, 80, 0, 0, 0, 0, 0, 0)
        return super().build(message_id)

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
        self.live()
        self.velocity_ned = before
        self.aim([None if message.type_mask & 1 << axis else fields[axis] for axis in range(3)], fields[3:])
        return answers

    def live(self) -> None:
        """A sign of life: OFFBOARD may go on."""
        if not self.streaming:
            self.stream_began_s = self.time_s
        self.streamed_s = self.time_s

    def aim(self, place_ned: list[float | None], velocity_ned: tuple[float, ...]) -> None:
        """Fly to a place on the axes that have one, by a velocity on the others."""
        self.place_ned = place_ned
        before = self.velocity_ned
        flown = [velocity_ned[axis] if place is None else before[axis] for axis, place in enumerate(place_ned)]
        self.velocity_ned = flown[0], flown[1], flown[2]

    def _obey(self, number: int, message: Any) -> int:
        if number == mav.CMD_SET_MODE:
            return self._offboard(message)
        settled = self.streaming and self.time_s - self.stream_began_s >= SETTLED_S
        if number == mav.CMD_ARM and message.param1 == 1.0 and not (self.ready and settled):
            return int(mav.ACK_TEMPORARILY_REJECTED)
        if number == mav.CMD_TAKEOFF:
            return int(mav.ACK_DENIED)
        return super()._obey(number, message)

    def _offboard(self, message: Any) -> int:
        params = message.param1, message.param2, message.param3, message.param4
        if params in ((1.0, 4.0, 6.0, 0.0), (1.0, 4.0, 3.0, 0.0)):
            self.set_mode(LAND if message.param3 == 6.0 else LOITER)
            return int(mav.ACK_ACCEPTED)
        if params != (1.0, 6.0, 0.0, 0.0):
            return int(mav.ACK_DENIED)
        if not self.streaming:
            self.asked_without_stream += 1
            if self.armed:
                return int(mav.ACK_TEMPORARILY_REJECTED)
        self.set_mode(OFFBOARD)
        return int(mav.ACK_ACCEPTED)
