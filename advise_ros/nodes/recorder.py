"""The node that turns flights into demonstrations."""

from __future__ import annotations

import math
import sys
import time
from collections import Counter
from typing import TypeVar

from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry, Path
from rclpy.clock import Clock, ClockType
from std_srvs.srv import Trigger

from advise_msgs import msg, srv
from advise_ros.config import RecorderConfig
from advise_ros.core.demonstrations.recorder import Recorder, RecorderPhase, RecorderReply
from advise_ros.core.demonstrations.samples import VehicleEvent
from advise_ros.core.errors import InputError
from advise_ros.core.units import MAP_FRAME
from advise_ros.mavlink.link import Link
from advise_ros.nodes.route_grid import grid_of
from advise_ros.recording.batch import ReadTask, demonstrations_in
from advise_ros.recording.gridfile import load_place
from advise_ros.recording.mavlink_listener import COMPONENT_ID, MavlinkListener
from advise_ros.recording.topics import BagTopics
from advise_ros.ros import convert, diagnostics, parameters, qos, run
from advise_ros.ros.configured import ConfiguredNode
from advise_ros.ros.diagnostics import Diagnostics
from advise_ros.ros.paths import demonstrated_path
from advise_ros.ros.track import TrackTopic

ResponseT = TypeVar('ResponseT', Trigger.Response, srv.TakeBack.Response)
POLL_S = 0.05
# A player faster than real time waits for these counts, so they are also published after this many messages.
REPORT_POSES = 50
POLICY_TOPIC = 'policy/status'
# The track has a point each time the drone has moved by this share of a cell.
TRACK_STEP_CELLS = 0.1
# Landing and disarming may come at once; both count.
STATUS_DEPTH = 50


