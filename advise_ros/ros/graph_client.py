"""A client of the running graph: what a command line tool or a test asks of the nodes."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, TypeVar

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from std_srvs.srv import Trigger

from advise_msgs.action import Fly
from advise_msgs.msg import (
    Advice,
    AdviceQuery,
    Demonstration,
    FlightStatus,
    LearnerStatus,
    Policy,
    VehicleStatus,
)
from advise_ros.core.errors import AdviseError
from advise_ros.ros import convert, qos
from advise_ros.ros.background import BackgroundSpin
from advise_ros.ros.receivers import counted

T = TypeVar('T')
POLL_S = 0.02
# How long a goal is sent again when it is refused.
ACCEPT_PATIENCE_S = 30.0
# A policy node replies to a goal within this; one that was killed is discovered for a while, and the goal is lost.
REPLY_PATIENCE_S = 15.0
NO_REPLY = 'policy/fly did not reply: its node was killed or is held up; start policy again'
# Questions and policies can follow one another faster than they are read here; none is to be missed.
EVERY_ONE = 1000


class GraphTimeoutError(AdviseError):
    """The graph did not do in time what was waited for."""


class GraphClient:
    """Listens to the graph in a background thread and calls its services and its action.

    Attributes:
        vehicle, learner, flight, query: the latest message of each topic, None before the first.
        flying_since_ns: stamp of the last pose before the policy's latest flight began, after the way to its start.
        health: latest diagnostic status by node name.
        demonstrations: latest message by demonstration id, in order of arrival.
        policies: by version.
        queries: by query id.
        advice: the session's log in order.
        site_maps: what was believed of the site, by the stamp of the policy that came of it [ns].
        on_pose: called with every pose.
    """

    def __init__(
        self, name: str, check: Callable[[], None] = lambda: None, clock: Callable[[], float] = time.monotonic,
        namespace: str = '',
    ) -> None:
        """Joins the graph.

        Args:
            name: of the node.
            check: called while waiting; may raise, e.g. when a process died.
            clock: seconds by which waiting is limited.
            namespace: of the graph, '' none.
        """
        if not rclpy.ok():
            rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node(name, namespace=namespace or None)
        self._check = check
        self._clock = clock
        self.vehicle: VehicleStatus | None = None
        self.learner: LearnerStatus | None = None
        self.flight: FlightStatus | None = None
        self.query: AdviceQuery | None = None
        self.flying_since_ns = 0
        self.health: dict[str, DiagnosticStatus] = {}
        self.demonstrations: dict[str, Demonstration] = {}
        self.policies: dict[int, Policy] = {}
        self.queries: dict[int, AdviceQuery] = {}
        self.advice: list[Advice] = []
        self.site_maps: dict[int, OccupancyGrid] = {}
        self.on_pose: Callable[[PoseStamped], None] | None = None
        self._subscribe()
        self._fly = ActionClient(self.node, Fly, 'policy/fly')
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._spin = BackgroundSpin(self._executor, 'graph-client')

    def _subscribe(self) -> None:
        listen = self.node.create_subscription
        listen(VehicleStatus, 'vehicle_status', lambda m: setattr(self, 'vehicle', m), qos.latched())
        listen(LearnerStatus, 'advise/status', lambda m: setattr(self, 'learner', m), qos.latched())
        listen(FlightStatus, 'policy/status', self._on_flight, qos.latched(EVERY_ONE))
        listen(AdviceQuery, 'advise/query', self._on_query, qos.latched(EVERY_ONE))
        listen(Policy, 'advise/policy', lambda m: self.policies.__setitem__(m.version, m), qos.latched(EVERY_ONE))
        listen(Advice, 'advise/advice_log', self._on_advice, qos.ADVICE_LOG)
        listen(
            OccupancyGrid, 'advise/site_map', lambda m: self.site_maps.__setitem__(convert.stamp_to_ns(m.header.stamp), m),
            qos.latched(EVERY_ONE),
        )
        listen(
            Demonstration, 'demonstration', lambda m: self.demonstrations.__setitem__(m.demonstration_id, m),
            qos.DEMONSTRATIONS,
        )
        listen(PoseStamped, 'pose', self._on_pose, qos.SENSOR_DEEP)
        listen(DiagnosticArray, '/diagnostics', self._on_diagnostics, 100)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.health.update({status.name.rsplit('/', 1)[-1]: status for status in message.status})

    def _on_flight(self, flight: FlightStatus) -> None:
        began = flight.phase == FlightStatus.FLYING and (self.flight is None or self.flight.phase != flight.phase)
        if began:
            self.flying_since_ns = convert.stamp_to_ns(flight.header.stamp)
        self.flight = flight

    def _on_query(self, query: AdviceQuery) -> None:
        self.query = query
        if query.query_id:
            self.queries[query.query_id] = query

    def _on_advice(self, advice: Advice) -> None:  # Not `self.advice.append`: `forget_session` puts another list there.
        self.advice.append(advice)

    def _on_pose(self, pose: PoseStamped) -> None:
        if self.on_pose is not None:
            self.on_pose(pose)

    def close(self) -> None:
        """Leave the graph."""
        self._spin.stop()
        self.node.destroy_node()
        rclpy.try_shutdown()

    def forget_session(self) -> None:
        """Forget the messages of a learner that is gone, before another one starts."""
        self.learner = self.query = None
        self.policies, self.queries, self.advice, self.demonstrations, self.site_maps = {}, {}, [], {}, {}

    # -- waiting -----------------------------------------------------------------------------
    def wait(
        self, what: str, predicate: Callable[[], T | None], timeout_s: float, progress: Callable[[], object] = lambda: None,
    ) -> T:
        """The predicate's first true value.

        Args:
            what: for the message.
            predicate: asked again and again.
            timeout_s: seconds of the client's clock to wait.
            progress: each change of its value makes the waiting begin anew.

        Raises:
            GraphTimeoutError: not in time; the message says what was waited for.
        """
        end, reached = self._clock() + timeout_s, progress()
        while True:
            value = predicate()
            if value:
                return value
            self._check()
            if self._clock() > end:
                before, reached = reached, progress()
                if reached != before:
                    end = self._clock() + timeout_s
                    continue
                raise GraphTimeoutError(f'waited {timeout_s:g} s in vain for {what}')
            time.sleep(POLL_S)

    def call(self, service_type: Any, name: str, request: Any, timeout_s: float = 10.0) -> Any:
        """The response of a service.

        Args:
            service_type: its class.
            name: of the service.
            request: to send.
            timeout_s: longest wait.

        Raises:
            GraphTimeoutError: there is no such service, or it does not reply in time.
        """
        client = self.node.create_client(service_type, name)
        try:
            self.wait(f'service {name}', lambda: client.service_is_ready() or None, timeout_s)
            future = client.call_async(request)
            self.wait(f'the reply of service {name}', lambda: future.done() or None, timeout_s)
            return future.result()
        finally:
            self.node.destroy_client(client)

    def trigger(self, name: str, timeout_s: float = 10.0) -> str:
        """Call a std_srvs/Trigger service; returns its message.

        Args:
            name: of the service.
            timeout_s: longest wait.

        Raises:
            AdviseError: the service refused; its own words are in the message.
        """
        response = self.call(Trigger, name, Trigger.Request(), timeout_s)
        if not response.success:
            raise AdviseError(f'{name} was refused: {response.message}')
        return str(response.message)

    def is_heard(self, topic: str, *nodes: str) -> bool:
        """Whether each of these nodes says that it counts messages of a topic."""
        name = self.node.resolve_topic_name(topic)
        return all(node in self.health and counted(self.health[node], name) > 0 for node in nodes)

    # -- flying ------------------------------------------------------------------------------
    def take_off(self, timeout_s: float) -> None:
        """Arm and climb to the grid's altitude; returns when velocity commands reach the vehicle.

        Args:
            timeout_s: longest wait.
        """
        self.wait('the vehicle to be ready', lambda: self.vehicle and self.vehicle.ready, timeout_s)
        self.trigger('mavlink_bridge/takeoff', timeout_s)
        self.wait('the take-off', lambda: self.vehicle and self.vehicle.commandable, timeout_s)

    def land(self, timeout_s: float) -> None:
        """Land; returns when the vehicle is disarmed.

        Args:
            timeout_s: longest wait.
        """
        self.trigger('mavlink_bridge/land', timeout_s)
        self.wait('the landing', lambda: self.vehicle and not self.vehicle.armed, timeout_s)

    def fly(self, start_cell: int, timeout_s: float) -> Fly.Result:
        """Fly the newest policy once.

        Args:
            start_cell: where the route begins; -1: where the vehicle is.
            timeout_s: longest flight.

        Raises:
            AdviseError: the goal was refused.
            GraphTimeoutError: no reply within ACCEPT_PATIENCE_S, or no result in time.
        """
        self.wait('the action policy/fly', lambda: self._fly.server_is_ready() or None, timeout_s)
        goal = Fly.Goal(step_budget=0, start_cell=start_cell, policy_version=max(self.policies, default=0))
        end = self._clock() + ACCEPT_PATIENCE_S
        while True:
            handle = self._send(goal)
            result = None if handle is None else self._done('the end of the flight', handle.get_result_async, timeout_s).result
            if result is not None and result.flight_id:
                return result
            if self._clock() < end:  # A node that has just started may not have received the policy yet.
                continue
            if result is None:
                raise GraphTimeoutError(NO_REPLY)
            raise AdviseError(f'policy/fly refused: {result.error_msg} (error {result.error_code})')

    def begin_flight(self, goal: Fly.Goal, timeout_s: float) -> bool:
        """Send a goal once; whether its flight began.

        Args:
            goal: of policy/fly.
            timeout_s: longest wait.

        Raises:
            GraphTimeoutError: no such action, or no reply in time.
        """
        self.wait('the action policy/fly', lambda: self._fly.server_is_ready() or None, timeout_s)
        began: list[Any] = []
        handle = self._send(goal, timeout_s, began.append)
        if handle is None:
            raise GraphTimeoutError(NO_REPLY)
        asked = self._executor.create_task(handle.get_result_async)
        self.wait('the flight to begin', lambda: began or (asked.done() and asked.result().done()) or None, timeout_s)
        return bool(began) or bool(asked.result().result().result.flight_id)

    def _send(
        self, goal: Fly.Goal, timeout_s: float = REPLY_PATIENCE_S, on_feedback: Callable[[Any], None] | None = None,
    ) -> Any | None:
        """The handle of a goal; None without a reply."""
        try:
            return self._done('the reply of policy/fly', lambda: self._fly.send_goal_async(goal, on_feedback), timeout_s)
        except GraphTimeoutError:
            return None

    def _done(self, what: str, ask: Callable[[], Future], timeout_s: float) -> Any:
        """The result of the future that `ask` returns in the spinning thread.

        rclpy's action client notes what it has sent only after sending it: in another thread the reply can be met
        before the note, and is dropped.
        """
        asked = self._executor.create_task(ask)
        self.wait(what, lambda: (asked.done() and asked.result().done()) or None, timeout_s)
        return asked.result().result()
