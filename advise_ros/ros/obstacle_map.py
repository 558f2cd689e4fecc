"""The grid of a node that knows obstacles from a map on a topic."""

from __future__ import annotations

import math

import numpy as np
import rclpy
from nav_msgs.msg import OccupancyGrid
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.wait_for_message import wait_for_message

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.obstacles import with_obstacles
from advise_ros.core.grid.raster import Raster
from advise_ros.core.units import MAP_FRAME
from advise_ros.ros import qos

# A map server that starts with the other nodes has published its map by then.
PATIENCE_S = 30.0


def with_obstacles_heard(node: Node, grid: Grid, topic: str) -> Grid:
    """The grid with the obstacles of the map that is latched on a topic; waits for it.

    Args:
        node: that needs the grid; nothing of it is served meanwhile.
        grid: cells and route.
        topic: of nav_msgs/OccupancyGrid, relative to the node's namespace.

    Raises:
        InputError: no map came, it is not a map of frame `map`, or as with_obstacles.
        ExternalShutdownException: a signal came first.
    """
    name = node.resolve_topic_name(topic)
    node.get_logger().info(f'waiting for the map of obstacles on {name}')
    came, message = wait_for_message(OccupancyGrid, node, topic, qos_profile=qos.latched(), time_to_wait=PATIENCE_S)
    if not rclpy.ok(context=node.context):
        raise ExternalShutdownException
    if not came:
        raise InputError(
            f'no map came on {name} within {PATIENCE_S:g} s; start nav2_map_server, '
            "or name a map by 'obstacle_map_file' and leave 'obstacle_map_topic' empty"
        )
    try:
        return with_obstacles(grid, raster_of(message))
    except InputError as problem:
        raise InputError(f'map on {name}: {problem}') from problem


def raster_of(message: OccupancyGrid) -> Raster:
    """The map of a message: 0 free to 1 occupied, NaN unknown.

    Raises:
        InputError: it is in another frame, has not as many cells as it says, or no size.
    """
    info, turned = message.info, message.info.origin.orientation
    if message.header.frame_id != MAP_FRAME:
        raise InputError(f"it is in frame '{message.header.frame_id}'; it must be in '{MAP_FRAME}'")
    if not info.resolution > 0 or not info.width * info.height == len(message.data) > 0:
        raise InputError(f'it says {info.width} x {info.height} cells of {info.resolution:g} m and holds {len(message.data)}')
    data = np.array(message.data, dtype=np.float64).reshape(info.height, info.width)
    yaw = 2.0 * math.atan2(turned.z, turned.w) if turned.z else 0.0
    # A float32: 0.05 stays 0.05.
    resolution_m = float(f'{info.resolution:.7g}')
    return Raster(np.where(data >= 0, data / 100.0, np.nan), resolution_m, (info.origin.position.x, info.origin.position.y), yaw)
