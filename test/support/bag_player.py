"""A stand-in for `ros2 bag play --clock`: raw messages of a bag in their order, by the durability that was recorded.

In place of the player's pace, it waits until its listener has counted what was sent.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Qos
from rosgraph_msgs.msg import Clock

from advise_ros.ros import qos
from advise_ros.ros.convert import stamp_from_ns
from advise_ros.ros.subscriptions import message_class
from support.graph import PATIENCE_S, Graph


def play(graph: Graph, bag: Path, topics: Collection[str], keep_up: Callable[[str, int], Any]) -> None:
    """Play topics of a bag.

    Args:
        graph: whose nodes listen.
        bag: recorded by anybody.
        topics: of the bag, each of which has a listener.
        keep_up: gets topic and number of each message, counted from 1, after it was sent; may wait.
    """
    clock = graph.node.create_publisher(Clock, '/clock', qos.COMMAND)
    with AnyReader([bag]) as reader:
        chosen = [one for one in reader.connections if one.topic in topics]
        assert {one.topic for one in chosen} == set(topics)
        publishers = {
            one.topic: graph.publisher(one.topic, message_class(one.msgtype), profile(one.ext.offered_qos_profiles[0]))
            for one in chosen
        }
        sent = dict.fromkeys(topics, 0)
        for connection, log_ns, data in reader.messages(chosen):
            clock.publish(Clock(clock=stamp_from_ns(log_ns)))
            publishers[connection.topic].publish(bytes(data))
            sent[connection.topic] += 1
            keep_up(connection.topic, sent[connection.topic])
    for publisher in publishers.values():
        publisher.wait_for_all_acked(Duration(seconds=PATIENCE_S))


def profile(recorded: Qos) -> QoSProfile:
    """What a player offers: reliable, which every reader takes, and with room for what a busy reader has not had yet."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=max(recorded.depth, 1000),
        reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy(recorded.durability.value),
    )
