"""PX4's OFFBOARD mode as a state machine.

PX4 wants a stream of setpoints before OFFBOARD is asked for, leaves OFFBOARD 1 s after it pauses, and comes
back by itself when the stream does. So the stream begins with a take-off or a take-over, never pauses in
OFFBOARD, and ends with OFFBOARD: a vehicle that somebody else or a failsafe took gets no more setpoints from us.

After a landing out of OFFBOARD it is disarmed in OFFBOARD, where its pre-arm check fails for want of a stream
and says nothing else: a take-off streams there before it waits for readiness.
"""

from __future__ import annotations

import math
from types import MappingProxyType

from advise_ros.core.units import Vector
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.hold import NO_PLACE, PROMPT_S, Hold
from advise_ros.mavlink.machine import Machine, Step
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.ownership import Holder
from advise_ros.mavlink.requests import Goal, GoalRequest
from advise_ros.mavlink.task import GoalPhase
from advise_ros.mavlink.vehicle import Vehicle

# custom_mode is main mode << 16 | sub mode << 24.
OFFBOARD, LAND = 0x00060000, 0x06040000
MODES = {
    0x00010000: 'MANUAL', 0x00020000: 'ALTCTL', 0x00030000: 'POSCTL', 0x00050000: 'ACRO', OFFBOARD: 'OFFBOARD',
    0x00070000: 'STABILIZED', 0x01040000: 'READY', 0x02040000: 'TAKEOFF', 0x03040000: 'LOITER', 0x04040000: 'MISSION',
    0x05040000: 'RTL', LAND: 'LAND',
}
# Main and sub mode, as DO_SET_MODE wants them. Its other parameters, and those of arming, must be 0.
SET_LOITER = (4, 3)

STREAM_PERIOD_S = 0.05
# How long setpoints flow before OFFBOARD is asked for.
STREAM_S = 1.0
CLIMB_M_S, SLOWEST_CLIMB_M_S, CLIMB_GAIN_1_S = 1.0, 0.3, 0.8
ALTITUDE_TOLERANCE_M = 0.3
# Longest time from arming to the altitude, and more for each metre.
CLIMB_S, CLIMB_S_PER_M = 20.0, 5.0


