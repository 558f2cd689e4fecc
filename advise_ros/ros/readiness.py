"""What has to be there before a policy's flight can begin."""

from __future__ import annotations

from rclpy.node import Node

from advise_msgs.action import Fly
from advise_ros.config import PolicyConfig
from advise_ros.core.errors import InputError
from advise_ros.core.flight.policy_flight import check_start
from advise_ros.core.flight.vehicle_state import VehicleState, why_no_commands
from advise_ros.core.grid.grid import Grid
from advise_ros.ros.clock_watch import ClockWatch
from advise_ros.ros.policy_cache import PolicyCache
from advise_ros.ros.pose_intake import PoseIntake


class Readiness:
    """A time, a policy, a fresh pose, and a vehicle that takes commands.

    Attributes:
        shelf: the policy.
        poses: the pose.
        vehicle: None where no bridge tells of it.
    """

    def __init__(self, node: Node, config: PolicyConfig, grid: Grid | None) -> None:
        """With a grid, only policies on that grid are flown."""
        self._clock = ClockWatch(node)
        self.shelf = PolicyCache(config, grid)
        self.poses = PoseIntake(node, config.pose_timeout_s)
        self.vehicle: VehicleState | None = None

    def missing(self, goal: Fly.Goal) -> str:
        """What has not arrived (yet); empty when all is there."""
        if missing := self._clock.problem or self.shelf.missing(goal.policy_version) or self.poses.missing:
            return missing
        if self.vehicle is not None and not self.vehicle.commandable:
            why = why_no_commands(self.vehicle) if self.vehicle.in_air else self.vehicle.waiting_for or 'take off first'
            return f'the vehicle takes no commands: {why}'
        return ''

    def refusal(self, goal: Fly.Goal) -> str:
        """Why a flight cannot begin now; empty when it can."""
        if missing := self.missing(goal):
            return missing
        assert self.poses.pose is not None
        try:
            check_start(self.shelf.plan(goal), self.poses.pose.position_enu_m)
        except InputError as problem:
            return str(problem)
        return ''

    @property
    def complaint(self) -> str:
        """What to warn of, whatever is to be flown."""
        return '; '.join(filter(None, (self._clock.problem, self.shelf.problem, self.poses.complaint)))
