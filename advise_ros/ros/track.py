"""Where the drone was lately, as an RViz marker."""

from __future__ import annotations

import math
from collections import deque

from geometry_msgs.msg import Point
from rclpy.node import Node
from visualization_msgs.msg import Marker

from advise_ros.ros import qos
from advise_ros.ros.markers import track_marker

POINTS = 2000


class TrackTopic:
    """Publishes the latest `POINTS` points of the track, latched, so that it neither grows nor costs without bound.

    Args:
        node: that receives the poses.
        step_m: two points are at least so far apart.
    """

    def __init__(self, node: Node, step_m: float) -> None:
        self._clock, self._step_m = node.get_clock(), step_m
        self._publisher = node.create_publisher(Marker, 'recorder/track', qos.latched())
        self._points: deque[tuple[float, float, float]] = deque(maxlen=POINTS)
        self._is_new = False

    def add(self, position_enu_m: tuple[float, float, float]) -> None:
        """Note a position of finite numbers.

        Args:
            position_enu_m: (east, north, up), finite.
        """
        if not self._points or math.dist(self._points[-1], position_enu_m) >= self._step_m:
            self._points.append(position_enu_m)
            self._is_new = True

    def publish(self) -> None:
        """Publish the track if it has grown."""
        if self._is_new and len(self._points) > 1:
            self._is_new = False
            points = [Point(x=x, y=y, z=z) for x, y, z in self._points]
            self._publisher.publish(track_marker(points, int(self._clock.now().nanoseconds)))
