"""The guard alone, for flights through MAVROS or another bridge."""

from __future__ import annotations

import sys
import time
from dataclasses import replace

from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.timer import Timer
from std_srvs.srv import Trigger

from advise_ros.config import ChecksConfig, GuardConfig
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.guard import rules
from advise_ros.core.guard.fence import Fence, corners_from_text, fence_around
from advise_ros.core.guard.monitor import GuardMonitor, MonitorSettings
from advise_ros.core.units import MAP_FRAME, ZERO
from advise_ros.recording.gridfile import load_grid
from advise_ros.ros import diagnostics, qos, run
from advise_ros.ros.arrival import ArrivalWatch
from advise_ros.ros.change_log import ChangeLog, GuardLog
from advise_ros.ros.convert import stamp_to_ns
from advise_ros.ros.deadline import Deadline
from advise_ros.ros.flying import velocity_command
from advise_ros.ros.managed import ManagedNode
from advise_ros.ros.transform import TransformTopic

FENCE_OFF = 'the fence is off (fence:=off)'
ASKED = 'somebody asked for it'


def load_grid_of(config: ChecksConfig) -> Grid | None:
    """The grid, if one is named.

    Raises:
        InputError: the grid file is wrong.
    """
    return load_grid(config.grid_file) if config.grid_file else None


def limits_of(config: ChecksConfig, grid: Grid | None) -> rules.Limits:
    """What commands must keep to.

    Raises:
        InputError: there is no fence and `fence` is not off, it is no polygon, or its altitude is unknown.
    """
    return rules.Limits(
        max_speed_m_s=config.max_speed_m_s, max_climb_m_s=config.max_climb_m_s,
        max_yaw_rate_rad_s=config.max_yaw_rate_rad_s, braking_m_s2=config.braking_m_s2,
        command_timeout_s=config.command_timeout_s, pose_timeout_s=config.pose_timeout_s,
        reaction_s=reaction_of(config),
        fence=_fence_of(config, grid),
    )


def _fence_of(config: ChecksConfig, grid: Grid | None) -> Fence | None:
    if config.fence == 'off':
        return None
    if grid is None and not config.fence_polygon:
        raise InputError("there is no fence; name one by 'grid_file' or 'fence_polygon', or fly without by fence:=off")
    around = None if grid is None else fence_around(grid, config.fence_margin_m, config.altitude_band_m)
    if config.fence_low_m < config.fence_high_m and around is not None:
        around = around._replace(low_m=config.fence_low_m, high_m=config.fence_high_m)
    if not config.fence_polygon:
        return around
    corners = corners_from_text(config.fence_polygon)
    if around is not None:
        return around._replace(corners_enu_m=corners)
    if config.fence_low_m >= config.fence_high_m:
        raise InputError("fence_polygon has no altitudes; set 'fence_low_m' and 'fence_high_m', or 'grid_file'")
    return Fence(corners, config.fence_low_m, config.fence_high_m)


def monitor_of(config: ChecksConfig, limits: rules.Limits, *, lifts: bool = False) -> LiveMonitor:
    """The guard with its memory; `lifts`: it only commands a vehicle that is in the air."""
    return LiveMonitor(limits, MonitorSettings(
        config.max_acceleration_m_s2, config.jump_m, config.latch, config.vehicle_delay_s, config.return_inside, lifts,
    ))


class LiveMonitor(GuardMonitor):
    """A guard whose limits may change in flight; what it has received and doubts stays."""

    def keep_to(self, limits: rules.Limits, max_acceleration_m_s2: float) -> None:
        """Other limits from the next verdict on.

        Args:
            limits: with the fence as it was.
            max_acceleration_m_s2: how fast a commanded velocity may grow.
        """
        self._given = limits
        self._settings = replace(self._settings, max_acceleration_m_s2=max_acceleration_m_s2)


def with_speeds(limits: rules.Limits, config: ChecksConfig) -> rules.Limits:
    """The limits with what may be set in flight as the parameters have it now; the fence stays."""
    return replace(
        limits, max_speed_m_s=config.max_speed_m_s, max_climb_m_s=config.max_climb_m_s,
        max_yaw_rate_rad_s=config.max_yaw_rate_rad_s, reaction_s=reaction_of(config),
    )


