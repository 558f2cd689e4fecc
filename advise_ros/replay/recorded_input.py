"""What the nodes publish while they live through a session."""

from __future__ import annotations

import threading
from typing import Any

from geometry_msgs.msg import TwistStamped

from advise_msgs import msg
from advise_ros.ros import convert, qos
from advise_ros.ros.graph_client import GraphClient


class PublishedLive:
    """Everything that the nodes published, in order.

    Attributes:
        commands: the first one with each stamp.
    """

    def __init__(self, client: GraphClient) -> None:
        listen = client.node.create_subscription
        self.demonstrations: list[Any] = []
        self.policies: list[Any] = []
        self.queries: list[Any] = []
        self.statuses: list[Any] = []
        self.commands: dict[int, Any] = {}
        self._came = threading.Condition()
        listen(msg.Demonstration, 'demonstration', self.demonstrations.append, qos.DEMONSTRATIONS)
        listen(msg.Policy, 'advise/policy', self.policies.append, qos.latched(1000))
        listen(msg.AdviceQuery, 'advise/query', self.queries.append, qos.latched(1000))
        listen(msg.FlightStatus, 'policy/status', self.statuses.append, qos.latched(1000))
        listen(TwistStamped, 'cmd_vel', self._command, qos.COMMAND_DEEP)

    def _command(self, message: TwistStamped) -> None:
        with self._came:
            self.commands.setdefault(convert.stamp_to_ns(message.header.stamp), message)
            self._came.notify_all()

    def has_command(self, stamp_ns: int, timeout_s: float) -> bool:
        """Whether a command with this stamp is there or comes in time.

        Args:
            stamp_ns: of its header.
            timeout_s: longest wait.
        """
        with self._came:
            return self._came.wait_for(lambda: stamp_ns in self.commands, timeout_s)

    @property
    def flights(self) -> int:
        """Number of the last flight."""
        return max((int(status.flight_id) for status in self.statuses), default=0)

    def beginning(self, flight_id: int) -> Any | None:
        """The first status of a flight."""
        return next((status for status in self.statuses if status.flight_id == flight_id), None)

    def forget_flight(self, flight_id: int) -> None:
        """One that is to be begun again."""
        self.statuses[:] = [status for status in self.statuses if status.flight_id != flight_id]
