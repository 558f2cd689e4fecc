"""What has to be there before a policy's flight can begin: the policy, poses, a vehicle; and goals that wait for them."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from rclpy.node import Node
from rclpy.task import Future

from advise_msgs.action import Fly
from advise_msgs.msg import Policy
from advise_ros.config import PolicyConfig
from advise_ros.core.errors import InputError
from advise_ros.core.flight.policy_flight import FlightPlan, check_start
from advise_ros.core.flight.vehicle_state import VehicleState, why_no_commands
from advise_ros.core.grid.differences import what_differs
from advise_ros.core.grid.grid import Grid
from advise_ros.ros.convert import grid_from_msg
from advise_ros.ros.pose_intake import PoseIntake
from advise_ros.ros.simulated_clock import ClockWatch


class GoalRefusal(NamedTuple):
    """Why a goal cannot be flown: a code of advise_msgs/action/Fly and one sentence."""

    error_code: int
    message: str


class PolicyCache:
    """Keeps the newest good policy.

    Attributes:
        config: how flights are flown.
        version: of the policy kept, 0 before the first one.
        problem: why there is none or why the last one that came is not flown; empty when all is well.
    """

    def __init__(self, config: PolicyConfig, grid: Grid | None) -> None:
        """With a grid, only policies on that grid are kept."""
        self.config, self._grid = config, grid
        self._plan: FlightPlan | None = None
        self.version = 0
        self.problem = 'waiting for a policy on advise/policy'

    def put(self, message: Policy) -> None:
        """Take a policy, or say in `problem` why not."""
        try:
            grid = grid_from_msg(message.grid)
            if self._grid is not None and grid != self._grid:
                raise InputError(
                    f'its grid is not that of grid_file ({what_differs(grid, self._grid)}); start all nodes with the same file'
                )
            self._plan = FlightPlan(grid, tuple(int(action) for action in message.greedy))
        except InputError as problem:
            self.problem = f'policy {message.version} is not flown: {problem}'
            return
        self.version, self.problem = int(message.version), ''

    def missing(self, version: int) -> str:
        """Why a version (0: any) cannot be flown; empty when it can."""
        if self._plan is None:
            return self.problem
        if version not in (0, self.version):
            return f'policy {version} is asked for, {self.version} is the newest one here'
        return ''

    def plan(self, goal: Fly.Goal) -> FlightPlan:
        """How the kept policy is flown for a goal.

        Raises:
            InputError: there is no policy, or the start cell is wrong.
        """
        if self._plan is None:
            raise InputError(self.problem)
        return FlightPlan(
            self._plan.grid, self._plan.greedy, int(goal.start_cell), int(goal.step_budget),
            self.config.step_budget_factor, self.config.stop_on_loop, self.config.centre_first, self.config.start_reach_m,
        )


class Readiness:
    """A time, a policy, a fresh pose, and a vehicle that takes commands.

    Attributes:
        policies: the newest one.
        poses: the pose.
        vehicle: None where no bridge publishes it.
    """

    def __init__(self, node: Node, config: PolicyConfig, grid: Grid | None) -> None:
        """With a grid, only policies on that grid are flown."""
        self._clock = ClockWatch(node)
        self.policies = PolicyCache(config, grid)
        self.poses = PoseIntake(node, config.pose_timeout_s)
        self.vehicle: VehicleState | None = None

    def missing(self, goal: Fly.Goal) -> GoalRefusal | None:
        """What has not arrived (yet); None when all is there."""
        lacking = (
            (Fly.Result.NO_CLOCK, self._clock.problem), (Fly.Result.NO_POLICY, self.policies.missing(goal.policy_version)),
            (Fly.Result.NO_POSE, self.poses.missing), (Fly.Result.NO_VEHICLE, self._vehicle_problem),
        )
        return next((GoalRefusal(code, sentence) for code, sentence in lacking if sentence), None)

    @property
    def _vehicle_problem(self) -> str:
        if self.vehicle is None or self.vehicle.commandable:
            return ''
        why = why_no_commands(self.vehicle) if self.vehicle.in_air else self.vehicle.waiting_for or 'take off first'
        return f'the vehicle takes no commands: {why}'

    def refusal(self, goal: Fly.Goal) -> GoalRefusal | None:
        """Why a flight cannot begin now; None when it can."""
        if missing := self.missing(goal):
            return missing
        assert self.poses.pose is not None
        try:
            check_start(self.policies.plan(goal), self.poses.pose.position_enu_m)
        except InputError as problem:
            return GoalRefusal(Fly.Result.NO_START, str(problem))
        return None

    @property
    def complaint(self) -> str:
        """What to warn of, whatever is to be flown."""
        return '; '.join(filter(None, (self._clock.problem, self.policies.problem, self.poses.complaint)))


# A goal waits this long for a policy or a pose before it is refused.
START_PATIENCE_S = 1.0


class _Waiting(NamedTuple):
    goal: Fly.Goal
    until_s: float
    over: Future


class GoalPatience:
    """Lets goals wait a little; `look` must be called meanwhile.

    Args:
        missing: what a goal lacks now, None if nothing.
    """

    def __init__(self, missing: Callable[[Fly.Goal], GoalRefusal | None]) -> None:
        self._missing = missing
        self._waiting: list[_Waiting] = []

    @property
    def waits(self) -> bool:
        """Some goal does."""
        return bool(self._waiting)

    async def wait(self, goal: Fly.Goal) -> None:
        """Until nothing is missing any more, or for START_PATIENCE_S of steady time."""
        waiting = _Waiting(goal, time.monotonic() + START_PATIENCE_S, Future())
        self._waiting.append(waiting)
        await waiting.over

    def look(self, now_s: float) -> None:
        """End the waits that are over.

        Args:
            now_s: steady time.
        """
        for waiting in self._waiting:
            if now_s > waiting.until_s or not self._missing(waiting.goal):
                waiting.over.set_result(None)
        self._waiting = [waiting for waiting in self._waiting if not waiting.over.done()]

    def give_up(self) -> None:
        """End all waits now."""
        for waiting in self._waiting:
            waiting.over.set_result(None)
        self._waiting.clear()