def reaction_of(config: ChecksConfig) -> float:
    """What was made from a pose flies on until that is too old, and a tick and the vehicle's delay longer; twice that [s]."""
    return 2.0 * (config.pose_timeout_s + 1.0 / config.rate_hz + config.vehicle_delay_s)


def set_rate(timer: Timer, rate_hz: float) -> None:
    """Call a timer so often from now on.

    Args:
        timer: of steady time.
        rate_hz: calls a second.
    """
    timer.timer_period_ns = round(1e9 / rate_hz)


def renewed(monitor: GuardMonitor, config: ChecksConfig, limits: rules.Limits, *, lifts: bool = False) -> LiveMonitor:
    """A guard that has received nothing yet; a stop holds on."""
    fresh = monitor_of(config, limits, lifts=lifts)
    fresh.latched = monitor.latched
    return fresh


def put_command(monitor: GuardMonitor, message: TwistStamped, now_s: float, now_ns: int) -> None:
    """Pass a command that arrives now to the guard.

    Args:
        monitor: the guard.
        message: the command.
        now_s: steady time.
        now_ns: the node's clock.
    """
    linear = message.twist.linear
    command = rules.Command((linear.x, linear.y, linear.z), message.header.frame_id, 0.0, message.twist.angular.z)
    monitor.command(command, now_s, stamp_ns=stamp_to_ns(message.header.stamp), now_ns=now_ns)


def answer_stop(monitor: GuardMonitor, response: Trigger.Response) -> Trigger.Response:
    """Stop until released."""
    monitor.stop(ASKED)
    response.success, response.message = True, f'stopped until released: {monitor.latched}'
    return response


def answer_release(monitor: GuardMonitor, response: Trigger.Response) -> Trigger.Response:
    """End a latched stop."""
    why = monitor.release()
    response.success, response.message = bool(why), f'released; it was stopped: {why}' if why else 'it was not stopped'
    return response