class RecorderNode(ConfiguredNode):
    """Turns flights into demonstrations on the grid.

    Listens to `pose` (PoseStamped) or, with pose_source odom, `odom` (Odometry), both in frame map;
    `cmd_vel` (TwistStamped in frame map), `vehicle_status` and `policy/status`. With source mavlink it
    listens to a MAVLink link instead, with source tlog it reads a log and publishes all its flights.
    Publishes `demonstration` when a flight ends: at the final waypoint, at landing or disarming, or by recorder/stop; the same as
    nav_msgs/Path on `recorder/path`; and `recorder/track`, a marker of where the drone was lately. Without vehicle_status the
    altitude shows take-off and landing. Flights of the policy are left out unless policy_flights, and so are moves that nobody
    made: in modes in which the autopilot flies itself, or without a command. A flight whose climb was not received, because the
    recorder began in mid-flight, has a note in its audit. Ids are counted on from those that the learner or another publisher
    has, so a recorder that is started again repeats none. A position that is not a number or in another frame is refused; the
    audit in each demonstration counts the samples that were not used.

    Services (std_srvs/Trigger): `recorder/start` and `recorder/stop` begin and end a demonstration by hand
    (split manual: the only way); it ends by itself at the final waypoint. `recorder/discard` drops the one
    being recorded, or else takes back the last one published: a demonstration with its id and no moves;
    `recorder/take_back` (advise_msgs/TakeBack) does that to any one by its id.

    Example: ros2 run advise_ros recorder --ros-args -p grid_file:=config/grid_6x6.yaml
    Next: fly by `teleop` or `pilot`; `advise` learns from the demonstrations.
    """

    def __init__(self) -> None:
        super().__init__('recorder')
        self.config = self.load(RecorderConfig)
        self._grid = grid_of(self, self.config)
        self._recorder = Recorder(
            self._grid, self.config.discretise_settings(), self._source(), by_flights=self.config.split == 'flights',
            policy_flights=self.config.policy_flights,
        )
        self._link: Link | None = None
        self._listener: MavlinkListener | None = None
        self._refused: Counter[str] = Counter()
        self._poses = self._commands = 0
        self._publisher = self.create_publisher(msg.Demonstration, 'demonstration', qos.DEMONSTRATIONS)
        self._path = self.create_publisher(Path, 'recorder/path', qos.DEMONSTRATIONS)
        self._track = TrackTopic(self, TRACK_STEP_CELLS * self._grid.resolution_m)
        self._diagnostics = Diagnostics(self, self._report)
        self._diagnostics.meter('pose', 'cmd_vel')
        {'topics': self._open_topics, 'mavlink': self._open_mavlink, 'tlog': self._open_tlog}[self.config.source]()
        self.create_subscription(msg.Demonstration, 'demonstration', self._on_demonstration, qos.DEMONSTRATIONS)
        self.create_subscription(msg.LearnerStatus, 'advise/status', self._on_learner, qos.latched())
        for name, reply in (('start', self._start), ('stop', self._stop), ('discard', self._discard)):
            self.create_service(Trigger, f'recorder/{name}', reply)
        self.create_service(srv.TakeBack, 'recorder/take_back', self._take_back)
        self.create_timer(POLL_S, self._poll, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _source(self) -> str:
        if self.config.source == 'tlog':
            return self.config.tlog_file
        if self.config.source == 'mavlink':
            return f'mavlink {self.config.mavlink_url}'
        return f'topic {self.resolve_topic_name(self.config.pose_source)}'

    # -- sources -----------------------------------------------------------------------------
    def _open_topics(self) -> None:
        kind = PoseStamped if self.config.pose_source == 'pose' else Odometry
        self.create_subscription(kind, self.config.pose_source, self._on_pose, qos.SENSOR_DEEP)
        command = TwistStamped if self.config.command_type == 'TwistStamped' else Twist
        self.create_subscription(command, 'cmd_vel', self._on_command, qos.COMMAND_DEEP)
        self.create_subscription(msg.VehicleStatus, 'vehicle_status', self._on_vehicle, qos.latched(STATUS_DEPTH))
        self.create_subscription(msg.FlightStatus, POLICY_TOPIC, self._on_policy, qos.latched())

    def _open_mavlink(self) -> None:
        with parameters.blamed('mavlink_url'):
            self._link = Link(self.config.mavlink_url, component_id=COMPONENT_ID)
        simulated = bool(self.get_parameter('use_sim_time').value)
        self._listener = MavlinkListener(self._link, self._recorder, simulated=simulated)
        self._link.start()

    def _open_tlog(self) -> None:
        if not self.config.tlog_file:
            raise InputError("parameter 'tlog_file' is empty; name the log to read, e.g. -p tlog_file:=flight.tlog")
        task = ReadTask(
            self._grid, self.config.discretise_settings(), BagTopics(vehicle=self.config.vehicle),
            undivided=self.config.split == 'manual', policy_flights=self.config.policy_flights,
            place=load_place(self.config.grid_file),
        )
        found = demonstrations_in(self.config.tlog_file, task)
        for note in found.remarks:
            self.get_logger().info(note)
        if found.failure:  # Said once more on /diagnostics as long as the node lives.
            self._refuse(found.failure)
        self._recorder.adopt(found.demonstrations)

    # -- samples -----------------------------------------------------------------------------
    def _on_pose(self, message: PoseStamped | Odometry) -> None:
        self._poses += 1
        self._diagnostics.tick('pose')
        if self._poses % REPORT_POSES == 0:
            self._publish_status()
            self._diagnostics.publish()
        if not self._is_in_map('positions', message.header.frame_id):
            return
        pose = message.pose if isinstance(message, PoseStamped) else message.pose.pose
        position = (pose.position.x, pose.position.y, pose.position.z)
        if not all(map(math.isfinite, position)):
            self._refuse('positions that are not numbers are not used')
        else:
            self._track.add(position)
        self._recorder.pose(convert.stamp_to_ns(message.header.stamp), position)

    def _on_command(self, message: TwistStamped | Twist) -> None:
        self._commands += 1
        self._diagnostics.tick('cmd_vel')
        if isinstance(message, Twist):
            self._recorder.command(0, (message.linear.x, message.linear.y, message.linear.z))
        elif not message.header.frame_id or self._is_in_map('commands', message.header.frame_id):
            # An empty frame is as MAVROS has it: it counts as the map's.
            linear = message.twist.linear
            self._recorder.command(convert.stamp_to_ns(message.header.stamp), (linear.x, linear.y, linear.z))

    def _is_in_map(self, what: str, frame_id: str) -> bool:
        if frame_id.lstrip('/') in (MAP_FRAME, self.config.frame.strip('/')):
            return True
        remedy = f"send them in frame '{MAP_FRAME}' (ENU)"
        if frame_id:
            remedy += f", or set frame:={frame_id} if that frame's origin and axes are the grid's"
        self._refuse(f"{what} in frame '{frame_id}' are refused; {remedy}")
        return False

    def _refuse(self, sentence: str) -> None:
        """Say it once, count it always."""
        if not self._refused[sentence]:
            self.get_logger().warning(sentence)
        self._refused[sentence] += 1

    def _on_vehicle(self, message: msg.VehicleStatus) -> None:
        stamp_ns = convert.stamp_to_ns(message.header.stamp)
        self._recorder.vehicle(VehicleEvent(
            stamp_ns, message.armed, message.in_air, message.mode, message.autopilot, message.owner, message.connected,
        ))

    def _on_policy(self, message: msg.FlightStatus) -> None:
        stamp_ns = convert.stamp_to_ns(message.header.stamp)
        self._recorder.policy(flies=message.phase in (message.TO_START, message.FLYING), stamp_ns=stamp_ns)

    def _on_demonstration(self, message: msg.Demonstration) -> None:
        self._recorder.skip_number(message.demonstration_id)

    def _on_learner(self, message: msg.LearnerStatus) -> None:
        """It remembers the demonstrations of a recorder that is no more."""
        for demonstration_id in message.demonstration_ids:
            self._recorder.skip_number(demonstration_id)

    # -- services ----------------------------------------------------------------------------
    def _start(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self.config.source == 'tlog':
            return _filled(response, RecorderReply(False, 'the source is a log: all its flights are published already'))
        return _filled(response, self._recorder.start())

    def _stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return _filled(response, self._recorder.stop())

    def _discard(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return _filled(response, self._recorder.discard())

    def _take_back(self, request: srv.TakeBack.Request, response: srv.TakeBack.Response) -> srv.TakeBack.Response:
        return _filled(response, self._recorder.take_back(request.demonstration_id))

    # -- results -----------------------------------------------------------------------------
    def _poll(self) -> None:
        if self._listener is not None:
            self._listener.poll(self.get_clock().now().nanoseconds, time.monotonic())
        for output in self._recorder.take(time.monotonic()):
            # Each on a line of its own: rclpy's logger refuses two severities from one place.
            if output.warning:
                self.get_logger().warning(output.remark)
            else:
                self.get_logger().info(output.remark)
            if output.demonstration is not None:
                self._publisher.publish(convert.demonstration_to_msg(output.demonstration))
                self._path.publish(demonstrated_path(output.demonstration))
                self._report()

    def _report(self) -> None:
        self._track.publish()
        self._publish_status()

    def _publish_status(self) -> None:
        values = {
            'demonstrations': len(self._recorder.published), 'next': self._recorder.next_id,
            **self._counts(), **self._refused,
        }
        waiting = self._waiting_for()
        if self._refused:
            self._diagnostics.set(diagnostics.WARN, '; '.join((waiting or self._doing(), *self._refused)), values)
        elif waiting:
            self._diagnostics.set(diagnostics.WARN, waiting, values)
        else:
            self._diagnostics.set(diagnostics.OK, self._doing(), values)

    def _counts(self) -> dict[str, int]:
        """Messages received by topic, counted as the logger does."""
        if self.config.source != 'topics':
            return {}
        received = {self.config.pose_source: self._poses, 'cmd_vel': self._commands}
        return {self.resolve_topic_name(topic): count for topic, count in received.items()}

    def _waiting_for(self) -> str:
        if self._link is not None and self._link.problem:
            return self._link.problem
        if self._listener is not None and not self._listener.positions:
            what = 'positions' if self._listener.vehicle else 'an autopilot'
            return f'waiting for {what} on {self.config.mavlink_url}'
        if self.config.source == 'topics' and not self._poses:
            return f'waiting for positions on {self.resolve_topic_name(self.config.pose_source)}'
        return ''

    def _doing(self) -> str:
        if self._recorder.phase is RecorderPhase.IDLE:
            return f'{len(self._recorder.published)} demonstrations; waiting for a flight'
        return f'{self._recorder.phase.value} {self._recorder.next_id}'

    def close(self) -> None:
        """Give the link's port back."""
        if self._link is not None:
            self._link.close()


def _filled(response: ResponseT, reply: RecorderReply) -> ResponseT:
    response.success, response.message = reply
    return response


def main() -> None:
    sys.exit(run.run_node(RecorderNode, RecorderConfig))
