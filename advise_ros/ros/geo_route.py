"""The learnt route in latitudes and longitudes, for Nav2's GPS waypoint follower, Mapviz and others that take geographic_msgs."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from nav_msgs.msg import Path
from rclpy.node import Node

from advise_ros.ros import qos

OnEarth = Callable[[npt.NDArray[np.float64]], npt.NDArray[np.float64]]


class GeoRouteTopic:
    """Publishes each route as geographic_msgs/GeoPath, where the grid has a place on the earth and the package is installed.

    Args:
        node: that has the routes.
        on_earth: positions (n, 2) [m] along the grid's axes -> latitudes and longitudes (n, 2) [deg]; None without a place.
    """

    def __init__(self, node: Node, on_earth: OnEarth | None) -> None:
        self._publisher = None
        if on_earth is None:
            return
        try:
            from geographic_msgs import msg  # noqa: PLC0415  not among what is installed without ROS
        except ImportError:
            node.get_logger().info(
                'no advise/geo_route: the grid file has a place on the earth, but the package geographic_msgs is not installed '
                '(sudo apt install ros-jazzy-geographic-msgs)'
            )
            return
        self._msg: Any = msg
        self._on_earth = on_earth
        self._publisher = node.create_publisher(msg.GeoPath, 'advise/geo_route', qos.latched())

    def publish(self, route: Path) -> None:
        """The route with its stamps; altitudes are not a number, as the height of the ground is not known."""
        if self._publisher is None:
            return
        path = self._msg.GeoPath(header=route.header)
        places = np.array([(one.pose.position.x, one.pose.position.y) for one in route.poses]).reshape(-1, 2)
        for one, (latitude, longitude) in zip(route.poses, self._on_earth(places).tolist(), strict=True):
            pose = self._msg.GeoPoseStamped(header=one.header)
            at = pose.pose.position
            at.latitude, at.longitude, at.altitude = latitude, longitude, math.nan
            path.poses.append(pose)
        self._publisher.publish(path)
