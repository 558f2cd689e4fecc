"""`advise/geo_route` with real messages of geographic_msgs, published and recorded, and what is said without the package."""

from __future__ import annotations

import math
import signal
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rosbags.highlevel import AnyReader

from advise_msgs.msg import Demonstration
from advise_ros.recording.gridfile import load_place
from advise_ros.ros import convert, qos
from support.foreign_messages import GEOGRAPHIC
from support.graph import Graph
from support.learner import write_grid
from support.walks import GRID_4X4, walk

TOPIC, TYPE = '/advise/geo_route', 'geographic_msgs/msg/GeoPath'


def logger_says(graph: Graph, words: str) -> None:
    graph.wait_for('/diagnostics', DiagnosticArray, lambda m: any(
        one.name == '/logger' and (words in one.message or any(words in pair.key for pair in one.values)) for one in m.status))


def test_the_route_on_the_earth_is_in_the_bag(graph: Graph, tmp_path: Path) -> None:
    environment = GEOGRAPHIC.environment(graph.env)
    logger = graph.start('logger', {'bag': str(tmp_path / 'bag')}, env=environment)
    grid_file = write_grid(tmp_path, GRID_4X4, place=(47.0, 8.0))
    graph.start('advise', {'grid_file': grid_file, 'acquisition': 'occupancy'}, env=environment)
    graph.publisher('demonstration', Demonstration, qos.DEMONSTRATIONS).publish(convert.demonstration_to_msg(walk(GRID_4X4, 0)))
    logger_says(graph, TOPIC)
    logger.signal(signal.SIGINT)
    assert logger.wait_exit() == 0
    with AnyReader([tmp_path / 'bag']) as reader:
        routes = [one for one in reader.connections if one.topic in (TOPIC, '/advise/route')]
        messages = {one.topic: reader.deserialize(raw, one.msgtype) for one, _, raw in reader.messages(routes)}
        assert [one.msgtype for one in routes if one.topic == TOPIC] == [TYPE]
    places = [one.pose.position for one in messages[TOPIC].poses]
    route = np.array([(one.pose.position.x, one.pose.position.y) for one in messages['/advise/route'].poses])
    place = load_place(grid_file)
    assert place is not None and len(route) and all(math.isnan(one.altitude) for one in places)
    wanted = place.on_earth(route)
    assert [(one.latitude, one.longitude) for one in places] == [pytest.approx(tuple(one), abs=1e-9) for one in wanted]


def test_a_logger_without_the_package_says_so(graph: Graph, tmp_path: Path) -> None:
    GEOGRAPHIC.load()
    from geographic_msgs.msg import GeoPath

    graph.start('logger', {'bag': str(tmp_path / 'bag')})
    logger_says(graph, 'recording into')
    publisher = graph.node.create_publisher(GeoPath, 'advise/geo_route', qos.latched())
    publisher.publish(GeoPath())
    logger_says(graph, f'{TOPIC} is not recorded: its type {TYPE} is not installed here; install geographic_msgs')
