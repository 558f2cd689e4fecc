"""ArduCopter's GUIDED mode as a state machine.

ArduPilot forbids velocity setpoints during take-off (they cancel it), stays in GUIDED when they stop, and
never returns to GUIDED by itself after a failsafe. So nothing is sent before the take-off altitude is
reached.
"""

from __future__ import annotations

from types import MappingProxyType

from advise_ros.core.units import Vector
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.machine import Machine, Step
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.ownership import Holder
from advise_ros.mavlink.requests import Goal, GoalRequest, Progress
from advise_ros.mavlink.setpoint_watch import SetpointWatch
from advise_ros.mavlink.task import GoalPhase
from advise_ros.mavlink.vehicle import Vehicle

GUIDED, LAND = 4, 9
MODES = {
    0: 'STABILIZE', 1: 'ACRO', 2: 'ALT_HOLD', 3: 'AUTO', GUIDED: 'GUIDED', 5: 'LOITER', 6: 'RTL', 7: 'CIRCLE', LAND: 'LAND',
    11: 'DRIFT', 13: 'SPORT', 14: 'FLIP', 15: 'AUTOTUNE', 16: 'POSHOLD', 17: 'BRAKE', 18: 'THROW', 19: 'AVOID_ADSB',
    20: 'GUIDED_NOGPS', 21: 'SMART_RTL', 22: 'FLOWHOLD', 23: 'FOLLOW', 24: 'ZIGZAG', 25: 'SYSTEMID', 26: 'AUTOROTATE',
    27: 'AUTO_RTL', 28: 'TURTLE',
}

# EKF_STATUS_REPORT flags: attitude, velocities, positions relative, absolute and predicted.
EKF_WANTED = 0x33F
EKF_CONSTANT_POSITION = 0x80

# Reached: this close to the altitude, as a length and as a share of it.
ALTITUDE_TOLERANCE_M, ALTITUDE_TOLERANCE_SHARE = 0.3, 0.05
# Reached as well: in the air, no longer taking off and no longer climbing for this long.
SETTLED_S, STILL_M_S = 3.0, 0.2
# The armed bit is in the heartbeat, which is slow.
ARMED_LAG_S = 2.0
PREARM_ASK_S = 5.0
# Its target, which shows the setpoints that it follows, is asked for at this rate.
TARGET = (mav.POSITION_TARGET_LOCAL_NED, 20.0)
# A take-over must stand this long before it has succeeded: setpoints of another sender show in less.
SETTLE_S, SETTLE_PERIOD_S = 0.6, 0.05
# Velocities of an earlier sender are reported for at most this long; waiting for ours to be followed ends after it, too.
TAKEN_S, UNSEEN_S = 2.0, 3.0


