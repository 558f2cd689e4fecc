"""policy/status: published at every change, never twice the same."""

from __future__ import annotations

from rclpy.node import Node

from advise_msgs.msg import FlightStatus
from advise_ros.core.flight.policy_flight import FlightPhase, PolicyFlight
from advise_ros.core.units import MAP_FRAME
from advise_ros.ros import qos
from advise_ros.ros.convert import stamp_from_ns


class FlightPublisher:
    """Keeps and publishes the status of the present or the last flight.

    Attributes:
        status: as last published.
    """

    def __init__(self, node: Node) -> None:
        self.status = FlightStatus()
        self.status.header.frame_id = MAP_FRAME
        self._published: tuple[object, ...] = ()
        self._publisher = node.create_publisher(FlightStatus, 'policy/status', qos.latched())
        self._publisher.publish(self.status)

    def begin(self, flight: PolicyFlight, policy_version: int, stamp_ns: int) -> None:
        """Publish the status of a new flight.

        Args:
            flight: that begins.
            policy_version: that it flies.
            stamp_ns: of the last pose before it.
        """
        self.status.flight_id += 1
        self.status.policy_version = policy_version
        self.status.start_cell = flight.plan.start_cell
        self.update(flight, flight.phase, '', stamp_ns)

    def update(self, flight: PolicyFlight, phase: FlightPhase, message: str, stamp_ns: int) -> bool:
        """Publish when anything changed; returns whether it did.

        Args:
            flight: under way.
            phase, message: as published.
            stamp_ns: of the last pose flown by.
        """
        status = self.status
        changed = (status.flight_id, phase, message, flight.state, flight.steps, flight.step_budget)
        if changed == self._published:
            return False
        self._published = changed
        status.phase, status.message = int(phase), message
        status.state, status.steps, status.step_budget = flight.state, flight.steps, flight.step_budget
        status.next_waypoint = flight.plan.grid.next_waypoint(flight.state)
        status.header.stamp = stamp_from_ns(stamp_ns)
        self._publisher.publish(status)
        return True

    def refuse(self, why: str) -> None:
        """Say why no flight began; the flight under way, or the last one, keeps its own words."""
        self.status.refusals += 1
        self.status.refusal = why
        self._publisher.publish(self.status)
