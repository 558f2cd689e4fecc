"""The lean executor does what rclpy's does: order, waiting callbacks, what is destroyed or put off, what is raised."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

from advise_ros.ros.executor import LeanExecutor
from support.graph import Graph

STEADY = Clock(clock_type=ClockType.STEADY_TIME)


class Lean:
    """A node in a lean executor in a thread of its own."""

    def __init__(self, graph: Graph) -> None:
        self.node = Node('lean', context=graph.context)
        self.executor = LeanExecutor(context=graph.context)
        self.executor.add_node(self.node)
        self.raised: list[BaseException] = []
        self._thread = threading.Thread(target=self._spin, daemon=True)

    def start(self) -> None:
        self._thread.start()

    def _spin(self) -> None:
        try:
            self.executor.spin()
        except ValueError as problem:
            self.raised.append(problem)

    def close(self) -> None:
        self.executor.shutdown()
        self._thread.join(10)
        assert not self._thread.is_alive()
        self.node.destroy_node()


@pytest.fixture
def lean(graph: Graph) -> Iterator[Lean]:
    made = Lean(graph)
    yield made
    made.close()


def serve(lean: Lean, name: str, callback: Callable[..., Any], group: Any = None) -> None:
    lean.node.create_service(Trigger, name, callback, callback_group=group)


def test_a_callback_that_waits_lets_others_run_and_goes_on(graph: Graph, lean: Lean) -> None:
    first, second = Future(), Future()

    async def wait(_: Any, response: Any) -> Any:
        response.message = await first + await second
        return response

    def chain(_: Any, response: Any) -> Any:
        first.set_result('one ')
        lean.executor.create_task(lambda: second.set_result('two'))
        return response

    serve(lean, 'waits', wait, ReentrantCallbackGroup())
    serve(lean, 'chains', chain)
    lean.start()
    client = graph.node.create_client(Trigger, 'waits')
    graph.wait_until(client.service_is_ready)
    answered = client.call_async(Trigger.Request())
    graph.call(Trigger, 'chains')
    assert graph.wait_future(answered).message == 'one two'


def test_a_waiting_callback_keeps_its_group_closed(graph: Graph, lean: Lean) -> None:
    opened, order = Future(), []
    group = MutuallyExclusiveCallbackGroup()

    async def hold(_: Any, response: Any) -> Any:
        order.append('holds')
        graph.notify()
        await opened
        order.append('lets go')
        return response

    serve(lean, 'holds', hold, group)
    lean.node.create_timer(0.01, lambda: order.append('timer'), callback_group=group, clock=STEADY)
    lean.start()
    client = graph.node.create_client(Trigger, 'holds')
    graph.wait_until(client.service_is_ready)
    answered = client.call_async(Trigger.Request())
    graph.wait_until(lambda: 'holds' in order)
    lean.executor.create_task(lambda: opened.set_result(None))
    graph.wait_future(answered)
    assert order[order.index('holds') + 1] == 'lets go'
    graph.wait_until(lambda: order[-1] == 'timer', what='the timer to run again')


def test_a_timer_that_a_callback_before_it_puts_off_or_destroys_does_not_fire(graph: Graph, lean: Lean) -> None:
    fired: list[str] = []
    others: list[Any] = []

    def put_off() -> None:
        fired.append('first')
        for other in others:
            other.reset()
        graph.notify()

    lean.node.create_timer(0.05, put_off, clock=STEADY)
    others.append(lean.node.create_timer(0.06, lambda: fired.append('put off'), clock=STEADY))
    gone = lean.node.create_timer(10.0, lambda: fired.append('gone'), clock=STEADY)
    lean.node.create_timer(0.05, lambda: lean.node.destroy_timer(gone), clock=STEADY)
    lean.start()
    graph.wait_until(lambda: fired.count('first') > 3)
    assert set(fired) == {'first'}


def test_a_guard_condition_wakes_it_from_another_thread(graph: Graph, lean: Lean) -> None:
    woken = threading.Event()
    guard = lean.node.create_guard_condition(woken.set)
    lean.start()
    guard.trigger()
    assert woken.wait(20)


def test_what_a_callback_raises_ends_the_spinning(graph: Graph, lean: Lean) -> None:
    def fail() -> None:
        raise ValueError('no')

    lean.node.create_timer(0.01, fail, clock=STEADY)
    lean.start()
    graph.wait_until(lambda: lean.raised, what='the error')
    assert str(lean.raised[0]) == 'no'
