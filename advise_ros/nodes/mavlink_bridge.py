"""The bridge between an autopilot and the graph."""

from __future__ import annotations

import contextlib
import math
import sys
import time

import rclpy
from geometry_msgs.msg import TwistStamped
from rclpy.clock import Clock, ClockType
from std_srvs.srv import Trigger

from advise_ros.config import MavlinkBridgeConfig
from advise_ros.core.errors import InputError
from advise_ros.core.units import MAP_FRAME, ZERO
from advise_ros.mavlink.companion import Companion, Settings, Status
from advise_ros.mavlink.link import AutopilotLink, Link, Received
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.px4_topics import SCHEME
from advise_ros.mavlink.requests import Goal, GoalRequest
from advise_ros.mavlink.signing import optional_key
from advise_ros.mavlink.stamps import NS_PER_MS
from advise_ros.mavlink.vehicle import Attitude, Motion
from advise_ros.nodes.bridge_services import BridgeServices
from advise_ros.nodes.checking import FENCE_OFF, CheckingNode, answer_release, answer_stop, load_grid_of, put_command
from advise_ros.ros import diagnostics, parameters, qos, run
from advise_ros.ros.autopilot_clock import ClockPublisher
from advise_ros.ros.change_log import ChangeLog, GuardLog, VehicleLog
from advise_ros.ros.last_word import before_the_end
from advise_ros.ros.px4_link import Px4Link
from advise_ros.ros.simulated_clock import REMEDY
from advise_ros.ros.vehicle_publisher import STATUS_PERIOD_S, VehiclePublisher

LINK_CLOSED = 'the bridge was cleaned up and its link is closed'


