"""A single-threaded executor at two thirds of the cost of rclpy's.

rclpy 7.1's executors wake themselves twice for each callback, which only helps those with several threads, and
wrap each callback into a task. This one runs what is ready, then waits. Everything else is rclpy's own:
the order (waitables, timers, subscriptions, guard conditions, clients, services), callback groups, coroutines
that wait for futures, what is raised. Measured by benchmarks/executor.py.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from inspect import iscoroutinefunction
from typing import Any

from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.timer import Timer
from rclpy.waitable import NumberOfEntities, Waitable

InvalidHandle = rclpy_implementation.InvalidHandle
# Kinds of entities with their name in a wait set, in the order in which they are run.
KINDS = (
    ('timers', 'timer'), ('subscriptions', 'subscription'), ('guards', 'guard_condition'), ('clients', 'client'),
    ('services', 'service'),
)
# What this rests on beside the public interface; where one of them is missing, rclpy's own executor serves.
NEEDED = (
    '_take_timer', '_take_subscription', '_take_guard_condition', '_take_client', '_take_service', '_take_waitable',
    '_make_handler', 'can_execute', '_guard', '_sigint_gc', '_tasks', '_tasks_lock', '_is_shutdown', '_context',
)

Found = dict[str, list[tuple[Any, Any]]]
Ready = tuple[Callable[[Any], Any], Any, Any]


def make_executor() -> SingleThreadedExecutor:
    """The lean one, if this rclpy is made as it expects."""
    executor = LeanExecutor()
    return executor if all(hasattr(executor, name) for name in NEEDED) else SingleThreadedExecutor()


class LeanExecutor(SingleThreadedExecutor):
    """Runs callbacks in the thread that calls `spin`; entities are made and destroyed in that thread only."""

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for callbacks and run all that are ready; with a time limit, rclpy's way: one of them."""
        if timeout_sec is not None:
            super().spin_once(timeout_sec)
            return
        self._run_tasks()
        if self._is_shutdown:
            return
        for take, entity, node in self._wait():
            if entity.callback_group.can_execute(entity):
                self._run(take, entity, node)

    def _run_tasks(self) -> None:
        """Whatever waits for futures may go on; what ends may be waited for by another one."""
        ended = True
        while ended:
            with self._tasks_lock:
                tasks = list(self._tasks)
            for task, _, _ in tasks:
                task()
                if task.done():
                    task.result()  # It raises what the task raised.
            ended = any(task.done() for task, _, _ in tasks)
            with self._tasks_lock:
                self._tasks = [one for one in self._tasks if not one[0].done() and not one[0].cancelled()]

    def _wait(self) -> list[Ready]:
        """Block until something is ready, and say what."""
        found = self._entities()
        held: list[Any] = []
        try:
            for handle in self._handles(found):
                handle.__enter__()
                held.append(handle)
            wait_set = self._wait_set(found)
            wait_set.wait(-1)
            if not self._context.ok():
                raise ExternalShutdownException
            if self._is_shutdown:
                return []
            return list(self._ready(wait_set, found))
        except InvalidHandle:  # Destroyed a moment ago by another thread: look again.
            return []
        finally:
            for handle in held:
                handle.__exit__(None, None, None)

    def _entities(self) -> Found:
        """What may be run now, with its node."""
        nodes = self.get_nodes()
        found = {
            kind: [(entity, node) for node in nodes for entity in getattr(node, kind) if self.can_execute(entity)]
            for kind in ('waitables', *(kind for kind, _ in KINDS))
        }
        for guard, _ in found['guards']:
            if guard._executor_triggered:  # It was ready when its callback group was not.
                guard.trigger()
        return found

    def _handles(self, found: Found) -> Iterator[Any]:
        """What must not be destroyed while it is waited for."""
        yield from (entity.handle for kind, _ in KINDS for entity, _ in found[kind])
        yield from (waitable for waitable, _ in found['waitables'])
        yield from (self._guard.handle, self._sigint_gc.handle)

    def _wait_set(self, found: Found) -> Any:
        count = NumberOfEntities(
            len(found['subscriptions']), len(found['guards']) + 2, len(found['timers']), len(found['clients']),
            len(found['services']),
        )
        for waitable, _ in found['waitables']:
            count += waitable.get_num_entities()
        wait_set = rclpy_implementation.WaitSet(
            count.num_subscriptions, count.num_guard_conditions, count.num_timers, count.num_clients, count.num_services,
            count.num_events, self._context.handle,
        )
        wait_set.clear_entities()
        for kind, name in KINDS:
            add = getattr(wait_set, f'add_{name}')
            for entity, _ in found[kind]:
                add(entity.handle)
        for own in (self._guard, self._sigint_gc):
            wait_set.add_guard_condition(own.handle)
        for waitable, _ in found['waitables']:
            waitable.add_to_wait_set(wait_set)
        return wait_set

    def _ready(self, wait_set: Any, found: Found) -> Iterator[Ready]:
        for waitable, node in found['waitables']:
            if waitable.is_ready(wait_set):
                yield self._take_waitable, waitable, node
        for kind, name in KINDS:
            pointers = wait_set.get_ready_entities(name)
            if pointers:
                take = getattr(self, f'_take_{name}')
                for entity, node in found[kind]:
                    if entity.handle.pointer in pointers:
                        if name == 'guard_condition':
                            entity._executor_triggered = True
                        yield take, entity, node

    def _run(self, take: Callable[[Any], Any], entity: Any, node: Any) -> None:
        callback = None if isinstance(entity, Waitable) else getattr(entity, 'callback', None)
        if callback is None or iscoroutinefunction(callback):  # It may have to wait: a task that can.
            task = self._make_handler(entity, node, take)
            task()
            if task.done():
                task.result()
            return
        if isinstance(entity, Timer) and not self._still_due(entity):
            return
        execute = take(entity)
        if execute is not None:
            try:
                execute().send(None)  # A plain callback never waits: its coroutine ends at once.
            except StopIteration:
                pass

    @staticmethod
    def _still_due(timer: Any) -> bool:
        """A callback before it may have put it off, or destroyed it."""
        try:
            return bool(timer.handle.is_timer_ready())
        except InvalidHandle:
            return False