class Guard(ManagedNode):
    """Checks velocity commands: frame, numbers, age, stamps, speed, acceleration and fence; and the pose they rest on.

    Takes `cmd_vel` (TwistStamped, frame map) and `pose` (PoseStamped, frame map or `pose_frame`), and publishes
    what may be flown on `guard/cmd_vel`: at once for each command, and steadily, so that a stale command
    becomes zero velocity. Outside the fence it brings the vehicle back in (`return_inside`), down but never up, as
    it does not know whether the vehicle flies. Before the first command nothing is published. `guard/pose` is the pose in frame
    map. What it changes and why stands in /diagnostics. `guard/stop` stops the vehicle until `guard/release`;
    with `latch` each doubt does (std_srvs/Trigger). A stopped vehicle stands still, outside the fence too.

    A managed node: while it is inactive each command becomes zero velocity.

    Example, with MAVROS:
      ros2 run advise_ros guard --ros-args -p grid_file:=config/grid_6x6.yaml \\
        -r pose:=/mavros/local_position/pose -r guard/cmd_vel:=/mavros/setpoint_velocity/cmd_vel
    Next: `policy`, `pilot` or `teleop`; ros2 topic echo /diagnostics shows what it changed and why.
    """

    def __init__(self) -> None:
        super().__init__('guard')
        self.config = self.load(GuardConfig)
        self._limits = rules.Limits()
        self._monitor = monitor_of(self.config, self._limits)
        self._arrivals, self._log = ArrivalWatch(), GuardLog(ChangeLog(self.get_logger()))
        self._commanded = False
        self.diagnostics.meter('pose', 'cmd_vel')
        self._checked = self.create_publisher(TwistStamped, 'guard/cmd_vel', qos.COMMAND)
        self._pose = self.create_publisher(PoseStamped, 'guard/pose', qos.SENSOR)
        self._transform = TransformTopic(self, self.config.tf_child_frame)
        self.create_service(Trigger, 'guard/stop', lambda _, response: answer_stop(self._monitor, response))
        self.create_service(Trigger, 'guard/release', lambda _, response: answer_release(self._monitor, response))
        self._tick = self.create_timer(
            1.0 / self.config.rate_hz, self._publish, clock=Clock(clock_type=ClockType.STEADY_TIME), autostart=False)
        self._late_pose = Deadline(self, self.config.pose_timeout_s, self._publish)
        self._late_command = Deadline(self, self.config.command_timeout_s, self._publish)
        self.autostart(wanted=self.config.autostart)

    # -- life cycle --------------------------------------------------------------------------
    def open_up(self) -> None:
        self._limits = limits_of(self.config, load_grid_of(self.config))
        self._monitor = renewed(self._monitor, self.config, self._limits)
        self._commanded = False
        self._late_pose.wait(self.config.pose_timeout_s)
        self._late_command.wait(self.config.command_timeout_s)
        set_rate(self._tick, self.config.rate_hz)
        self.listen(TwistStamped, 'cmd_vel', self._on_command, qos.COMMAND)
        self.listen(PoseStamped, 'pose', self._on_pose, qos.SENSOR)
        self._tick.reset()

    def changed(self, names: frozenset[str]) -> None:
        self._limits = with_speeds(self._limits, self.config)
        self._monitor.keep_to(self._limits, self.config.max_acceleration_m_s2)
        set_rate(self._tick, self.config.rate_hz)

    def end(self) -> None:
        self._monitor.clear()
        if self._commanded:
            self._pass_on(ZERO, 0.0)

    def close_down(self) -> None:
        for timer in (self._tick, self._late_pose, self._late_command):
            timer.cancel()

    # -- commands ----------------------------------------------------------------------------
    def _on_pose(self, message: PoseStamped, info: dict[str, int]) -> None:
        waited = self._arrivals.waited_s(info)
        if waited > self.config.pose_timeout_s:
            return  # We were held up: it says where the vehicle was long ago.
        at, header = message.pose.position, message.header
        header.frame_id = MAP_FRAME if header.frame_id == self.config.pose_frame else header.frame_id
        now_s, now_ns = time.monotonic() - waited, self.get_clock().now().nanoseconds
        self._monitor.pose((at.x, at.y, at.z), header.frame_id, now_s, stamp_ns=stamp_to_ns(header.stamp), now_ns=now_ns)
        self._late_pose.came(waited)
        self._pose.publish(message)
        if header.frame_id == MAP_FRAME:
            self._transform.publish(message)
        self.diagnostics.tick('pose')

    def _on_command(self, message: TwistStamped) -> None:
        self.diagnostics.tick('cmd_vel')
        self._commanded = True
        if self.active:
            put_command(self._monitor, message, time.monotonic(), self.get_clock().now().nanoseconds)
            self._late_command.came()
        self._publish()

    def _publish(self) -> None:
        """What may be flown now; nothing before the first command, zero velocity before the first while active."""
        now_s = time.monotonic()
        verdict = self._monitor.verdict(now_s) if self._commanded and self.active else None
        if verdict is not None:
            self._pass_on(verdict.velocity_enu_m_s, verdict.yaw_rate_rad_s)
        elif self._commanded:
            self._pass_on(ZERO, 0.0)
        if not self.active:
            return
        said, warns = self._log.look(self._monitor, '' if verdict is None else verdict.reason, now_s)
        sentence = said if verdict is not None else said or self._stopped or 'waiting for cmd_vel'
        self._say(sentence, warns=warns or verdict is None or self._monitor.condition == 'silence')

    @property
    def _stopped(self) -> str:
        return f'stopped until released: {self._monitor.latched}' if self._monitor.latched else ''

    def _pass_on(self, velocity_enu_m_s: rules.Vector, yaw_rate_rad_s: float) -> None:
        message = velocity_command(velocity_enu_m_s, self.get_clock().now().nanoseconds)
        message.twist.angular.z = yaw_rate_rad_s
        self._checked.publish(message)

    def _say(self, reason: str, *, warns: bool) -> None:
        fence = '' if self._limits.fence else FENCE_OFF
        sentence = '; '.join(text for text in (reason, fence) if text)
        self.diagnostics.set(diagnostics.WARN if warns or fence else diagnostics.OK, sentence or 'commands pass')


def main() -> None:
    sys.exit(run.run_node(Guard, GuardConfig))
