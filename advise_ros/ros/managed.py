"""Nodes with a life cycle, as `ros2 lifecycle` knows it: unconfigured, inactive, active.

https://design.ros2.org/articles/node_lifecycle.html
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import rclpy
from lifecycle_msgs.srv import ChangeState
from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from advise_ros.core.errors import AdviseError, InputError
from advise_ros.ros.configured import ConfiguredNode
from advise_ros.ros.diagnostics import OK, STARTING, WARN, Diagnostics

UNCONFIGURED, INACTIVE, ACTIVE, FINALIZED = 'unconfigured', 'inactive', 'active', 'finalized'
# What leads from a state to the next one on the way to active.
NEXT = {UNCONFIGURED: 'configure', INACTIVE: 'activate'}
# The reply to `shutdown` has to be out before the process ends.
LEAVE_S = 0.5


class ManagedNode(ConfiguredNode, LifecycleNode):
    """A node that takes part in the graph in every state, and acts on the vehicle while it is active only.

    Publishers and services live as long as the node, so that the state can be asked for at any time. What a subclass
    subscribes to (`listen`), which sockets it holds and what it reads of its parameters begins in `open_up` and ends in
    `close_down`; `begin` and `end` are its activation. /diagnostics goes on in every state.

    Attributes:
        state: 'unconfigured', 'inactive', 'active' or 'finalized'.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.state = UNCONFIGURED
        self.diagnostics = Diagnostics(self)
        self._problem: Exception | None = None
        self._inputs: list[Subscription] = []
        self._guard_transitions()

    # -- for subclasses ----------------------------------------------------------------------
    def open_up(self) -> None:
        """Read files, claim sockets, subscribe; raises AdviseError for what the user can put right."""

    def begin(self) -> None:
        """Act on the vehicle from now on."""

    def end(self) -> None:
        """Leave the vehicle at rest."""

    def close_down(self) -> None:
        """Give back what `open_up` claimed, but for subscriptions; called too when `open_up` failed half-way."""

    def listen(self, kind: type, topic: str, callback: Callable[[Any], None], profile: QoSProfile) -> None:
        """Subscribe until the node is cleaned up; for `open_up`."""
        self._inputs.append(self.create_subscription(kind, topic, callback, profile))

    # -- state -------------------------------------------------------------------------------
    @property
    def active(self) -> bool:
        """It acts on the vehicle."""
        return self.state == ACTIVE

    @property
    def unconfigured(self) -> bool:
        return self.state == UNCONFIGURED

    @property
    def why_idle(self) -> str:
        """Why it does nothing now, with the remedy; '' when it is active."""
        if self.active:
            return ''
        name = self.get_fully_qualified_name()
        remedy = f': ros2 lifecycle set {name} {NEXT[self.state]}' if self.state in NEXT else ''
        return f'{name} is {self.state}{remedy}'

    def autostart(self, *, wanted: bool) -> None:
        """Become active at once, if wanted.

        Raises:
            InputError: a parameter or file is wrong, or a port is in use.
        """
        if not wanted:
            self._enter(UNCONFIGURED)
            return
        for change in (self.trigger_configure, self.trigger_activate):
            if change() is not TransitionCallbackReturn.SUCCESS:
                raise self._problem or InputError(f'{self.why_idle} could not be carried out')

    def _enter(self, state: str) -> None:
        self.get_logger().info(f'it is {state}')
        self.state = self.diagnostics.state = state
        self.diagnostics.idle = self.why_idle
        self.diagnostics.set(OK if self.active else WARN, STARTING)

    # -- transitions -------------------------------------------------------------------------
    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._go(INACTIVE, self._open, undo=self._close)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._go(ACTIVE, self.begin, undo=self.end)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._go(INACTIVE, self.end)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._go(UNCONFIGURED, self._close)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        done = self._go(FINALIZED, self._wind_up)
        self.create_timer(LEAVE_S, rclpy.try_shutdown, clock=Clock(clock_type=ClockType.STEADY_TIME))
        return done

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """A transition broke off: back to the start."""
        return self._go(UNCONFIGURED, self._wind_up)

    def _open(self) -> None:
        self.open_up()
        self.check_overrides()

    def _wind_up(self) -> None:
        if self.active:
            self.end()
        if self.state in (ACTIVE, INACTIVE):
            self._close()

    def _close(self) -> None:
        for subscription in self._inputs:
            self.destroy_subscription(subscription)
        self._inputs.clear()
        self.close_down()

    def _go(self, to: str, step: Callable[[], None], undo: Callable[[], None] | None = None) -> TransitionCallbackReturn:
        """Carry out a step; an AdviseError leaves the state as it was, and is logged."""
        try:
            step()
        except AdviseError as problem:
            self._problem = problem
            self.get_logger().error(f'it stays {self.state}: {problem}')
            if undo is not None:
                undo()
            self.diagnostics.idle = f'{self.why_idle}; {problem}'
            self.diagnostics.set(WARN, '')
            return TransitionCallbackReturn.FAILURE
        except Exception as problem:  # rclpy would hide it
            self._problem = problem
            if rclpy.ok():  # Else a signal ended the context in the middle of it.
                self.get_logger().error(f'a transition failed: {problem!r}')
            raise
        if rclpy.ok():  # A signal ends the context before the node.
            self.get_logger().info(f'{self.state} -> {to}')
        self._enter(to)
        return TransitionCallbackReturn.SUCCESS

    def _guard_transitions(self) -> None:
        """A transition that the state does not have is refused; in rclpy 7 it ends the node."""
        service: Any = self._service_change_state
        change = service.callback

        def changed(request: ChangeState.Request, response: ChangeState.Response) -> ChangeState.Response:
            wanted = request.transition
            possible = self._state_machine.available_transitions
            if not any(wanted.label == label if wanted.label else wanted.id == number for number, label, *_ in possible):
                self.get_logger().warning(f'no transition {wanted.label or wanted.id} leads on from {self.state}')
                response.success = False
                return response
            return change(request, response)

        service.callback = changed