class ArduPilot(Machine):
    """READY -> MODE (GUIDED) -> ARM -> TAKEOFF -> CLIMB, then setpoints; MODE (LAND) -> DOWN.

    A take-over: MODE (GUIDED) -> SETTLE, standing.
    """

    modes, own_mode, land_mode = MODES, GUIDED, LAND
    mode_params = MappingProxyType({GUIDED: (GUIDED,), LAND: (LAND,)})
    intervals = (
        (mav.EKF_STATUS_REPORT, 4.0), (mav.EXTENDED_SYS_STATE, 5.0), (mav.SYS_STATUS, 2.0), (mav.GPS_RAW_INT, 4.0),
    )
    streams = False

    def __init__(self, vehicle: Vehicle, ready_timeout_s: float) -> None:
        super().__init__(vehicle, ready_timeout_s)
        self._still_since_s = 0.0
        self._prearm_asked_s = 0.0
        self._targets = SetpointWatch()
        self._settled_s = 0.0

    def steps(self) -> dict[GoalPhase, Step]:
        return {
            GoalPhase.READY: self._await_ready, GoalPhase.MODE: self._set_mode, GoalPhase.ARM: self._arm,
            GoalPhase.TAKEOFF: self._take_off, GoalPhase.CLIMB: self._climb, GoalPhase.DOWN: self._come_down,
            GoalPhase.SETTLE: self._settle,
        }

    def wanted(self) -> tuple[tuple[int, float], ...]:
        """ArduPilot reports its target in GUIDED only."""
        return (*self.intervals, TARGET) if self._vehicle.custom_mode == GUIDED else self.intervals

    def missing(self) -> tuple[str, ...]:
        """By the state estimate and the autopilot's own checks: a position may be sent long before."""
        missing = []
        flags, health = self._vehicle.ekf_flags, self._vehicle.health
        if flags is None or flags & EKF_WANTED != EKF_WANTED or flags & EKF_CONSTANT_POSITION:
            missing.append('EKF position')
        if health is None or not health & mav.HEALTH_PREARM_CHECK:
            missing.append('pre-arm check')
        return tuple(missing)

    @property
    def airborne(self) -> bool:
        return self._vehicle.landed_state == mav.IN_AIR

    def farewell(self, now_s: float) -> list[Message]:
        """It stands, in GUIDED."""
        return self._stand(now_s) if self.commandable else []

    def setpoint(
        self, target: tuple[int, int], velocity_enu_m_s: Vector, yaw_rate_rad_s: float, now_s: float, doubt: str,
    ) -> Message:
        """A velocity, which the autopilot's target is compared with from now on."""
        message = super().setpoint(target, velocity_enu_m_s, yaw_rate_rad_s, now_s, doubt)
        self._targets.sent((message.vx, message.vy, message.vz), now_s)
        return message

    def observe(self, message: Message, now_s: float) -> None:
        """Look at which setpoints it follows."""
        if message.get_msgId() == mav.POSITION_TARGET_LOCAL_NED and self.holder is Holder.OURS:
            self._targets.report(message, now_s)
            if self._targets.foreign and self._vehicle.custom_mode == GUIDED:
                self._ownership.lose(f'somebody else sends setpoints: {self._targets.foreign}')
                if self._task.in_own_mode:
                    self._task.give_up(self._ownership.why)

    def _claim(self) -> None:
        super()._claim()
        self._targets.begin_anew(TAKEN_S if self._task.goal_is(Goal.TAKE_OVER) else 0.0)

    # -- steps -------------------------------------------------------------------------------
    def _stand(self, now_s: float) -> list[Message]:
        target = self._vehicle.target
        return [] if target is None else [self.setpoint(target, (0.0, 0.0, 0.0), 0.0, now_s, '')]

    def _begin_own(self, request: GoalRequest, now_s: float) -> list[Message]:
        self._task.enter(GoalPhase.SETTLE, now_s)
        self._claim()
        return self._settle(request, now_s)

    def _settle(self, request: GoalRequest, now_s: float) -> list[Message]:
        if now_s - self._task.phase_s >= (SETTLE_S if self._targets.seen else UNSEEN_S):
            request.answer(True, 'taken over; it stands until it is commanded')
            self._task.finish(failed=False)
        elif now_s - self._settled_s < SETTLE_PERIOD_S * 0.9:
            return []
        self._settled_s = now_s
        return self._stand(now_s)

    def _await_ready(self, request: GoalRequest, now_s: float) -> list[Message]:
        if self.ready:
            self._task.enter(GoalPhase.MODE, now_s)
            return self._set_mode(request, now_s)
        self._task.wait_ready(self.missing(), self._ready_timeout_s, now_s)
        return self._ask_prearm(now_s) if self._task.request is not None else []

    def _ask_prearm(self, now_s: float) -> list[Message]:
        """Let the autopilot say which of its checks fail."""
        if self._vehicle.target is None or now_s - self._prearm_asked_s < PREARM_ASK_S:
            return []
        self._prearm_asked_s = now_s
        return [mav.command(self._vehicle.target, mav.CMD_RUN_PREARM_CHECKS)]

    def _armed(self, request: GoalRequest, now_s: float) -> list[Message]:
        """At once: an armed vehicle on the ground disarms itself."""
        self._task.enter(GoalPhase.TAKEOFF, now_s)
        return self._take_off(request, now_s)

    def _take_off(self, request: GoalRequest, now_s: float) -> list[Message]:
        if self._vehicle.in_air:  # By the state: a repeated command fails in the air.
            request.answer(True, f'taking off to {request.altitude_m:g} m')
            self._task.enter(GoalPhase.CLIMB, now_s)
            self._still_since_s = now_s
            return self._climb(request, now_s)
        if self._answer_of('take-off', now_s) is Progress.ACCEPTED:
            request.answer(True, f'taking off to {request.altitude_m:g} m')
        if self._task.request is None:
            return []
        return self._task.send(now_s, mav.CMD_TAKEOFF, 0, 0, 0, 0, 0, 0, request.altitude_m)

    def _climb(self, request: GoalRequest, now_s: float) -> list[Message]:
        vehicle = self._vehicle
        if vehicle.landed_state == mav.ON_GROUND or (not vehicle.armed and now_s - self._task.phase_s > ARMED_LAG_S):
            self._task.finish(f'take-off ended on the ground{self._task.said}')
        elif self._altitude_reached(request, now_s):
            self._task.finish(failed=False)
        return []

    def _altitude_reached(self, request: GoalRequest, now_s: float) -> bool:
        vehicle = self._vehicle
        if vehicle.landed_state != mav.IN_AIR or vehicle.motion is None:
            self._still_since_s = now_s
            return False
        if abs(vehicle.motion.velocity_enu_m_s[2]) > STILL_M_S:
            self._still_since_s = now_s
        tolerance_m = max(ALTITUDE_TOLERANCE_M, ALTITUDE_TOLERANCE_SHARE * request.altitude_m)
        near = vehicle.motion.position_enu_m[2] >= request.altitude_m - tolerance_m
        return near or now_s - self._still_since_s > SETTLED_S
