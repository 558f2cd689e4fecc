"""What the learner publishes, every topic latched."""

from __future__ import annotations

from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node
from visualization_msgs.msg import MarkerArray

from advise_msgs.msg import Advice, AdviceQuery, Demonstration, LearnerStatus, Policy
from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.learning.learner import Learned
from advise_ros.core.units import MAP_FRAME
from advise_ros.ros import convert, convert_advice, maps, markers, qos


class LearnerTopics:
    """The publishers of `advise`, stamped by the node's clock."""

    def __init__(self, node: Node) -> None:
        self._clock = node.get_clock()
        self._policy = node.create_publisher(Policy, 'advise/policy', qos.latched())
        self._query = node.create_publisher(AdviceQuery, 'advise/query', qos.latched())
        self._status = node.create_publisher(LearnerStatus, 'advise/status', qos.latched())
        self._log = node.create_publisher(Advice, 'advise/advice_log', qos.ADVICE_LOG)
        self._uncertainty = node.create_publisher(OccupancyGrid, 'advise/uncertainty', qos.latched())
        self._reward = node.create_publisher(OccupancyGrid, 'advise/reward', qos.latched())
        self._site_map = node.create_publisher(OccupancyGrid, 'advise/site_map', qos.latched())
        self._markers = node.create_publisher(MarkerArray, 'advise/markers', qos.latched())
        self._demonstrations = node.create_publisher(Demonstration, 'demonstration', qos.DEMONSTRATIONS)

    def now_ns(self) -> int:
        return int(self._clock.now().nanoseconds)

    def learned(self, learned: Learned, budget_left: int) -> None:
        """The policy first, then the question that was asked under it, then the pictures of both."""
        stamp_ns = self.now_ns()
        self._policy.publish(convert_advice.policy_to_msg(learned, stamp_ns))
        if learned.query is None:
            self._query.publish(convert_advice.no_query_to_msg(learned, budget_left, stamp_ns))
        else:
            self._query.publish(convert_advice.query_to_msg(learned.query, learned.grid, stamp_ns))
        self._uncertainty.publish(maps.uncertainty_map(learned, stamp_ns))
        self._reward.publish(maps.reward_map(learned, stamp_ns))
        if learned.keep_out is not None:
            self._site_map.publish(maps.site_map(learned.grid, learned.keep_out, stamp_ns))
        self._markers.publish(markers.question_markers(learned, learned.query, stamp_ns))

    def advice(self, record: AdviceRecord, stamp_ns: int) -> None:
        self._log.publish(convert_advice.advice_to_msg(record, stamp_ns))

    def status(self, status: LearnerStatus) -> None:
        status.header.frame_id = MAP_FRAME
        status.header.stamp = convert.stamp_from_ns(self.now_ns())
        self._status.publish(status)

    def demonstration(self, demonstration: convert.Demonstration) -> None:
        """One that came from a file, so that recordings of the session hold it."""
        self._demonstrations.publish(convert.demonstration_to_msg(demonstration))
