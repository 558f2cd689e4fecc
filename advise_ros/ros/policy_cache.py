"""The newest policy that can be flown, and why one cannot."""

from __future__ import annotations

from advise_msgs.action import Fly
from advise_msgs.msg import Policy
from advise_ros.config import PolicyConfig
from advise_ros.core.errors import InputError
from advise_ros.core.flight.policy_flight import FlightPlan
from advise_ros.core.grid.differences import what_differs
from advise_ros.core.grid.grid import Grid
from advise_ros.ros.convert import grid_from_msg


class PolicyCache:
    """Keeps the newest good policy.

    Attributes:
        version: of the policy kept, 0 before the first one.
        problem: why there is none or why the last one that came is not flown; empty when all is well.
    """

    def __init__(self, config: PolicyConfig, grid: Grid | None) -> None:
        """With a grid, only policies on that grid are kept."""
        self._config, self._grid = config, grid
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
            self._config.step_budget_factor, self._config.stop_on_loop, self._config.centre_first, self._config.start_reach_m,
        )
