"""pose, battery_state and vehicle_status of one vehicle."""

from __future__ import annotations

import math
import time

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from sensor_msgs.msg import BatteryState

from advise_msgs.msg import VehicleStatus
from advise_ros.core.units import MAP_FRAME
from advise_ros.mavlink.companion import Status
from advise_ros.mavlink.stamps import Stamper
from advise_ros.mavlink.vehicle import Attitude, Battery, Motion
from advise_ros.ros import qos
from advise_ros.ros.convert import stamp_from_ns
from advise_ros.ros.simulated_clock import SimulatedClock
from advise_ros.ros.transform import TransformTopic

STATUS_PERIOD_S = 1.0


class VehiclePublisher:
    """Publishes what an autopilot says of itself.

    Attributes:
        status: as last published, None before.
        stamper: gives poses their stamps.
        simulated_clock: whether there is a clock to stamp by.
    """

    def __init__(self, node: Node, *, simulated_time: bool, tf_child_frame: str = '') -> None:
        self._clock = node.get_clock()
        self._simulated_time = simulated_time
        self.simulated_clock = SimulatedClock(node, simulated_time=simulated_time)
        self._pose = node.create_publisher(PoseStamped, 'pose', qos.SENSOR)
        self._transform = TransformTopic(node, tf_child_frame)
        self._battery = node.create_publisher(BatteryState, 'battery_state', qos.SENSOR)
        self._statuses = node.create_publisher(VehicleStatus, 'vehicle_status', qos.latched())
        self.forget()

    def forget(self) -> None:
        """Another vehicle, or the same anew."""
        self.stamper = Stamper(simulated=self._simulated_time)
        self.status: Status | None = None
        self._status_s = -math.inf

    def pose(self, motion: Motion, attitude: Attitude | None) -> None:
        """Publish it, unless it is a repetition or there is no clock to stamp it by."""
        stamp_ns = self.stamper.stamp_ns(motion.time_boot_ms, motion.at_s, self._clock.now().nanoseconds, time.monotonic())
        if stamp_ns is None:
            return
        message = PoseStamped()
        message.header.frame_id = MAP_FRAME
        message.header.stamp = stamp_from_ns(stamp_ns)
        position, orientation = message.pose.position, message.pose.orientation
        position.x, position.y, position.z = motion.position_enu_m
        orientation.x, orientation.y, orientation.z, orientation.w = quaternion_xyzw(attitude or Attitude(0.0, 0.0, 0.0))
        self._pose.publish(message)
        self._transform.publish(message)

    def battery(self, battery: Battery) -> None:
        """Publish it."""
        message = BatteryState(
            voltage=battery.voltage_v, current=-battery.current_a, percentage=battery.remaining,
            temperature=math.nan, charge=math.nan, capacity=math.nan, design_capacity=math.nan, present=True,
        )
        message.header.stamp = self._clock.now().to_msg()
        self._battery.publish(message)

    def publish_status(self, status: Status, now_s: float) -> None:
        """Publish it at every change, and every STATUS_PERIOD_S.

        Args:
            status: of the companion.
            now_s: steady time.
        """
        problem = self.simulated_clock.problem(now_s)
        if status.connected and problem:  # Poses have no stamps.
            status = status._replace(commandable=False, ready=False, waiting_for=f'a clock: {problem}')
        if status == self.status and now_s - self._status_s < STATUS_PERIOD_S:
            return
        self.status, self._status_s = status, now_s
        message = VehicleStatus(**status._asdict())
        message.header.frame_id = MAP_FRAME
        message.header.stamp = self._clock.now().to_msg()
        self._statuses.publish(message)


def quaternion_xyzw(attitude: Attitude) -> tuple[float, float, float, float]:
    """Roll, pitch, yaw about fixed axes to a unit quaternion (REP-103)."""
    sr, cr = math.sin(attitude.roll_rad / 2), math.cos(attitude.roll_rad / 2)
    sp, cp = math.sin(attitude.pitch_rad / 2), math.cos(attitude.pitch_rad / 2)
    sy, cy = math.sin(attitude.yaw_rad / 2), math.cos(attitude.yaw_rad / 2)
    return (
        sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy,
    )
