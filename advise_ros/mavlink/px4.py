"""PX4's OFFBOARD mode as a state machine: facts and monotonic time in, messages and status out.

PX4 wants a stream of setpoints before OFFBOARD is asked for, leaves OFFBOARD 1 s after it pauses, and comes
back by itself when the stream does. So the stream begins with a take-off, never pauses in OFFBOARD, and ends
with OFFBOARD: a mode that somebody else set is not taken back until a person asks for a take-off again.
"""

from __future__ import annotations

import math

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.requests import Goal, Progress, Request
from advise_ros.mavlink.undertaking import Phase, Undertaking
from advise_ros.mavlink.vehicle import Vehicle

# custom_mode is main mode << 16 | sub mode << 24.
OFFBOARD, LAND = 0x00060000, 0x06040000
MODES = {
    0x00010000: 'MANUAL', 0x00020000: 'ALTCTL', 0x00030000: 'POSCTL', 0x00050000: 'ACRO', OFFBOARD: 'OFFBOARD',
    0x00070000: 'STABILIZED', 0x01040000: 'READY', 0x02040000: 'TAKEOFF', 0x03040000: 'LOITER', 0x04040000: 'MISSION',
    0x05040000: 'RTL', LAND: 'LAND',
}
MAIN_OFFBOARD = 6

INTERVALS = ((mav.EXTENDED_SYS_STATE, 5.0), (mav.SYS_STATUS, 2.0))

STREAM_PERIOD_S = 0.05
# How long setpoints flow before OFFBOARD is asked for.
STREAM_S = 1.0
CLIMB_M_S, SLOWEST_CLIMB_M_S, CLIMB_GAIN_1_S = 1.0, 0.3, 0.8
ALTITUDE_TOLERANCE_M = 0.3
# Longest time from a command that was accepted to its effect, and from arming to the altitude for each metre.
EFFECT_S, CLIMB_S, CLIMB_S_PER_M = 15.0, 20.0, 5.0


