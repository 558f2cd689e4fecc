"""PX4 by its uXRCE-DDS topics: the same to the bridge as a MAVLink link."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from importlib import import_module
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from advise_ros.core.errors import InputError
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink import px4_topics
from advise_ros.mavlink.link import Received
from advise_ros.mavlink.messages import Message
from advise_ros.missing_packages import PX4

# PX4 publishes best effort and transient local, and reads best effort and volatile.
FROM_PX4 = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=20, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE,
)
TO_PX4 = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
OUT = {
    'vehicle_status': 'VehicleStatus', 'vehicle_land_detected': 'VehicleLandDetected', 'vehicle_odometry': 'VehicleOdometry',
    'vehicle_local_position': 'VehicleLocalPosition', 'battery_status': 'BatteryStatus',
    'vehicle_command_ack': 'VehicleCommandAck',
}
IN = {
    'offboard_control_mode': 'OffboardControlMode', 'trajectory_setpoint': 'TrajectorySetpoint',
    'vehicle_command': 'VehicleCommand',
}
# The bridge does without these.
MAY_MISS = ('battery_status', 'vehicle_command_ack')
LOOK_S, SILENT_S = 1.0, 3.0


class Px4Link:
    """Subscribes to what PX4 publishes and publishes what it subscribes to; what is passed on is MAVLink's (see px4_topics).

    A TrajectorySetpoint goes out in OFFBOARD only: PX4 takes one from DDS whatever its mode, unlike one by MAVLink. Before,
    the stream is OffboardControlMode alone, which is what PX4 wants to see. Stamps are 0: PX4 puts its own time there.

    Args:
        node: whose namespace a relative prefix is in.
        url: see `px4_topics.prefix_of`.
        source: our system and component id.
        pose_rate_hz: positions passed on a second.
        wake: called when something has come.

    Raises:
        InputError: the prefix is no name, or px4_msgs is not there.
    """

    bad_bytes = refused_signatures = 0
    doubt = ''

    def __init__(
        self, node: Node, url: str, *, source: tuple[int, int], pose_rate_hz: float, wake: Callable[[], None],
    ) -> None:
        self._node, self._source, self._wake = node, source, wake
        self._prefix = px4_topics.prefix_of(url)
        try:
            self._kinds = import_module('px4_msgs.msg')
        except ModuleNotFoundError:
            raise InputError(PX4) from None
        self._reader = px4_topics.TopicReader(pose_rate_hz)
        self._arrived: list[Received] = []
        self._came_s: dict[str, float] = {}
        self._subscriptions: list[Any] = []
        self._publishers: dict[str, Any] = {}
        self._problem, self._looked_s, self._crowd = '', 0.0, False
        self.unsent = 0

    def start(self) -> None:
        """Begin to subscribe."""
        self._came_s = dict.fromkeys(OUT, time.monotonic())
        for name, kind_name in OUT.items():
            kind = getattr(self._kinds, kind_name)
            self._subscriptions.append(
                self._node.create_subscription(kind, self._out(name), self._taker(name, getattr(self._reader, name)), FROM_PX4))
        for name, kind_name in IN.items():
            kind = getattr(self._kinds, kind_name)
            versioned = px4_topics.topic(name, kind)
            self._publishers[name] = self._node.create_publisher(kind, f'{self._prefix}fmu/in/{versioned}', TO_PX4)

    def _out(self, name: str) -> str:
        return f'{self._prefix}fmu/out/{px4_topics.topic(name, getattr(self._kinds, OUT[name]))}'

    def _taker(self, name: str, read: Callable[[Any, float], list[Message]]) -> Callable[[Any], None]:
        def take(message: Any) -> None:
            now_s = self._came_s[name] = time.monotonic()
            received = [Received(said, now_s, None) for said in read(message, now_s)]
            if self._crowd or not received:
                return
            self._arrived += received
            self._wake()

        return take

    def poll(self) -> list[Received]:
        """What arrived since the last call, oldest first."""
        arrived, self._arrived = self._arrived, []
        return arrived

    def answer_to(self, source: object) -> None:
        """Topics have no addresses."""

    def send(self, message: Message) -> bool:
        """Publish what PX4 has a topic for; what belongs to a MAVLink link (heartbeats, requests for rates) is not sent."""
        kind = message.get_type()
        if kind == 'SET_POSITION_TARGET_LOCAL_NED':
            self._publish('offboard_control_mode', px4_topics.offboard_control_mode(message))
            if self._reader.nav_state == px4_topics.OFFBOARD:
                self._publish('trajectory_setpoint', px4_topics.trajectory_setpoint(message))
        elif kind == 'COMMAND_LONG' and message.command != mav.CMD_MESSAGE_INTERVAL:
            self._publish('vehicle_command', px4_topics.vehicle_command(message, self._source))
        return True

    def _publish(self, name: str, fields: dict[str, Any]) -> None:
        publisher = self._publishers.get(name)
        if publisher is None or not rclpy.ok() or publisher.get_subscription_count() == 0:
            self.unsent += 1
            return
        publisher.publish(getattr(self._kinds, IN[name])(timestamp=0, **fields))

    def close(self) -> None:
        """End subscriptions and publishers."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)
        self._subscriptions.clear()
        self._publishers.clear()

    # -- what is wrong -----------------------------------------------------------------------
    @property
    def problem(self) -> str:
        """Why nothing comes, or not what is needed; '' if all is well. The graph is looked at once a second."""
        now_s = time.monotonic()
        if now_s - self._looked_s >= LOOK_S:
            self._looked_s = now_s
            self._problem = self._look(now_s)
        return self._problem

    def _look(self, now_s: float) -> str:
        crowded = [name for name in OUT if self._node.count_publishers(self._out(name)) > 1]
        self._crowd = bool(crowded)
        if crowded:
            return f'several publish {self._out(crowded[0])}: give each PX4 a namespace of its own (uxrce_dds_client -n)'
        silent = [name for name in OUT if name not in MAY_MISS and now_s - self._came_s.get(name, 0.0) > SILENT_S]
        return self._why_silent(silent[0]) if silent else ''

    def _why_silent(self, name: str) -> str:
        wanted = self._node.resolve_topic_name(self._out(name))
        others = re.compile(re.escape(wanted.removesuffix(_version(wanted))) + r'(_v\d+)?')
        there = [there for there, _ in self._node.get_topic_names_and_types() if self._node.count_publishers(there)]
        other = next((there for there in there if there != wanted and others.fullmatch(there)), '')
        if other:
            return (
                f'PX4 publishes {other}, and px4_msgs here is for {wanted}: build the px4_msgs of its release, or start its '
                'translation node')
        if wanted not in there and name == 'vehicle_status':
            return f'nobody publishes {wanted}: start the agent (MicroXRCEAgent udp4 -p 8888) and uxrce_dds_client in PX4'
        if wanted not in there:
            return f'nobody publishes {wanted}: PX4 needs it in its dds_topics.yaml (as it is from 1.16 on)'
        return f'nothing comes on {wanted}'


def _version(name: str) -> str:
    found = re.search(r'_v\d+$', name)
    return found[0] if found else ''
