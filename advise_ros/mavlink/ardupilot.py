"""ArduCopter's GUIDED mode as a state machine: facts and monotonic time in, messages and status out.

ArduPilot forbids velocity setpoints during take-off (they cancel it), stays in GUIDED when they stop, and
never returns to GUIDED by itself after a failsafe. So nothing is sent before the take-off altitude is
reached, and a mode that somebody else set is respected until a person asks for a take-off again.
"""

from __future__ import annotations

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.requests import Goal, Progress, Request
from advise_ros.mavlink.undertaking import Phase, Undertaking
from advise_ros.mavlink.vehicle import Vehicle

MODES = {
    0: 'STABILIZE', 1: 'ACRO', 2: 'ALT_HOLD', 3: 'AUTO', 4: 'GUIDED', 5: 'LOITER', 6: 'RTL', 7: 'CIRCLE', 9: 'LAND',
    11: 'DRIFT', 13: 'SPORT', 14: 'FLIP', 15: 'AUTOTUNE', 16: 'POSHOLD', 17: 'BRAKE', 18: 'THROW', 19: 'AVOID_ADSB',
    20: 'GUIDED_NOGPS', 21: 'SMART_RTL', 22: 'FLOWHOLD', 23: 'FOLLOW', 24: 'ZIGZAG', 25: 'SYSTEMID', 26: 'AUTOROTATE',
    27: 'AUTO_RTL', 28: 'TURTLE',
}
GUIDED, LAND = 4, 9

# EKF_STATUS_REPORT flags: attitude, velocities, positions relative, absolute and predicted.
EKF_WANTED = 0x33F
EKF_CONSTANT_POSITION = 0x80

# (message, rate in Hz) beside position and attitude.
INTERVALS = (
    (mav.EKF_STATUS_REPORT, 2.0), (mav.EXTENDED_SYS_STATE, 5.0), (mav.SYS_STATUS, 2.0),
)

# Reached: this close to the altitude, as a length and as a share of it.
ALTITUDE_TOLERANCE_M, ALTITUDE_TOLERANCE_SHARE = 0.3, 0.05
# Reached as well: in the air, no longer taking off and no longer climbing for this long.
SETTLED_S, STILL_M_S = 3.0, 0.2
# The armed bit is in the heartbeat, which is slow.
ARMED_LAG_S = 2.0
# Longest time from a command that was accepted to its effect.
EFFECT_S = 15.0
PREARM_ASK_S = 5.0