class Px4:
    """Decides what to send to one PX4 multicopter.

    Args:
        vehicle: its facts, kept up to date by the caller.
        ready_timeout_s: longest wait for readiness before a take-off.
    """

    intervals = INTERVALS
    streams = True

    def __init__(self, vehicle: Vehicle, ready_timeout_s: float) -> None:
        self._vehicle = vehicle
        self._ready_timeout_s = ready_timeout_s
        self._task = Undertaking(vehicle)
        self._streamed_s = -math.inf
        self._was_offboard = False

    # -- status ------------------------------------------------------------------------------
    @property
    def mode(self) -> str:
        """Name of the flight mode, '' before the first heartbeat."""
        number = self._vehicle.custom_mode
        return '' if number is None else MODES.get(number, f'mode {number:#010x}')

    def missing(self) -> tuple[str, ...]:
        """What the autopilot still lacks before it may be armed."""
        health = self._vehicle.health
        position = () if self._vehicle.motion is not None else ('position',)
        return position if health is not None and health & mav.HEALTH_PREARM_CHECK else (*position, 'pre-arm check')

    @property
    def ready(self) -> bool:
        """The autopilot may be armed, or is."""
        return self._vehicle.armed or not self.missing()

    @property
    def commandable(self) -> bool:
        """Velocity setpoints would be obeyed, given a living link."""
        task = self._task.request
        return (
            self._vehicle.custom_mode == OFFBOARD and self._vehicle.armed and self._vehicle.in_air
            and (task is None or task.goal not in (Goal.TAKEOFF, Goal.LAND))
        )

    @property
    def waiting_for(self) -> str:
        """What is missing for the next step, '' if nothing."""
        if self._task.request is not None:
            in_ready = self._task.phase is Phase.READY and bool(self.missing())
            return ', '.join(self.missing()) if in_ready else str(self._task.phase.value)
        if self._task.failure:
            return self._task.failure
        if not self.ready:
            return ', '.join(self.missing())
        if self._vehicle.armed and self._vehicle.in_air and self._vehicle.custom_mode != OFFBOARD:
            who = f'; {self.mode} was set by someone else or a failsafe' if self._was_offboard else ''
            return f'OFFBOARD mode (it is {self.mode}{who}; mavlink_bridge/takeoff takes over)'
        return ''

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
        self._was_offboard = self._vehicle.armed and (self._was_offboard or self._vehicle.custom_mode == OFFBOARD)
        if self.commandable:
            self._task.failure = ''  # However it came to fly, it does.
        if self._task.request is None:
            return []
        if self._task.phase is Phase.MODE and now_s - self._task.phase_s > EFFECT_S:
            self._task.give_up(f'no {self._task.phase.value} after {EFFECT_S:g} s')
            return []
        steps = {
            Phase.READY: self._await_ready, Phase.STREAM: self._begin_stream, Phase.MODE: self._set_mode,
            Phase.ARM: self._arm, Phase.CLIMB: self._climb, Phase.DOWN: self._come_down,
        }
        return steps[self._task.phase](self._task.request, now_s)

    def _answer_of(self, what: str, now_s: float) -> Progress:
        return self._task.answer_of(what, () if self.ready else self.missing(), now_s)

    def _stream(self, now_s: float, up_m_s: float = 0.0) -> list[Message]:
        if self._vehicle.target is None or now_s - self._streamed_s < STREAM_PERIOD_S * 0.9:
            return []
        self._streamed_s = now_s
        return [mav.velocity_setpoint(self._vehicle.target, int(now_s * 1000), (0.0, 0.0, up_m_s), 0.0)]

    def _await_ready(self, request: Request, now_s: float) -> list[Message]:
        if self.ready:
            self._task.enter(Phase.STREAM, now_s)
            return self._stream(now_s)
        self._task.wait_ready(self.missing(), self._ready_timeout_s, now_s)
        return []

    def _begin_stream(self, request: Request, now_s: float) -> list[Message]:
        if now_s - self._task.phase_s >= STREAM_S:
            self._task.enter(Phase.MODE, now_s)
        return self._stream(now_s)

    def _set_mode(self, request: Request, now_s: float) -> list[Message]:
        if request.goal is Goal.LAND:
            return self._set_land(request, now_s)
        if self._vehicle.custom_mode == OFFBOARD:
            if self._vehicle.armed and self._vehicle.in_air:
                request.answer(True, 'in the air already; OFFBOARD mode is set')
                self._task.finish(failed=False)
            else:
                self._task.enter(Phase.ARM, now_s)
            return self._stream(now_s)
        self._answer_of('OFFBOARD mode', now_s)
        if self._task.request is None:
            return []
        return [*self._stream(now_s), *self._task.send(now_s, mav.CMD_SET_MODE, 1, MAIN_OFFBOARD)]

    def _set_land(self, request: Request, now_s: float) -> list[Message]:
        """Without a stream from here on, so that nothing leads back to OFFBOARD."""
        if self._vehicle.custom_mode == LAND:
            request.answer(True, 'landing')
            self._task.enter(Phase.DOWN, now_s)
            return []
        self._answer_of('LAND mode', now_s)
        if self._task.request is None:
            return []
        unused = math.nan
        return self._task.send(now_s, mav.CMD_LAND, 0.0, 0.0, 0.0, unused, unused, unused, unused)

    def _arm(self, request: Request, now_s: float) -> list[Message]:
        wanted = request.goal is not Goal.DISARM
        stream = self._stream(now_s) if request.goal is Goal.TAKEOFF else []
        done = self._vehicle.armed == wanted or self._answer_of(request.goal.value, now_s) is Progress.ACCEPTED
        if self._task.request is None:
            return []
        if not done:
            return [*stream, *self._task.send(now_s, mav.CMD_ARM, float(wanted))]
        if request.goal is Goal.TAKEOFF:
            request.answer(True, f'taking off to {request.altitude_m:g} m')
            self._task.enter(Phase.CLIMB, now_s)
            return stream
        request.answer(True, 'armed' if wanted else 'disarmed')
        self._task.finish(failed=False)
        return []

    def _climb(self, request: Request, now_s: float) -> list[Message]:
        if self._vehicle.custom_mode != OFFBOARD:
            self._task.give_up(f'{self.mode} was set by someone else or a failsafe')
            return []
        if now_s - self._task.phase_s > CLIMB_S + CLIMB_S_PER_M * request.altitude_m:
            self._task.give_up(f'the altitude was not reached in time{self._task.said}')
            return []
        motion = self._vehicle.motion
        left_m = request.altitude_m - (motion.position_enu_m[2] if motion is not None else 0.0)
        if left_m <= ALTITUDE_TOLERANCE_M and self._vehicle.in_air and self._vehicle.armed:
            self._task.finish(failed=False)
            return self._stream(now_s)
        return self._stream(now_s, min(CLIMB_M_S, max(SLOWEST_CLIMB_M_S, CLIMB_GAIN_1_S * left_m)))

    def _come_down(self, request: Request, now_s: float) -> list[Message]:
        if not self._vehicle.armed:
            self._task.finish(failed=False)
        elif self._vehicle.custom_mode != LAND:
            self._task.give_up(f'{self.mode} was set by someone else')
        return []
