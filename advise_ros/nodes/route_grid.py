"""The grid that a node works on, by its parameters: the route's file, and what is known of obstacles."""

from __future__ import annotations

from rclpy.node import Node

from advise_ros.config import OnObstacleMap
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.gridfile import load_grid
from advise_ros.ros.obstacle_map import with_obstacles_heard


def grid_of(node: Node, config: OnObstacleMap) -> Grid:
    """The grid; waits for the map where obstacles come by a topic.

    Raises:
        InputError: as load_grid and with_obstacles_heard, or obstacles are named twice.
    """
    file, topic = config.obstacle_map_file, config.obstacle_map_topic
    if file and topic:
        raise InputError(f"obstacle_map_file is '{file}' and obstacle_map_topic '{topic}'; leave one of them empty")
    grid = load_grid(config.grid_file, file)
    if topic:
        grid = with_obstacles_heard(node, grid, topic)
    if file or topic:
        node.get_logger().info(f'{len(grid.blocked)} of {grid.n_cells} cells are blocked, with the obstacles of {file or topic}')
    return grid


def grid_if_named(node: Node, config: OnObstacleMap) -> Grid | None:
    """As `grid_of`; None where neither a grid nor obstacles are named.

    Raises:
        InputError: as grid_of; obstacles alone make no grid.
    """
    named = config.grid_file or config.obstacle_map_file or config.obstacle_map_topic
    return grid_of(node, config) if named else None
