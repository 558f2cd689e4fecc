"""Two vehicles in one ROS domain: two namespaces go together, one namespace or two clocks do not."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import rclpy
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from advise_ros.core.errors import InputError
from advise_ros.demo.graph import refuse_a_second_graph


@pytest.fixture
def one(ros_env: dict[str, str]) -> Iterator[Node]:
    """A learner in namespace /one, and whoever starts beside it."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=int(ros_env['ROS_DOMAIN_ID']))
    learner = Node('advise', namespace='/one', context=context)
    yield learner
    learner.destroy_node()
    rclpy.shutdown(context=context)


def test_another_namespace_is_free(one: Node) -> None:
    refuse_a_second_graph(one, '/two', simulated_time=False)
    refuse_a_second_graph(one)


def test_a_namespace_has_one_graph(one: Node) -> None:
    with pytest.raises(InputError, match='nodes named advise run in namespace /one already; stop them, name another'):
        refuse_a_second_graph(one, '/one/')


def test_a_domain_has_one_clock(one: Node) -> None:
    one.create_publisher(Clock, '/clock', 1)
    refuse_a_second_graph(one, '/two', simulated_time=False)
    with pytest.raises(InputError, match='one clock only; fly at --speedup 1'):
        refuse_a_second_graph(one, '/two')
