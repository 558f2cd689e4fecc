"""A process of its own that tells poses at 50 Hz, of a vehicle that obeys `cmd_vel` at once: something to kill."""

from __future__ import annotations

import signal
from threading import Event

import rclpy
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from advise_ros.ros import qos

PERIOD_S = 0.02
ALTITUDE_M = 3.0
# Started ahead of its time it says READY, and waits for this signal.
READY, SPEAK = 'ready', signal.SIGUSR1


class PoseSource(Node):
    """Begins over the first cell of the route."""

    def __init__(self) -> None:
        super().__init__('pose_source')
        self._position = [0.0, 0.0]
        self._velocity = (0.0, 0.0)
        self._poses = self.create_publisher(PoseStamped, 'pose', qos.SENSOR)
        self.create_subscription(TwistStamped, 'cmd_vel', self._on_command, qos.COMMAND)
        self.create_timer(PERIOD_S, self._turn, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _on_command(self, message: TwistStamped) -> None:
        self._velocity = (message.twist.linear.x, message.twist.linear.y)

    def _turn(self) -> None:
        message = PoseStamped()
        message.header.frame_id = 'map'
        message.header.stamp = self.get_clock().now().to_msg()
        for axis in range(2):
            self._position[axis] += PERIOD_S * self._velocity[axis]
        message.pose.position.x, message.pose.position.y = self._position
        message.pose.position.z = ALTITUDE_M
        message.pose.orientation.w = 1.0
        self._poses.publish(message)


if __name__ == '__main__':
    told = Event()
    signal.signal(SPEAK, lambda *_: told.set())
    print(READY, flush=True)
    while not told.wait(0.01):  # The signal may meet a thread of some library, which wakes nobody.
        pass
    rclpy.init()
    rclpy.spin(PoseSource())
