"""The guard alone, for people who fly through MAVROS or another bridge."""

from __future__ import annotations

import math
import sys
import time

from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from advise_ros.config import GuardConfig
from advise_ros.core import guard
from advise_ros.core.grid import Grid
from advise_ros.recording.gridfile import load_grid
from advise_ros.ros import diagnostics, parameters, qos, run
from advise_ros.ros.convert import MAP_FRAME, stamp_to_ns
from advise_ros.ros.diagnostics import Diagnostics


def load_limits(config: GuardConfig) -> tuple[guard.Limits, Grid | None]:
    """The guard's limits, and the grid that makes its fence if one is named.

    Raises:
        InputError: the grid file is wrong.
    """
    grid = load_grid(config.grid_file) if config.grid_file else None
    return guard.Limits(
        max_speed_m_s=config.max_speed_m_s, max_climb_m_s=config.max_climb_m_s,
        max_yaw_rate_rad_s=config.max_yaw_rate_rad_s, braking_m_s2=config.braking_m_s2,
        command_timeout_s=config.command_timeout_s, pose_timeout_s=config.pose_timeout_s,
        # What was made from a pose flies on until that is too old, and a tick longer.
        reaction_s=2.0 * (config.pose_timeout_s + 1.0 / config.rate_hz),
        fence=None if grid is None else guard.fence_around(grid, config.fence_margin_m, config.altitude_band_m),
    ), grid


class CommandBox:
    """The last command and when it arrived (monotonic)."""

    def __init__(self, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        self._command: guard.Command | None = None
        self._at_s = -math.inf
        self._newest_ns = 0

    def put(self, message: TwistStamped, now_s: float, now_ns: int) -> None:
        """Keep a command that arrives now, by the monotonic clock and by the node's."""
        if now_s - self._at_s > self._timeout_s:
            self._newest_ns = 0
        stamp_ns = stamp_to_ns(message.header.stamp)
        doubt = guard.stamp_doubt(stamp_ns, self._newest_ns, now_ns)
        if not doubt:
            self._newest_ns = max(self._newest_ns, stamp_ns)
        linear = message.twist.linear
        self._command = guard.Command(
            (linear.x, linear.y, linear.z), message.header.frame_id, 0.0, message.twist.angular.z, doubt,
        )
        self._at_s = now_s

    def clear(self) -> None:
        self._command = None

    def command(self, now_s: float) -> guard.Command | None:
        """The last command with its age, or None before the first one."""
        return None if self._command is None else self._command._replace(age_s=now_s - self._at_s)


class Guard(Node):
    """Checks velocity commands: frame, numbers, age, speed and fence.

    Takes `cmd_vel` (TwistStamped, frame map) and `pose` (PoseStamped, frame map), and publishes what may be
    flown on `guard/cmd_vel`: at once for each command, and steadily, so that a stale command becomes zero
    velocity. Before the first command nothing is published. What it changes and why stands in /diagnostics.

    With MAVROS:
      ros2 run advise_ros guard --ros-args -p grid_file:=config/grid_6x6.yaml \\
        -r pose:=/mavros/local_position/pose -r guard/cmd_vel:=/mavros/setpoint_velocity/cmd_vel
    """

    def __init__(self) -> None:
        super().__init__('guard')
        self.config = parameters.load(self, GuardConfig)
        self._limits, _ = load_limits(self.config)
        self._commands = CommandBox(self.config.command_timeout_s)
        self._pose: tuple[guard.Position, float] | None = None
        self._diagnostics = Diagnostics(self)
        self._checked = self.create_publisher(TwistStamped, 'guard/cmd_vel', qos.COMMAND)
        self.create_subscription(TwistStamped, 'cmd_vel', self._on_command, qos.COMMAND)
        self.create_subscription(PoseStamped, 'pose', self._on_pose, qos.SENSOR)
        self.create_timer(1.0 / self.config.rate_hz, self._on_tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _on_pose(self, message: PoseStamped) -> None:
        at = message.pose.position
        self._pose = guard.Position((at.x, at.y, at.z), message.header.frame_id, 0.0), time.monotonic()

    def _on_command(self, message: TwistStamped) -> None:
        self._commands.put(message, time.monotonic(), self.get_clock().now().nanoseconds)
        self._publish()

    def _on_tick(self) -> None:
        self._publish()

    def _publish(self) -> None:
        now_s = time.monotonic()
        command = self._commands.command(now_s)
        if command is None:
            self._say('waiting for cmd_vel')
            return
        position = None if self._pose is None else self._pose[0]._replace(age_s=now_s - self._pose[1])
        verdict = guard.check(command, position, self._limits)
        message = TwistStamped()
        message.header.frame_id = MAP_FRAME
        message.header.stamp = self.get_clock().now().to_msg()
        linear = message.twist.linear
        linear.x, linear.y, linear.z = verdict.velocity_enu_m_s
        message.twist.angular.z = verdict.yaw_rate_rad_s
        self._checked.publish(message)
        self._say(verdict.reason)

    def _say(self, reason: str) -> None:
        fence = '' if self._limits.fence else 'the fence is off (no grid_file)'
        sentences = [text for text in (reason, fence) if text]
        self._diagnostics.set(diagnostics.WARN if sentences else diagnostics.OK, '; '.join(sentences) or 'commands pass')


def main() -> None:
    sys.exit(run.run_node(Guard, GuardConfig))