class Px4Machine(Machine):
    """READY -> STREAM -> MODE (OFFBOARD) -> ARM -> CLIMB by velocity, then setpoints; MODE (LAND) -> DOWN.

    A take-over: STREAM -> MODE (OFFBOARD).
    """

    modes, own_mode, land_mode = MODES, OFFBOARD, LAND
    mode_params = MappingProxyType({OFFBOARD: (6, 0), LAND: (4, 6)})
    intervals = (
        (mav.EXTENDED_SYS_STATE, 5.0), (mav.SYS_STATUS, 2.0), (mav.ESTIMATOR_STATUS, 4.0), (mav.GPS_RAW_INT, 4.0),
        (mav.ODOMETRY, 2.0), (mav.CURRENT_MODE, 10.0),
    )
    streams = True
    texts_to_ground_stations_only = True

    def __init__(self, vehicle: Vehicle, ready_timeout_s: float) -> None:
        super().__init__(vehicle, ready_timeout_s)
        self._streamed_s = -math.inf
        self._hold = Hold()

    def steps(self) -> dict[GoalPhase, Step]:
        return {
            GoalPhase.READY: self._await_ready, GoalPhase.STREAM: self._begin_stream, GoalPhase.MODE: self._set_mode,
            GoalPhase.ARM: self._arm, GoalPhase.CLIMB: self._climb, GoalPhase.DOWN: self._come_down,
        }

    def missing(self) -> tuple[str, ...]:
        """Without a stream the pre-arm check says nothing in OFFBOARD: a take-off makes it speak."""
        position = () if self._vehicle.position_fresh else ('position',)
        health = self._vehicle.health
        checked = health is not None and (bool(health & mav.HEALTH_PREARM_CHECK) or self._is_mute)
        return position if checked else (*position, 'pre-arm check')

    @property
    def _is_mute(self) -> bool:
        """Disarmed in OFFBOARD, where only a stream lets the pre-arm check pass, and none is on."""
        disarmed_there = not self._vehicle.armed and self._vehicle.custom_mode == OFFBOARD
        return disarmed_there and not self._task.goal_is(Goal.TAKEOFF)

    @property
    def airborne(self) -> bool:
        return self._vehicle.in_air

    def farewell(self, now_s: float) -> list[Message]:
        """Hold, in a climb too: the end of the stream would be a loss, which by default makes it sink or return."""
        landing = self._task.goal_is(Goal.LAND)
        # That it is armed shows only in the next heartbeat.
        climbs = self._task.goal_is(Goal.TAKEOFF) and self._task.phase is GoalPhase.CLIMB
        ours = climbs or (self._vehicle.armed and self.holder is Holder.OURS)
        if self._vehicle.target is None or landing or not ours or self._vehicle.custom_mode != OFFBOARD:
            return []
        return [*self._setpoint(now_s, 0.0), mav.command(self._vehicle.target, mav.CMD_SET_MODE, 1, *SET_LOITER)]

    def let_go(self) -> None:
        """The stream has ended with the hold; from here only a take-over leads back to OFFBOARD."""
        super().let_go()
        if self.holder is Holder.OURS:
            self._ownership.lose('it was made to hold when the bridge was deactivated')

    # -- steps -------------------------------------------------------------------------------
    def setpoint(
        self, target: tuple[int, int], velocity_enu_m_s: Vector, yaw_rate_rad_s: float, now_s: float, doubt: str,
    ) -> Message:
        """It holds a place where no motion is asked for; on the ground, the one that it is to climb over."""
        motion = None if doubt else self._vehicle.trusted(now_s)
        if motion is not None and self._vehicle.landed_state == mav.ON_GROUND:
            self._hold.stand_at(motion, now_s)
            motion = motion if velocity_enu_m_s[2] > 0.0 else None
        wanted = self._hold.wanted(velocity_enu_m_s, motion, now_s, prompt=self._vehicle.round_trip_s < PROMPT_S)
        if wanted.place_enu_m == NO_PLACE:
            return super().setpoint(target, velocity_enu_m_s, yaw_rate_rad_s, now_s, doubt)
        return mav.place_setpoint(target, int(now_s * 1000), *wanted, yaw_rate_rad_s)

    def _setpoint(self, now_s: float, up_m_s: float) -> list[Message]:
        target = self._vehicle.target
        return [] if target is None else [self.setpoint(target, (0.0, 0.0, up_m_s), 0.0, now_s, '')]

    def _stream(self, now_s: float, up_m_s: float = 0.0) -> list[Message]:
        if now_s - self._streamed_s < STREAM_PERIOD_S * 0.9:
            return []
        self._streamed_s = now_s
        return self._setpoint(now_s, up_m_s)

    def _await_ready(self, request: GoalRequest, now_s: float) -> list[Message]:
        if self.ready:
            self._task.enter(GoalPhase.STREAM, now_s)
            return self._stream(now_s)
        self._task.wait_ready(self.missing(), self._ready_timeout_s, now_s)
        streams = self._task.request is not None and self._vehicle.custom_mode == OFFBOARD
        return self._stream(now_s) if streams else []

    def _begin_own(self, request: GoalRequest, now_s: float) -> list[Message]:
        self._claim()
        request.answer(True, 'taken over; it stands until it is commanded')
        self._task.finish(failed=False)
        return self._stream(now_s)

    def _begin_stream(self, request: GoalRequest, now_s: float) -> list[Message]:
        if now_s - self._task.phase_s >= STREAM_S:
            self._task.enter(GoalPhase.MODE, now_s)
        return self._stream(now_s)

    def _set_mode(self, request: GoalRequest, now_s: float) -> list[Message]:
        """A landing ends the stream, so that nothing leads back to OFFBOARD."""
        stream = [] if request.goal is Goal.LAND else self._stream(now_s)
        return [*stream, *super()._set_mode(request, now_s)]

    def _arm(self, request: GoalRequest, now_s: float) -> list[Message]:
        stream = self._stream(now_s) if request.goal is Goal.TAKEOFF else []
        return [*stream, *super()._arm(request, now_s)]

    def _armed(self, request: GoalRequest, now_s: float) -> list[Message]:
        request.answer(True, f'taking off to {request.altitude_m:g} m')
        self._task.enter(GoalPhase.CLIMB, now_s)
        return []

    def _climb(self, request: GoalRequest, now_s: float) -> list[Message]:
        if now_s - self._task.phase_s > CLIMB_S + CLIMB_S_PER_M * request.altitude_m:
            self._task.give_up(f'the altitude was not reached in time{self._task.said}')
            return []
        motion = self._vehicle.motion
        left_m = request.altitude_m - (motion.position_enu_m[2] if motion is not None else 0.0)
        if left_m <= ALTITUDE_TOLERANCE_M and self._vehicle.in_air and self._vehicle.armed:
            self._task.finish(failed=False)
            return self._stream(now_s)
        return self._stream(now_s, min(CLIMB_M_S, max(SLOWEST_CLIMB_M_S, CLIMB_GAIN_1_S * left_m)))
