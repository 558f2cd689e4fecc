"""One goal on its way through phases: what every autopilot's state machine shares."""

from __future__ import annotations

from enum import Enum

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.requests import Goal, GoalRequest, Progress, Repeated
from advise_ros.mavlink.vehicle import Vehicle


class GoalPhase(Enum):
    """Where a goal stands; the value says what is waited for."""

    READY = 'readiness'
    STREAM = 'setpoint stream'
    MODE = 'flight mode'
    ARM = 'arming'
    TAKEOFF = 'take-off'
    CLIMB = 'take-off altitude'
    DOWN = 'touch-down'
    SETTLE = 'its setpoints to be ours'


class GoalTask:
    """The goal under way, its phase and the phase's repeated command; at most one at a time.

    Attributes:
        request: the goal, None when there is none.
        phase, phase_s: where it stands and since when (monotonic).
        failure: why the last goal failed, '' if it did not.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        self.request: GoalRequest | None = None
        self.phase = GoalPhase.READY
        self.phase_s = 0.0
        self.failure = ''
        self._vehicle = vehicle
        self._command: Repeated | None = None

    def begin(self, request: GoalRequest, phase: GoalPhase) -> None:
        """Take on a goal; one that is under way is given up."""
        if self.request is not None:
            self.finish(f'{self.request.goal.value} given up: {request.goal.value} was asked', failed=False)
        self.request, self.failure = request, ''
        self.enter(phase, request.begun_s)

    def enter(self, phase: GoalPhase, now_s: float) -> None:
        """Go on to a phase.

        Args:
            phase: the next one.
            now_s: steady time.
        """
        self.phase, self.phase_s, self._command = phase, now_s, None

    def finish(self, message: str = '', *, failed: bool = True) -> None:
        """End the goal; the message is its reply if it had none."""
        request, self.request, self._command = self.request, None, None
        if request is not None:
            request.answer(not failed, message)
        self.failure = message if failed else ''

    def give_up(self, why: str) -> None:
        """End the goal, if there is one, as a failure."""
        if self.request is not None:
            self.finish(f'{self.request.goal.value} given up: {why}')

    def wait_ready(self, missing: tuple[str, ...], timeout_s: float, now_s: float) -> None:
        """Say what a take-off still waits for, or give it up after a while.

        Args:
            missing: what is not ready, in words.
            timeout_s: after which the goal fails.
            now_s: steady time.
        """
        waiting = ', '.join(missing)
        if self.request is None:
            return
        if now_s - self.request.begun_s > timeout_s:
            self.give_up(f'not ready after {timeout_s:g} s; still waiting for: {waiting}{self.said}')
        else:
            self.request.answer(True, f'take-off begins when the autopilot is ready; still waiting for: {waiting}')

    def send(self, now_s: float, number: int, *params: float) -> list[Message]:
        """The phase's command, when it is time to send it.

        Args:
            now_s: steady time.
            number: of the try.
        """
        if self._vehicle.target is None:
            return []
        if self._command is None:
            self._command = Repeated(mav.command(self._vehicle.target, number, *params))
        return self._command.due(now_s)

    def answer_of(self, what: str, missing: tuple[str, ...], now_s: float) -> Progress:
        """How the phase's command stands; a refusal ends the goal, in words.

        Args:
            what: the command, in words.
            missing: what the autopilot says is not ready.
            now_s: steady time.
        """
        if self._command is None:
            return Progress.WAITING
        progress = self._command.progress(self._vehicle, now_s)
        if progress in (Progress.REFUSED, Progress.SILENT):
            lacking = f' (still waiting for: {", ".join(missing)})' if missing else ''
            self.finish(f'{what} refused: {self._command.why(self._vehicle)}{lacking}')
        return progress

    @property
    def goal(self) -> str:
        """Name of the goal under way, '' if there is none."""
        return '' if self.request is None else self.request.goal.value

    def goal_is(self, *goals: Goal) -> bool:
        """Whether one of these is under way."""
        return self.request is not None and self.request.goal in goals

    @property
    def in_own_mode(self) -> bool:
        """A take-off or take-over is past the change of mode: from here on another mode was set by another sender."""
        past = (GoalPhase.ARM, GoalPhase.TAKEOFF, GoalPhase.CLIMB, GoalPhase.SETTLE)
        return self.goal_is(Goal.TAKEOFF, Goal.TAKE_OVER) and self.phase in past

    @property
    def said(self) -> str:
        """The autopilot's last text as the end of a sentence."""
        return f'; the autopilot says: {self._vehicle.text}' if self._vehicle.text else ''
