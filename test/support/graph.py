"""A private ROS graph for one test. How to use it stands in test/ros/conftest.py."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import rclpy
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions

from advise_ros.ros.background import BackgroundSpin
from support.fork_server import ForkServers, is_read_early
from support.processes import Process, Started, executable, ros_arguments, start_fresh

# A busy machine may take long for anything; who waits in vain waits once.
PATIENCE_S = 120.0
QoS = QoSProfile | int


class Graph:
    """Executables in one ROS domain and a node of the test that talks to them.

    Attributes:
        node: the test's node, spinning in a background thread.
        processes: everything started so far.
        env: the environment that processes are started with.
    """

    def __init__(
        self, domain_id: int, env: Mapping[str, str], namespace: str = '', forks: ForkServers | None = None,
    ) -> None:
        self.domain_id = domain_id
        self._forks = forks
        self.env = dict(env)
        self.processes: list[Process] = []
        self._changed = threading.Condition()
        self._heard: dict[tuple[str, type], list[Any]] = {}
        self._publishers: dict[tuple[str, type], Any] = {}
        self._clients: dict[tuple[str, type], Any] = {}
        self.context = Context()
        rclpy.init(args=[], context=self.context, domain_id=domain_id, signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node('test', namespace=namespace, context=self.context, enable_rosout=False, start_parameter_services=False)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self._spin = BackgroundSpin(self.executor, 'test-node')

    def notify(self) -> None:
        """Look again at what is waited for."""
        with self._changed:
            self._changed.notify_all()

    # -- processes ---------------------------------------------------------------------------
    def start(
        self,
        name: str,
        params: Mapping[str, Any] | None = None,
        remaps: Mapping[str, str] | None = None,
        env: Mapping[str, str] | None = None,
        args: Sequence[str] = (),
        namespace: str = '',
    ) -> Process:
        """Start an executable; `args` come before the ROS arguments.

        Where the graph has `forks` it is forked, unless `env` holds what imports may read.
        """
        command = [executable(name), *args, *ros_arguments(params or {}, remaps or {}, namespace)]
        given = {**self.env, **(env or {})}
        forks = None if any(map(is_read_early, env or {})) else self._forks
        return self._watch(name, forks.start(command, given) if forks else start_fresh(command, given))

    def start_fresh(self, name: str, params: Mapping[str, Any] | None = None, **more: Any) -> Process:
        """As `start`, but from nothing, never forked."""
        forks, self._forks = self._forks, None
        try:
            return self.start(name, params, **more)
        finally:
            self._forks = forks

    def start_command(self, name: str, command: Sequence[str], env: Mapping[str, str] | None = None) -> Process:
        """Start any program in the graph's environment."""
        return self._watch(name, start_fresh(command, {**self.env, **(env or {})}))

    def _watch(self, name: str, started: Started) -> Process:
        process = Process(name, started, self.notify)
        self.processes.append(process)
        return process

    def run(self, name: str, *args: str, timeout_s: float = PATIENCE_S, **started: Any) -> Process:
        """Start an executable with command line arguments and wait for its end."""
        process = self.start(name, args=args, **started)
        process.wait_exit(timeout_s)
        return process

    # -- waiting -----------------------------------------------------------------------------
    def wait_until(self, condition: Callable[[], Any], timeout_s: float = PATIENCE_S, what: str = 'the condition') -> Any:
        """First true value of `condition`; fails after `timeout_s`, or at once when a process fails."""
        deadline = time.monotonic() + timeout_s
        while True:
            value = condition()
            if value:
                return value
            for process in self.processes:
                assert not process.failed, f'while waiting for {what}: {process.describe()}'
            if time.monotonic() > deadline:
                raise AssertionError(self._timeout_text(what, timeout_s))
            with self._changed:
                self._changed.wait(0.05)

    def _timeout_text(self, what: str, timeout_s: float) -> str:
        return '\n'.join([f'{what} did not come within {timeout_s} s', *(p.describe() for p in self.processes)])

    # -- topics ------------------------------------------------------------------------------
    def listen(self, topic: str, kind: type, qos: QoS = 10) -> list[Any]:
        """The growing list of messages heard on a topic since the first call for it."""
        key = (topic, kind)
        if key not in self._heard:
            heard: list[Any] = []
            self._heard[key] = heard

            def take(message: Any) -> None:
                heard.append(message)
                self.notify()

            self.node.create_subscription(kind, topic, take, qos)
        return self._heard[key]

    def wait_for(
        self,
        topic: str,
        kind: type,
        predicate: Callable[[Any], Any] = lambda message: True,
        qos: QoS = 10,
        timeout_s: float = PATIENCE_S,
        new: bool = False,
    ) -> Any:
        """First message for which `predicate` is true: of all heard so far and to come, or only `new` ones."""
        heard = self.listen(topic, kind, qos)
        at = len(heard) if new else 0

        def found() -> list[Any]:
            nonlocal at
            upto = len(heard)
            hits = [message for message in heard[at:upto] if predicate(message)]
            at = upto
            return hits[:1]

        return self.wait_until(found, timeout_s, f'a {kind.__name__} on {topic} (heard {len(heard)})')[0]

    def publisher(self, topic: str, kind: type, qos: QoS = 10, readers: int = 1) -> Any:
        """A publisher of the test's node that `readers` subscriptions are matched with."""
        key = (topic, kind)
        if key not in self._publishers:
            self._publishers[key] = self.node.create_publisher(kind, topic, qos)
        publisher = self._publishers[key]
        self.wait_until(lambda: publisher.get_subscription_count() >= readers, what=f'a reader of {topic}')
        return publisher

    # -- services and actions ----------------------------------------------------------------
    def call(self, kind: type, name: str, request: Any = None, timeout_s: float = PATIENCE_S) -> Any:
        """The response of a service; an empty request by default."""
        key = (name, kind)
        if key not in self._clients:
            self._clients[key] = self.node.create_client(kind, name)
        client = self._clients[key]
        self.wait_until(client.service_is_ready, timeout_s, f'service {name}')
        return self.wait_future(client.call_async(request or kind.Request()), timeout_s, f'the response of {name}')

    def send_goal(
        self, kind: type, name: str, goal: Any, feedback: Callable[[Any], None] | None = None, timeout_s: float = PATIENCE_S,
    ) -> Any:
        """The goal handle of an action (`.accepted`, `.cancel_goal_async()`); `feedback` gets each feedback."""
        key = (name, kind)
        if key not in self._clients:
            self._clients[key] = ActionClient(self.node, kind, name)
        client = self._clients[key]
        self.wait_until(client.server_is_ready, timeout_s, f'action {name}')
        take = None if feedback is None else lambda message: feedback(message.feedback)
        sent = self.in_node_thread(lambda: client.send_goal_async(goal, feedback_callback=take))
        return self.wait_future(sent, timeout_s, f'an answer to the goal of {name}')

    def accepted_goal(self, kind: type, name: str, goal: Any, timeout_s: float = PATIENCE_S) -> Any:
        """The handle of a goal that is sent until its flight begins: the server may hear later than we that it can."""
        def begun() -> Any:
            fed_back: list[Any] = []
            handle = self.send_goal(kind, name, goal, fed_back.append, timeout_s)
            asked = self.in_node_thread(handle.get_result_async)
            self.wait_until(lambda: fed_back or asked.done(), timeout_s, f'{name} to begin or to refuse')
            return handle if fed_back or asked.result().result.flight_id else None

        return self.wait_until(begun, timeout_s, f'{name} to begin')

    def refused_goal(self, kind: type, name: str, goal: Any) -> Any:
        """The result of a goal that is accepted and aborted at once."""
        ended = self.result(self.send_goal(kind, name, goal))
        assert (ended.status, ended.result.flight_id) == (GoalStatus.STATUS_ABORTED, 0), ended
        return ended.result

    def result(self, handle: Any, timeout_s: float = PATIENCE_S) -> Any:
        """The end of an action goal: `.status` and `.result`."""
        asked = self.in_node_thread(handle.get_result_async)
        return self.wait_future(asked, timeout_s, 'the result of the action')

    def cancel(self, handle: Any, timeout_s: float = PATIENCE_S) -> Any:
        """Cancel an action goal."""
        return self.wait_future(self.in_node_thread(handle.cancel_goal_async), timeout_s, 'the cancellation')

    def in_node_thread(self, act: Callable[[], Any]) -> Any:
        """What `act` returns in the spinning thread.

        rclpy's action client notes what it has sent only after sending it: a spinning thread beside it can meet
        the reply before the note, and drops it.
        """
        return self.wait_future(self.executor.create_task(act), what='the test node to act')

    def wait_future(self, future: Any, timeout_s: float = PATIENCE_S, what: str = 'the future') -> Any:
        """The result of an rclpy future."""
        future.add_done_callback(lambda _: self.notify())
        self.wait_until(future.done, timeout_s, what)
        return future.result()

    # -- the end -----------------------------------------------------------------------------
    def close(self) -> list[str]:
        """Stop everything; returns one complaint for each process that had to be forced or had failed."""
        complaints = [f'failed: {process.describe()}' for process in self.processes if process.failed]
        for process in self.processes:  # First tell them all, then wait: they stop side by side.
            process.signal()
        complaints += filter(None, [process.end() for process in self.processes])
        self._spin.stop()
        self.context.try_shutdown()
        self.node.destroy_node()
        return complaints