class ArduPilot:
    """Decides what to send to one ArduCopter.

    Args:
        vehicle: its facts, kept up to date by the caller.
        ready_timeout_s: longest wait for readiness before a take-off.
    """

    intervals = INTERVALS
    streams = False

    def __init__(self, vehicle: Vehicle, ready_timeout_s: float) -> None:
        self._vehicle = vehicle
        self._ready_timeout_s = ready_timeout_s
        self._task = Undertaking(vehicle)
        self._still_since_s = 0.0
        self._prearm_asked_s = 0.0
        self._was_guided = False

    # -- status ------------------------------------------------------------------------------
    @property
    def mode(self) -> str:
        """Name of the flight mode, '' before the first heartbeat."""
        number = self._vehicle.custom_mode
        return '' if number is None else MODES.get(number, f'mode {number}')

    def missing(self) -> tuple[str, ...]:
        """What the autopilot still lacks before it may be armed."""
        missing = []
        flags, health = self._vehicle.ekf_flags, self._vehicle.health
        if flags is None or flags & EKF_WANTED != EKF_WANTED or flags & EKF_CONSTANT_POSITION:
            missing.append('EKF position')
        if health is None or not health & mav.HEALTH_PREARM_CHECK:
            missing.append('pre-arm check')
        return tuple(missing)

    @property
    def ready(self) -> bool:
        """The autopilot may be armed, or is."""
        return self._vehicle.armed or not self.missing()

    @property
    def commandable(self) -> bool:
        """Velocity setpoints would be obeyed, given a living link."""
        vehicle = self._vehicle
        task = self._task.request
        return (
            vehicle.custom_mode == GUIDED and vehicle.armed and vehicle.landed_state == mav.IN_AIR
            and (task is None or task.goal not in (Goal.TAKEOFF, Goal.LAND))
        )

    @property
    def waiting_for(self) -> str:
        """What is missing for the next step, '' if nothing."""
        if self._task.request is not None:
            return self._waiting_in_phase()
        if self._task.failure:
            return self._task.failure
        if not self.ready:
            return ', '.join(self.missing())
        if self._vehicle.armed and self._vehicle.in_air and self._vehicle.custom_mode != GUIDED:
            who = f'; {self.mode} was set by someone else' if self._was_guided else ''
            return f'GUIDED mode (it is {self.mode}{who}; mavlink_bridge/takeoff takes over)'
        return ''

    def _waiting_in_phase(self) -> str:
        if self._task.phase is Phase.READY:
            return ', '.join(self.missing()) or str(Phase.MODE.value)
        return str(self._task.phase.value)

    # -- requests ----------------------------------------------------------------------------
    def ask(self, request: Request) -> None:
        """Begin a goal; one that is under way is given up."""
        first = {Goal.TAKEOFF: Phase.READY, Goal.LAND: Phase.MODE}
        self._task.begin(request, first.get(request.goal, Phase.ARM))
        if request.goal is Goal.LAND and not self._vehicle.armed:
            self._task.finish('disarmed already', failed=False)

    def lose_link(self) -> None:
        """The link is lost: goals end, nothing is repeated when it comes back."""
        self._task.give_up('the link was lost')

    # -- steps -------------------------------------------------------------------------------
    def step(self, now_s: float) -> list[Message]:
        """What to send now."""
        self._was_guided = self._vehicle.armed and (self._was_guided or self._vehicle.custom_mode == GUIDED)
        if self.commandable:
            self._task.failure = ''  # However it came to fly, it does.
        if self._task.request is None:
            return []
        if self._task.phase in (Phase.MODE, Phase.TAKEOFF) and now_s - self._task.phase_s > EFFECT_S:
            self._task.give_up(f'no {self._task.phase.value} after {EFFECT_S:g} s')
            return []
        steps = {
            Phase.READY: self._await_ready, Phase.MODE: self._set_mode, Phase.ARM: self._arm,
            Phase.TAKEOFF: self._take_off, Phase.CLIMB: self._climb, Phase.DOWN: self._come_down,
        }
        return steps[self._task.phase](self._task.request, now_s)

    def _answer_of(self, what: str, now_s: float) -> Progress:
        return self._task.answer_of(what, () if self.ready else self.missing(), now_s)

    def _await_ready(self, request: Request, now_s: float) -> list[Message]:
        if self.ready:
            self._task.enter(Phase.MODE, now_s)
            return self._set_mode(request, now_s)
        self._task.wait_ready(self.missing(), self._ready_timeout_s, now_s)
        return self._ask_prearm(now_s) if self._task.request is not None else []

    def _ask_prearm(self, now_s: float) -> list[Message]:
        """Let the autopilot say which of its checks fail."""
        if self._vehicle.target is None or now_s - self._prearm_asked_s < PREARM_ASK_S:
            return []
        self._prearm_asked_s = now_s
        return [mav.command(self._vehicle.target, mav.CMD_RUN_PREARM_CHECKS)]

    def _set_mode(self, request: Request, now_s: float) -> list[Message]:
        wanted = LAND if request.goal is Goal.LAND else GUIDED
        if self._vehicle.custom_mode == wanted:
            return self._mode_is_set(request, now_s)
        self._answer_of(f'{MODES[wanted]} mode', now_s)
        return self._task.send(now_s, mav.CMD_SET_MODE, 1, wanted) if self._task.request is not None else []

    def _mode_is_set(self, request: Request, now_s: float) -> list[Message]:
        if request.goal is Goal.LAND:
            request.answer(True, 'landing')
            self._task.enter(Phase.DOWN, now_s)
            return []
        if self._vehicle.armed and self._vehicle.landed_state == mav.IN_AIR:
            request.answer(True, 'in the air already; GUIDED mode is set')
            self._task.finish(failed=False)
            return []
        self._task.enter(Phase.ARM, now_s)
        return self._arm(request, now_s)

    def _arm(self, request: Request, now_s: float) -> list[Message]:
        wanted = request.goal is not Goal.DISARM
        done = self._vehicle.armed == wanted or self._answer_of(request.goal.value, now_s) is Progress.ACCEPTED
        if self._task.request is None:
            return []
        if not done:
            return self._task.send(now_s, mav.CMD_ARM, float(wanted))
        if request.goal is Goal.TAKEOFF:  # At once: an armed vehicle on the ground disarms itself.
            self._task.enter(Phase.TAKEOFF, now_s)
            return self._take_off(request, now_s)
        request.answer(True, 'armed' if wanted else 'disarmed')
        self._task.finish(failed=False)
        return []

    def _take_off(self, request: Request, now_s: float) -> list[Message]:
        if self._vehicle.custom_mode != GUIDED:
            self._task.finish(f'take-off given up: {self.mode} was set by someone else')
            return []
        if self._vehicle.in_air:  # By the state: a repeated command fails in the air.
            request.answer(True, f'taking off to {request.altitude_m:g} m')
            self._task.enter(Phase.CLIMB, now_s)
            self._still_since_s = now_s
            return self._climb(request, now_s)
        if self._answer_of('take-off', now_s) is Progress.ACCEPTED:
            request.answer(True, f'taking off to {request.altitude_m:g} m')
        if self._task.request is None:
            return []
        return self._task.send(now_s, mav.CMD_TAKEOFF, 0, 0, 0, 0, 0, 0, request.altitude_m)

    def _climb(self, request: Request, now_s: float) -> list[Message]:
        vehicle = self._vehicle
        if vehicle.custom_mode != GUIDED:
            self._task.finish(f'take-off given up: {self.mode} was set by someone else')
        elif vehicle.landed_state == mav.ON_GROUND or (not vehicle.armed and now_s - self._task.phase_s > ARMED_LAG_S):
            self._task.finish(f'take-off ended on the ground{self._task.said}')
        elif self._altitude_reached(request, now_s):
            self._task.finish(failed=False)
        return []

    def _altitude_reached(self, request: Request, now_s: float) -> bool:
        vehicle = self._vehicle
        if vehicle.landed_state != mav.IN_AIR or vehicle.motion is None:
            self._still_since_s = now_s
            return False
        if abs(vehicle.motion.velocity_enu_m_s[2]) > STILL_M_S:
            self._still_since_s = now_s
        tolerance_m = max(ALTITUDE_TOLERANCE_M, ALTITUDE_TOLERANCE_SHARE * request.altitude_m)
        near = vehicle.motion.position_enu_m[2] >= request.altitude_m - tolerance_m
        return near or now_s - self._still_since_s > SETTLED_S

    def _come_down(self, request: Request, now_s: float) -> list[Message]:
        if not self._vehicle.armed:
            self._task.finish(failed=False)
        elif self._vehicle.custom_mode != LAND:
            self._task.finish(f'landing given up: {self.mode} was set by someone else')
        return []