class MavlinkBridge(CheckingNode):
    """MAVLink <-> ROS for one autopilot, and the last guard before the vehicle.

    Publishes `pose` (PoseStamped, ENU, frame map), `vehicle_status` and `battery_state`. Flies `cmd_vel`
    (TwistStamped, frame map) as velocity setpoints while the vehicle is in the air in GUIDED (ArduPilot) or
    OFFBOARD (PX4); every command passes the guard first (see the node guard). A stale command becomes zero
    velocity. A bridge owns nothing that it did not take off or take over: what another pilot flies, a mode that
    somebody else or a failsafe sets, and (ArduPilot) setpoints of somebody else end its commands until
    `mavlink_bridge/take_over` is asked for. Time-outs are in real seconds, also when a simulation runs faster.

    Services: `mavlink_bridge/arm` (std_srvs/SetBool), `mavlink_bridge/takeoff`, `mavlink_bridge/land` and
    `mavlink_bridge/take_over` (std_srvs/Trigger), which commands a vehicle that flies without this bridge. They
    begin the action and say at once whether the autopilot accepts, in its words; one that is refused changes
    nothing. `vehicle_status` shows the progress and the owner. `mavlink_bridge/stop` holds the vehicle at zero velocity until
    `mavlink_bridge/release` (std_srvs/Trigger).

    `url:=px4_dds:` flies a PX4 by its uXRCE-DDS topics (`fmu/out/...`, `fmu/in/...`) instead, with all of this; that takes
    px4_msgs of the firmware's release, and `px4_dds:/px4_1` if its client has a namespace.

    A managed node: to deactivate it in flight makes an ArduPilot stand in GUIDED and a PX4 hold (only take_over
    leads back from there). While it is inactive it publishes the vehicle's state, lands it and disarms it when
    asked, and sends nothing else. Cleaning it up closes the link.

    Example: ros2 run advise_ros mavlink_bridge --ros-args -p url:=udpin:127.0.0.1:14550 -p grid_file:=config/grid_6x6.yaml
    Next: start `recorder`, then take off and fly by `teleop` or `pilot`, or take off by
      ros2 service call mavlink_bridge/takeoff std_srvs/srv/Trigger
    """

    def __init__(self) -> None:
        super().__init__('mavlink_bridge', MavlinkBridgeConfig, lifts=True)
        self._altitude_m = 0.0
        self._companion = Companion(self._settings())
        self._link: AutopilotLink | None = None
        self._started = False
        self._changes = ChangeLog(self.get_logger())
        self._vehicle_log, self._guard_log = VehicleLog(self._changes), GuardLog(self._changes)
        self._reason, self._warns = '', False
        self._diagnosed: tuple[Status, str] | None = None
        self._diagnosed_s = -math.inf
        self._clocks = ClockPublisher(self, self.config.clock)
        self._simulated_time = bool(self.get_parameter('use_sim_time').value)
        self._vehicle_publisher = VehiclePublisher(
            self, simulated_time=self._simulated_time, tf_child_frame=self.config.tf_child_frame,
        )
        self.diagnostics.meter('pose', 'cmd_vel')
        self._make_entities()
        self.autostart(wanted=self.config.autostart)

    def _settings(self) -> Settings:
        config = self.config
        return Settings(
            system_id=config.system_id, component_id=config.component_id, target_system=config.target_system,
            pose_rate_hz=config.pose_rate_hz, heartbeat_timeout_s=config.heartbeat_timeout_s,
            ready_timeout_s=config.ready_timeout_s,
        )

    def _make_entities(self) -> None:
        self._wake = self.create_guard_condition(self._on_link)
        self._requests = BridgeServices(self, self._begin)
        self.create_service(Trigger, 'mavlink_bridge/stop', lambda _, response: answer_stop(self._monitor, response))
        self.create_service(Trigger, 'mavlink_bridge/release', lambda _, response: answer_release(self._monitor, response))
        self._tick = self.create_timer(
            1.0 / self.config.rate_hz, self._on_tick, clock=Clock(clock_type=ClockType.STEADY_TIME), autostart=False)

    # -- life cycle --------------------------------------------------------------------------
    def open_up(self) -> None:
        grid = load_grid_of(self.config)
        self._renew_guard(grid)
        self._altitude_m = self.config.takeoff_altitude_m or (grid.altitude_m if grid else 0.0)
        self._companion = Companion(self._settings())
        self._companion.rest(f'{self.get_fully_qualified_name()} is inactive', time.monotonic())
        self._vehicle_publisher.forget()
        self._link = self._open_link()
        self._started = False
        self.listen(TwistStamped, 'cmd_vel', self._on_command, qos.COMMAND)
        self._tick.reset()

    def _open_link(self) -> AutopilotLink:
        config = self.config
        key = optional_key(config.signing_key_file)
        with parameters.blamed('url'):
            if not config.url.startswith(SCHEME):
                return Link(
                    config.url, baud=config.baud, system_id=config.system_id, component_id=config.component_id, key=key,
                    wake=self._wake_up,
                )
            if key is not None:
                raise InputError(f"it is '{config.url}', and only MAVLink is signed: leave signing_key_file empty or fly by that")
            before_the_end(self._farewell)
            source = config.system_id, config.component_id
            return Px4Link(self, config.url, source=source, pose_rate_hz=config.pose_rate_hz, wake=self._on_link)

    def begin(self) -> None:
        self._monitor.clear()
        self._companion.resume()

    def end(self) -> None:
        """The vehicle stands (ArduPilot) or holds (PX4); its state is still published."""
        self._transmit(self._companion.rest(f'{self.get_fully_qualified_name()} is inactive', time.monotonic()))
        self._monitor.clear()
        self._reason = ''
        self._requests.answer()

    def close_down(self) -> None:
        self._tick.cancel()
        self._close_link()
        self._requests.give_up(LINK_CLOSED)
        self._companion = Companion(self._settings())
        now_s = time.monotonic()
        self._vehicle_publisher.publish_status(self._companion.status(now_s)._replace(waiting_for=LINK_CLOSED), now_s)

    def _close_link(self) -> None:
        if self._link is not None:
            self._link.close()
            self._link = None

    def _wake_up(self) -> None:
        """From the reader's thread; a node that is being shut down needs no waking."""
        if rclpy.ok():
            with contextlib.suppress(RuntimeError):
                self._wake.trigger()

    # -- the link ----------------------------------------------------------------------------
    def _on_link(self) -> None:
        if self._link is not None:
            for received in self._link.poll():
                self._take(self._link, received)
            self._step(self._link, time.monotonic())

    def _take(self, link: AutopilotLink, received: Received) -> None:
        vehicle, bounds = self._companion.vehicle, self._companion.timesync.bounds
        motion, battery, text = vehicle.motion, vehicle.battery, vehicle.text
        if not self._companion.observe(received.message, received.at_s, received.source):
            return
        link.answer_to(received.source)
        self._clocks.take(received.message)
        if self._companion.timesync.bounds is not bounds and self._companion.timesync.bounds is not None:
            self._vehicle_publisher.stamper.bounded(self._companion.timesync.bounds, received.at_s)
            self._monitor.clock_bounds(*self._companion.timesync.bounds, received.at_s)
        if vehicle.motion is not motion and vehicle.motion is not None:
            motion, boot_ns = vehicle.motion, vehicle.motion.time_boot_ms * NS_PER_MS
            self._monitor.pose(motion.position_enu_m, MAP_FRAME, motion.at_s, stamp_ns=boot_ns, doubt=vehicle.doubt)
            self._publish_pose(vehicle.motion, vehicle.attitude)
        if vehicle.battery is not battery and vehicle.battery is not None:
            self._vehicle_publisher.battery(vehicle.battery)
        if vehicle.text != text and not vehicle.text_goes_on:
            self.get_logger().info(f'the autopilot says: {vehicle.text}')

    def _publish_pose(self, motion: Motion, attitude: Attitude | None) -> None:
        self._vehicle_publisher.pose(motion, attitude)
        self.diagnostics.tick('pose')

    def _step(self, link: AutopilotLink, now_s: float) -> None:
        self._transmit(self._companion.step(now_s, link.problem or link.doubt))
        self._requests.answer()
        status = self._companion.status(now_s)
        self._vehicle_log.look(status, now_s, under_way=self._companion.progressing)
        self._vehicle_publisher.publish_status(status, now_s)

    def _transmit(self, messages: list[Message]) -> None:
        for message in messages:
            if self._link is not None:
                self._link.send(message)

    def _on_tick(self) -> None:
        if self._link is None:
            return
        if not self._started:
            self._started = True
            self._link.start()
        now_s = time.monotonic()
        self._step(self._link, now_s)
        round_trip_s = self._companion.timesync.round_trip_s(now_s)
        if round_trip_s is not None:
            self._monitor.round_trip(round_trip_s)
        self._command(now_s)
        self._diagnose(self._link)

    # -- commands ----------------------------------------------------------------------------
    def _on_command(self, message: TwistStamped) -> None:
        self.diagnostics.tick('cmd_vel')
        now_s, now_ns = time.monotonic(), self.get_clock().now().nanoseconds
        if self._simulated_time:  # One that runs fast may lag behind the poses that commands are stamped with.
            now_ns = max(now_ns, self._vehicle_publisher.stamper.newest_ns)
        put_command(self._monitor, message, now_s, now_ns)
        self._command(now_s)

    def _command(self, now_s: float) -> None:
        """Send what the guard lets through; a vehicle that is ours and not commanded (yet, or any more) stands."""
        if not self._companion.commandable(now_s):
            self._monitor.clear()
            self._note('', now_s)
            return
        verdict = self._monitor.verdict(now_s)
        self._note(verdict.reason if verdict is not None else '', now_s)
        velocity, yaw_rate = (ZERO, 0.0) if verdict is None else verdict[:2]
        no_place = self._monitor.position_doubt(now_s) or ('it is brought back inside' if self._monitor.returning else '')
        setpoint = self._companion.setpoint(velocity, yaw_rate, now_s, no_place)
        self._transmit([] if setpoint is None else [setpoint])

    def _note(self, reason: str, now_s: float) -> None:
        """What the guard changes and why: logged when it begins and ends."""
        vehicle = self._companion.vehicle
        alarms = vehicle.armed and vehicle.connected(now_s)
        self._reason, self._warns = self._guard_log.look(self._monitor, reason, now_s, alarms=alarms)

    # -- services ----------------------------------------------------------------------------
    def _begin(self, goal: Goal) -> GoalRequest:
        """Begin a goal; what this node itself has against it is its refusal."""
        now_s = time.monotonic()
        why = self._obstacle(goal, now_s)
        if why or self._link is None:
            refused = GoalRequest(goal, now_s)
            refused.answer(accepted=False, message=f'{goal.value} refused: {why}')
            return refused
        asked = self._companion.ask(goal, now_s, self._altitude_m)
        self._step(self._link, now_s)
        return asked

    def _obstacle(self, goal: Goal, now_s: float) -> str:
        if self._link is None:
            return self.why_idle
        if goal is not Goal.TAKEOFF:
            return ''
        if self._altitude_m <= 0.0:
            return "its altitude is unknown; set the parameter 'takeoff_altitude_m' or 'grid_file'"
        return f'{problem}; {REMEDY}' if (problem := self._vehicle_publisher.simulated_clock.problem(now_s)) else ''

    # -- diagnostics -------------------------------------------------------------------------
    def _diagnose(self, link: AutopilotLink) -> None:
        status, now_s = self._vehicle_publisher.status, time.monotonic()
        if status is None or ((status, self._reason) == self._diagnosed and now_s - self._diagnosed_s < STATUS_PERIOD_S):
            return
        self._diagnosed, self._diagnosed_s = (status, self._reason), now_s
        clocks = self._clocks.problem(different_speeds=self._vehicle_publisher.stamper.different_speeds)
        if clocks:
            self.get_logger().warning(clocks, once=True)
        stopped, fence = '' if self._reason else self._stopped, '' if self._limits.fence else FENCE_OFF
        waiting = f'waiting for {status.waiting_for}' if status.waiting_for else ''
        sentences = [text for text in (waiting, self._reason, stopped, fence, clocks) if text]
        # What belongs to every flight is no warning: a goal under way, a pilot who is silent, a speed that is limited.
        worries = (waiting and not self._companion.progressing) or self._warns or stopped or fence or clocks
        level = diagnostics.ERROR if not status.connected else diagnostics.WARN if worries else diagnostics.OK
        round_trip_s = self._companion.timesync.round_trip_s(now_s)
        well = 'commands reach the vehicle' if status.commandable else 'ready'
        self.diagnostics.set(level, '; '.join(sentences) or well, {
            'url': self.config.url, 'mode': status.mode, 'autopilot text': status.text,
            'to the autopilot and back (s)': 'unknown' if round_trip_s is None else f'{round_trip_s:.3f}',
            'bytes of no known message': link.bad_bytes, 'messages not sent': link.unsent,
            'frames refused by their signature': link.refused_signatures,
            'messages refused for impossible numbers': self._companion.vehicle.refused_numbers,
            'messages of strangers refused': self._companion.vehicle.refused_strangers,
        })

    def close(self) -> None:
        """A vehicle that we fly stands (ArduPilot) or holds (PX4) when we leave."""
        self._farewell()
        self._close_link()

    def _farewell(self) -> None:
        self._transmit(self._companion.farewell(time.monotonic()))


def main() -> None:
    sys.exit(run.run_node(MavlinkBridge, MavlinkBridgeConfig))
