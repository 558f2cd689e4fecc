"""The guard alone, for flights through MAVROS or another bridge."""

from __future__ import annotations

import sys
import time

from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.clock import Clock, ClockType
from std_srvs.srv import Trigger

from advise_ros.config import GuardConfig
from advise_ros.core.guard import rules
from advise_ros.core.units import MAP_FRAME, ZERO
from advise_ros.nodes.checking import FENCE_OFF, CheckingNode, answer_release, answer_stop, load_grid_of, put_command
from advise_ros.ros import diagnostics, qos, run
from advise_ros.ros.arrival import ArrivalWatch
from advise_ros.ros.change_log import ChangeLog, GuardLog
from advise_ros.ros.convert import stamp_to_ns
from advise_ros.ros.deadline import Deadline
from advise_ros.ros.flying import velocity_command
from advise_ros.ros.transform import TransformTopic


class Guard(CheckingNode):
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
        super().__init__('guard', GuardConfig)
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
        self._renew_guard(load_grid_of(self.config))
        self._commanded = False
        self._late_pose.wait(self.config.pose_timeout_s)
        self._late_command.wait(self.config.command_timeout_s)
        self.listen(TwistStamped, 'cmd_vel', self._on_command, qos.COMMAND)
        self.listen(PoseStamped, 'pose', self._on_pose, qos.SENSOR)
        self._tick.reset()

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
