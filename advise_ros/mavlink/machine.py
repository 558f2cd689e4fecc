"""What the state machines of all autopilots share: whose the vehicle is, and one goal on its way through phases."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from enum import Enum
from typing import ClassVar

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.frames import Vector
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.requests import Goal, Progress, Request
from advise_ros.mavlink.undertaking import Phase, Undertaking
from advise_ros.mavlink.vehicle import Vehicle

# Longest time from a command that was accepted to its effect.
EFFECT_S = 15.0

Step = Callable[[Request, float], list[Message]]


class Holder(Enum):
    """Whose the armed vehicle is. Only a take-off that a person asks for leads from OTHERS back to OURS."""

    NOBODY = 'nobody'
    OURS = 'ours'
    OTHERS = 'others'


class Machine(ABC):
    """Decides what to send to one autopilot: facts and monotonic time in, messages and status out.

    A goal (arm, take-off, landing) goes through phases, each with one function in `steps`. The vehicle is
    ours once it is armed in `own_mode` (by our own take-off, where setpoints must stream), and others' as soon
    as another mode is seen without our asking: a person or a failsafe took it. Then every goal ends, no
    setpoint is sent, and no return to `own_mode` changes that: somebody may be flying in that mode by himself.

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
    # Sends its texts only to those who say in their heartbeat that they are a ground station.
    texts_to_ground_stations_only: ClassVar[bool] = False

    def __init__(self, vehicle: Vehicle, ready_timeout_s: float) -> None:
        self._vehicle = vehicle
        self._ready_timeout_s = ready_timeout_s
        self._task = Undertaking(vehicle)
        self._steps = self.steps()
        self._taken = ''
        self._asked_back = False
        self.holder = Holder.NOBODY

    # -- what differs ------------------------------------------------------------------------
    @abstractmethod
    def steps(self) -> dict[Phase, Step]:
        """What is done in each phase."""

    @abstractmethod
    def missing(self) -> tuple[str, ...]:
        """What the autopilot still lacks before it may be armed."""

    @property
    @abstractmethod
    def airborne(self) -> bool:
        """It flies, and is not in a manoeuvre of its own that a setpoint would end."""

    @abstractmethod
    def _armed(self, request: Request, now_s: float) -> list[Message]:
        """Go on with a take-off whose arming was accepted."""

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
    def commandable(self) -> bool:
        """Velocity setpoints would be obeyed, given a living link."""
        task = self._task.request
        return (
            self._vehicle.custom_mode == self.own_mode and self._vehicle.armed and self.airborne
            and self.holder is Holder.OURS and (task is None or task.goal not in (Goal.TAKEOFF, Goal.LAND))
        )

    @property
    def waiting_for(self) -> str:
        """What is missing for the next step, '' if nothing."""
        if self._task.request is not None:
            lacking = ', '.join(self.missing()) if self._task.phase is Phase.READY else ''
            return lacking or str(self._task.phase.value)
        if self._task.failure:
            return f'another try: {self._task.failure}{self._way_back()}'
        return '' if self.commandable else self._waiting_idle()

    def _waiting_idle(self) -> str:
        if not self.ready:
            return ', '.join(self.missing())
        if not (self._vehicle.armed and self._vehicle.in_air):
            return ''
        if self.holder is Holder.OTHERS:
            return f'{self.own} mode (it is {self.mode}; {self._taken}{self._way_back()})'
        if self._vehicle.custom_mode != self.own_mode:
            return f'{self.own} mode (it is {self.mode}{self._way_back()})'
        return ''

    def _way_back(self) -> str:
        """How a person gives us a vehicle that flies without us, as the end of a sentence."""
        vehicle = self._vehicle
        away = self.holder is Holder.OTHERS or vehicle.custom_mode != self.own_mode
        return '; mavlink_bridge/takeoff takes over' if vehicle.armed and vehicle.in_air and away else ''

    # -- requests ----------------------------------------------------------------------------
    def ask(self, request: Request) -> None:
        """Begin a goal; one that is under way is given up."""
        first = {Goal.TAKEOFF: Phase.READY, Goal.LAND: Phase.MODE}
        self._task.begin(request, first.get(request.goal, Phase.ARM))
        if request.goal is Goal.TAKEOFF:
            self._asked_back, self.holder = self.holder is Holder.OTHERS, Holder.NOBODY  # A person gives it to us.
        if request.goal is Goal.LAND and not self._vehicle.armed:
            self._task.finish('disarmed already', failed=False)

    def lose_link(self) -> None:
        """The link is lost: goals end, nothing is repeated when it comes back."""
        self._task.give_up('the link was lost')

    def let_go(self) -> None:
        """We leave it, after `farewell`: only a landing goes on."""
        if self._task.request is not None and self._task.request.goal is not Goal.LAND:
            self._task.give_up('the bridge was deactivated')

    # -- setpoints ---------------------------------------------------------------------------
    def setpoint(
        self, target: tuple[int, int], velocity_enu_m_s: Vector, yaw_rate_rad_s: float, now_s: float, doubt: str,
    ) -> Message:
        """A velocity as this autopilot is to be asked for it; `doubt` is why its position is not to be trusted, '' if it is."""
        return mav.velocity_setpoint(target, int(now_s * 1000), velocity_enu_m_s, yaw_rate_rad_s)

    # -- steps -------------------------------------------------------------------------------
    def step(self, now_s: float) -> list[Message]:
        """What to send now."""
        self._watch_holder()
        if self.commandable:
            self._task.failure = ''  # However it came to fly, it does.
        if self._task.request is None:
            return []
        if self._task.phase in (Phase.MODE, Phase.TAKEOFF) and now_s - self._task.phase_s > EFFECT_S:
            self._task.give_up(f'no {self._task.phase.value} after {EFFECT_S:g} s')
            return []
        return self._steps[self._task.phase](self._task.request, now_s)

    def _watch_holder(self) -> None:
        vehicle, task = self._vehicle, self._task
        if not vehicle.armed:
            self.holder = Holder.NOBODY
        elif vehicle.custom_mode == self.own_mode:
            if self.holder is Holder.NOBODY:
                self._meet()
            self._asked_back = False
        elif self.holder is Holder.OURS and not (task.request is not None and task.request.goal is Goal.LAND):
            self.holder, self._taken = Holder.OTHERS, f'{self.mode} was set by someone else or a failsafe'
        elif self._asked_back and task.request is None:
            self.holder = Holder.OTHERS  # It could not be given back.
        gone = vehicle.custom_mode != self.own_mode or self.holder is Holder.OTHERS
        if gone and task.in_own_mode:
            task.give_up(f'{self.mode} was set by someone else or a failsafe')

    def _meet(self) -> None:
        """It is armed in our mode: ours, unless we would have to stream into a flight that is not of our making."""
        taking_off = self._task.request is not None and self._task.request.goal is Goal.TAKEOFF
        if taking_off or not self.streams:
            self.holder = Holder.OURS
        else:
            self.holder, self._taken = Holder.OTHERS, 'somebody else flies it, or a bridge before this one'

    def _answer_of(self, what: str, now_s: float) -> Progress:
        return self._task.answer_of(what, () if self.ready else self.missing(), now_s)

    def _set_mode(self, request: Request, now_s: float) -> list[Message]:
        wanted = self.land_mode if request.goal is Goal.LAND else self.own_mode
        if self._vehicle.custom_mode == wanted:
            return self._mode_is_set(request, now_s)
        self._answer_of(f'{self.modes[wanted]} mode', now_s)
        if self._task.request is None:
            return []
        return self._task.send(now_s, mav.CMD_SET_MODE, 1, *self.mode_params[wanted])

    def _mode_is_set(self, request: Request, now_s: float) -> list[Message]:
        if request.goal is Goal.LAND:
            request.answer(True, 'landing')
            self._task.enter(Phase.DOWN, now_s)
            return []
        if self._vehicle.armed and self.airborne:
            request.answer(True, f'in the air already; {self.own} mode is set')
            self._task.finish(failed=False)
            return []
        self._task.enter(Phase.ARM, now_s)
        return self._steps[Phase.ARM](request, now_s)

    def _arm(self, request: Request, now_s: float) -> list[Message]:
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

    def _come_down(self, request: Request, now_s: float) -> list[Message]:
        if not self._vehicle.armed:
            self._task.finish(failed=False)
        elif self._vehicle.custom_mode != self.land_mode:
            self._task.give_up(f'{self.mode} was set by someone else or a failsafe')
        return []
