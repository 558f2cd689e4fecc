"""What the state machines of all autopilots share: who owns the vehicle, and one goal on its way through phases."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import ClassVar

from advise_ros.core.units import Vector
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.ownership import FailsafeWatch, Holder, Ownership
from advise_ros.mavlink.refusals import VehicleSituation, refusal
from advise_ros.mavlink.requests import Goal, GoalRequest, Progress
from advise_ros.mavlink.task import GoalPhase, GoalTask
from advise_ros.mavlink.vehicle import Vehicle

# Longest time from a command that was accepted to its effect.
EFFECT_S = 15.0

Step = Callable[[GoalRequest, float], list[Message]]


class Machine(ABC):
    """Decides what to send to one autopilot: facts and monotonic time in, messages and status out.

    A goal (arm, take-off, landing, take-over) goes through phases, each with one function in `steps`. The vehicle
    is ours once it is armed in `own_mode` by a take-off or take-over that was asked of us, and others' in every
    other case: it was armed before us, another mode is seen without our asking, or (ArduPilot) its target is not
    what we sent. Then every goal ends and no setpoint is sent, and no return to `own_mode` changes that.

    Args:
        vehicle: its facts, kept up to date by the caller.
        ready_timeout_s: longest wait for readiness before a take-off.
    """

    modes: ClassVar[Mapping[int, str]]
    own_mode: ClassVar[int]
    land_mode: ClassVar[int]
    # DO_SET_MODE's parameters behind the first for each mode that we ask for.
    mode_params: ClassVar[Mapping[int, tuple[int, ...]]]
    # (message id, rate in Hz) to ask for, beside position and attitude.
    intervals: ClassVar[tuple[tuple[int, float], ...]]
    # Setpoints must never pause while it is commandable.
    streams: ClassVar[bool]
    # Sends its texts only to components whose heartbeat is that of a ground station.
    texts_to_ground_stations_only: ClassVar[bool] = False

    def __init__(self, vehicle: Vehicle, ready_timeout_s: float) -> None:
        self._vehicle = vehicle
        self._ready_timeout_s = ready_timeout_s
        self._task = GoalTask(vehicle)
        self._steps = self.steps()
        self._ownership = Ownership()
        self._failsafe = FailsafeWatch()
        self._was_armed = False

    # -- what differs ------------------------------------------------------------------------
    @abstractmethod
    def steps(self) -> dict[GoalPhase, Step]:
        """What is done in each phase."""

    @abstractmethod
    def missing(self) -> tuple[str, ...]:
        """What the autopilot still lacks before it may be armed."""

    @property
    @abstractmethod
    def airborne(self) -> bool:
        """It flies, and is not in a manoeuvre of its own that a setpoint would end."""

    @abstractmethod
    def _armed(self, request: GoalRequest, now_s: float) -> list[Message]:
        """Go on with a take-off whose arming was accepted."""

    @abstractmethod
    def _begin_own(self, request: GoalRequest, now_s: float) -> list[Message]:
        """Go on with a take-over whose mode is set."""

    @abstractmethod
    def farewell(self, now_s: float) -> list[Message]:
        """What to send last when we leave an armed vehicle that is ours."""

    # -- status ------------------------------------------------------------------------------
    @property
    def mode(self) -> str:
        """Name of the flight mode, '' before the first heartbeat."""
        number = self._vehicle.custom_mode
        return '' if number is None else self.modes.get(number, f'mode {number:#x}')

    @property
    def own(self) -> str:
        """Name of the mode in which setpoints are obeyed."""
        return self.modes[self.own_mode]

    @property
    def ready(self) -> bool:
        """The autopilot may be armed, or is."""
        return self._vehicle.armed or not self.missing()

    @property
    def holder(self) -> Holder:
        """Who owns the armed vehicle."""
        return self._ownership.holder

    @property
    def owner(self) -> str:
        """As VehicleStatus has it: 'ours', 'others', '' while it is disarmed."""
        return self.holder.value if self.holder is not Holder.NOBODY else ''

    @property
    def failsafe(self) -> str:
        """The autopilot's failsafe that has it, '' if none is known of."""
        return self._failsafe.name

    @property
    def commandable(self) -> bool:
        """Velocity setpoints would be obeyed, given a living link."""
        return (
            self._vehicle.custom_mode == self.own_mode and self._vehicle.armed and self.airborne
            and self.holder is Holder.OURS and not self._task.goal_is(Goal.TAKEOFF, Goal.LAND, Goal.TAKE_OVER)
        )

    @property
    def progressing(self) -> bool:
        """A goal is under way, and waits for nothing but its own effect."""
        return self._task.request is not None and self._task.phase is not GoalPhase.READY

    @property
    def waiting_for(self) -> str:
        """What is missing for the next step, '' if nothing."""
        if self._task.request is not None:
            lacking = ', '.join(self.missing()) if self._task.phase is GoalPhase.READY else ''
            return lacking or str(self._task.phase.value)
        if self._task.failure:
            return f'another try: {self._task.failure}{self._way_back()}'
        return '' if self.commandable else self._waiting_idle()

    def _waiting_idle(self) -> str:
        if not self.ready:
            return ', '.join(self.missing())
        away = self._vehicle.armed and self._vehicle.in_air and self.holder is Holder.OTHERS
        return f'mavlink_bridge/take_over: {self._lost}' if away else ''

    def _way_back(self) -> str:
        """How a person gives us a vehicle that flies without us, as the end of a sentence."""
        vehicle = self._vehicle
        away = self.holder is Holder.OTHERS and vehicle.armed and vehicle.in_air
        return '; mavlink_bridge/take_over takes it over' if away else ''

    @property
    def _lost(self) -> str:
        """Why an armed vehicle is not ours, and in which mode it is."""
        return f'{self._has_it or self._ownership.why} (it is in {self.mode})'

    @property
    def _has_it(self) -> str:
        return f'the failsafe "{self.failsafe}" has it' if self.failsafe else ''

    def wanted(self) -> tuple[tuple[int, float], ...]:
        """(message id, rate in Hz) to ask for now."""
        return self.intervals

    # -- requests ----------------------------------------------------------------------------
    def ask(self, request: GoalRequest) -> None:
        """Begin a goal, or refuse it; one that is under way is given up."""
        task, armed = self._task, self._vehicle.armed
        why = refusal(request.goal, VehicleSituation(
            task, self._vehicle, self.holder is Holder.OURS, self.commandable, self.waiting_for, self._lost, self._has_it,
        ))
        if why:
            request.answer(False, f'{request.goal.value} refused: {why}')
            return
        self._was_armed = armed
        given_up = f'; the {task.goal} is given up' if task.request is not None else ''
        task.begin(request, self._first_phase(request.goal))
        if not armed and (request.goal is Goal.LAND or (request.goal is Goal.DISARM and given_up)):
            task.finish(f'disarmed already{given_up}', failed=False)

    def _first_phase(self, goal: Goal) -> GoalPhase:
        if goal is Goal.TAKE_OVER:
            return GoalPhase.STREAM if self.streams else GoalPhase.MODE
        return {Goal.TAKEOFF: GoalPhase.READY, Goal.LAND: GoalPhase.MODE}.get(goal, GoalPhase.ARM)

    def lose_link(self) -> None:
        """The link is lost: goals end, nothing is repeated when it comes back."""
        self._task.give_up('the link was lost')

    def let_go(self) -> None:
        """We leave it, after `farewell`: only a landing goes on."""
        if self._task.request is not None and self._task.request.goal is not Goal.LAND:
            self._task.give_up('the bridge was deactivated')

    def observe(self, message: Message, now_s: float) -> None:
        """A message of the autopilot has arrived; its facts are taken in already.

        Args:
            message: of the autopilot.
            now_s: steady time.
        """
        return

    # -- setpoints ---------------------------------------------------------------------------
    def setpoint(
        self, target: tuple[int, int], velocity_enu_m_s: Vector, yaw_rate_rad_s: float, now_s: float, doubt: str,
    ) -> Message:
        """A velocity as this autopilot is to be asked for it.

        Args:
            target: system and component id.
            velocity_enu_m_s: (east, north, up).
            yaw_rate_rad_s: counter-clockwise.
            now_s: steady time.
            doubt: why the position is not to be trusted, '' if it is.
        """
        return mav.velocity_setpoint(target, int(now_s * 1000), velocity_enu_m_s, yaw_rate_rad_s)

    # -- steps -------------------------------------------------------------------------------
    def step(self, now_s: float) -> list[Message]:
        """What to send now.

        Args:
            now_s: steady time.
        """
        self._failsafe.look(self._vehicle, self.mode, now_s, own=self._vehicle.custom_mode == self.own_mode)
        self._watch_holder()
        if self.commandable:
            self._task.failure = ''  # However it came to fly, it does.
        if self._task.request is None:
            return []
        if self._task.phase in (GoalPhase.MODE, GoalPhase.TAKEOFF) and now_s - self._task.phase_s > EFFECT_S:
            self._task.give_up(f'no {self._task.phase.value} after {EFFECT_S:g} s')
            return []
        return self._steps[self._task.phase](self._task.request, now_s)

    def _watch_holder(self) -> None:
        vehicle, task = self._vehicle, self._task
        away = vehicle.custom_mode != self.own_mode
        if not vehicle.armed:
            self._ownership.rest()
        elif task.in_own_mode and not away and self.holder is not Holder.OURS:
            self._claim()
        elif self.holder is Holder.NOBODY:
            self._ownership.lose('somebody else flies it, or a bridge before this one')
        elif self.holder is Holder.OURS and away and not task.goal_is(Goal.LAND):
            self._ownership.lose(self._mode_set)
        if task.in_own_mode and away:
            task.give_up(self._mode_set)
        elif task.goal_is(Goal.TAKEOFF) and not task.in_own_mode and vehicle.armed and (vehicle.in_air or not self._was_armed):
            task.give_up('somebody else armed it')
        elif task.goal_is(Goal.TAKE_OVER) and not vehicle.armed:
            task.give_up('it was disarmed')

    def _claim(self) -> None:
        self._ownership.claim()

    @property
    def _mode_set(self) -> str:
        """Another mode was set without our asking."""
        by = f'the failsafe "{self.failsafe}"' if self.failsafe else 'someone else or a failsafe'
        return f'{self.mode} was set by {by}'

    def _answer_of(self, what: str, now_s: float) -> Progress:
        return self._task.answer_of(what, () if self.ready else self.missing(), now_s)

    def _set_mode(self, request: GoalRequest, now_s: float) -> list[Message]:
        wanted = self.land_mode if request.goal is Goal.LAND else self.own_mode
        if self._vehicle.custom_mode == wanted:
            return self._mode_is_set(request, now_s)
        self._answer_of(f'{self.modes[wanted]} mode', now_s)
        if self._task.request is None:
            return []
        return self._task.send(now_s, mav.CMD_SET_MODE, 1, *self.mode_params[wanted])

    def _mode_is_set(self, request: GoalRequest, now_s: float) -> list[Message]:
        if request.goal is Goal.LAND:
            request.answer(True, 'landing')
            self._task.enter(GoalPhase.DOWN, now_s)
            return []
        if request.goal is Goal.TAKE_OVER:
            return self._begin_own(request, now_s)
        self._task.enter(GoalPhase.ARM, now_s)
        return self._steps[GoalPhase.ARM](request, now_s)

    def _arm(self, request: GoalRequest, now_s: float) -> list[Message]:
        wanted = request.goal is not Goal.DISARM
        done = self._vehicle.armed == wanted or self._answer_of(request.goal.value, now_s) is Progress.ACCEPTED
        if self._task.request is None:
            return []
        if not done:
            return self._task.send(now_s, mav.CMD_ARM, float(wanted))
        if request.goal is Goal.TAKEOFF:
            return self._armed(request, now_s)
        request.answer(True, 'armed' if wanted else 'disarmed')
        self._task.finish(failed=False)
        return []

    def _come_down(self, request: GoalRequest, now_s: float) -> list[Message]:
        vehicle = self._vehicle
        if not vehicle.armed:
            self._task.finish(failed=False)
        elif vehicle.custom_mode != self.land_mode and vehicle.heartbeat_at_s >= vehicle.mode_at_s:
            # Not before a heartbeat: PX4 reports the mode at once, and only there that it has disarmed.
            self._task.give_up(self._mode_set)
            self._ownership.lose(self._mode_set)
        return []
