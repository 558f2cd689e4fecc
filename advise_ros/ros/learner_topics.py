"""What the learner publishes, every topic latched."""

from __future__ import annotations

import time
from typing import NamedTuple

from nav_msgs.msg import OccupancyGrid, Path
from rclpy.node import Node
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from advise_msgs.msg import Advice, AdviceQuery, Demonstration, LearnerStatus, Policy
from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.grid.grid import Grid
from advise_ros.core.learning.learner import Learned
from advise_ros.core.learning.session import Work
from advise_ros.core.units import MAP_FRAME
from advise_ros.ros import convert, convert_advice, maps, markers, paths, qos
from advise_ros.ros.geo_route import GeoRouteTopic, OnEarth


class LearnedMessages(NamedTuple):
    """What is published of one result; `LearnerTopics.learned` gives the messages their stamps.

    On a large grid they take longer to make than callbacks may wait: they are made where the result was learnt.
    """

    policy: Policy
    query: AdviceQuery
    uncertainty: OccupancyGrid
    reward: OccupancyGrid
    site_map: OccupancyGrid | None
    markers: MarkerArray
    route: Path


def messages_of(learned: Learned, budget_left: int) -> LearnedMessages:
    """The messages of a result, without stamps.

    Args:
        learned: the result.
        budget_left: answers that were left when it was learnt, -1 unlimited.
    """
    query = learned.query
    return LearnedMessages(
        policy=convert_advice.policy_to_msg(learned, 0),
        query=convert_advice.no_query_to_msg(learned, budget_left, 0) if query is None
        else convert_advice.query_to_msg(query, learned.grid, 0),
        uncertainty=maps.uncertainty_map(learned, 0),
        reward=maps.reward_map(learned, 0),
        site_map=None if learned.keep_out is None else maps.site_map(learned.grid, learned.keep_out, 0),
        markers=markers.question_markers(learned, query, 0),
        route=paths.learnt_path(learned),
    )


class Result(NamedTuple):
    """What was learnt, what is published of it, and how long the solve took."""

    learned: Learned
    messages: LearnedMessages
    solve_s: float


def result_of(work: Work, budget_left: int) -> Result:
    """Learn, and write the messages.

    Args:
        work: what is to be learnt.
        budget_left: answers that are left, -1 unlimited.

    Raises:
        InputError: as `learn`.
    """
    begin_s = time.monotonic()
    learned = work.run()
    solve_s = time.monotonic() - begin_s
    return Result(learned, messages_of(learned, budget_left), solve_s)


class LearnerTopics:
    """The publishers of `advise`, stamped by the node's clock."""

    def __init__(self, node: Node, on_earth: OnEarth | None = None) -> None:
        """For a node.

        Args:
            node: that learns.
            on_earth: as GeoRouteTopic.
        """
        self._clock = node.get_clock()
        self._policy = node.create_publisher(Policy, 'advise/policy', qos.latched())
        self._query = node.create_publisher(AdviceQuery, 'advise/query', qos.latched())
        self._status = node.create_publisher(LearnerStatus, 'advise/status', qos.latched())
        self._log = node.create_publisher(Advice, 'advise/advice_log', qos.ADVICE_LOG)
        self._uncertainty = node.create_publisher(OccupancyGrid, 'advise/uncertainty', qos.latched())
        self._reward = node.create_publisher(OccupancyGrid, 'advise/reward', qos.latched())
        self._site_map = node.create_publisher(OccupancyGrid, 'advise/site_map', qos.latched())
        self._site_prior = node.create_publisher(String, 'advise/site_prior', qos.latched())
        self._markers = node.create_publisher(MarkerArray, 'advise/markers', qos.latched())
        self._route = node.create_publisher(Path, 'advise/route', qos.latched())
        self._geo_route = GeoRouteTopic(node, on_earth)
        self._map = node.create_publisher(OccupancyGrid, 'advise/map', qos.latched())
        self._demonstrations = node.create_publisher(Demonstration, 'demonstration', qos.DEMONSTRATIONS)

    def now_ns(self) -> int:
        return int(self._clock.now().nanoseconds)

    def learned(self, messages: LearnedMessages) -> None:
        """The policy first, then the question that was asked under it, then the pictures of both."""
        stamp = convert.stamp_from_ns(self.now_ns())
        published = [
            (self._policy, messages.policy), (self._query, messages.query),
            (self._uncertainty, messages.uncertainty), (self._reward, messages.reward),
        ]
        if messages.site_map is not None:
            published.append((self._site_map, messages.site_map))
        for publisher, message in published:
            message.header.stamp = stamp
            publisher.publish(message)
        for marker in messages.markers.markers:
            marker.header.stamp = stamp
        self._markers.publish(messages.markers)
        paths.stamp(messages.route, convert.stamp_to_ns(stamp))
        self._route.publish(messages.route)
        self._geo_route.publish(messages.route)

    def map(self, grid: Grid) -> None:
        """The grid with its obstacles."""
        self._map.publish(maps.obstacle_map(grid, self.now_ns()))

    def site_prior(self, text: str) -> None:
        """What was known of the site before this session, '' for nothing: a function of it is every policy."""
        self._site_prior.publish(String(data=text))

    def advice(self, record: AdviceRecord, stamp_ns: int) -> None:
        self._log.publish(convert_advice.advice_to_msg(record, stamp_ns))

    def status(self, status: LearnerStatus) -> None:
        status.header.frame_id = MAP_FRAME
        status.header.stamp = convert.stamp_from_ns(self.now_ns())
        self._status.publish(status)

    def demonstration(self, demonstration: convert.Demonstration) -> None:
        """One that came from a file, so that recordings of the session hold it."""
        self._demonstrations.publish(convert.demonstration_to_msg(demonstration))
