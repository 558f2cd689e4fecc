"""A person flies from a window of the page: one window at a time, and HOLD always wins."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Mapping
from typing import Any

from geometry_msgs.msg import TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from advise_ros.console.board import Board
from advise_ros.console.flight_goals import Reply, no
from advise_ros.console.language import mark
from advise_ros.core.flight.hand import HandStick
from advise_ros.core.units import ZERO, Vector
from advise_ros.ros import qos
from advise_ros.ros.flying import between_poses_ns, velocity_command

PERIOD_S = 0.05
# A window that is silent for this long has let go for good; another may take the stick.
GONE_S = 3.0
POLICY_FLIES = ('to start', 'flying')


class HandFlight:
    """Velocity commands of the one window that has the stick; everything but `stick` in the thread of the node's executor.

    Args:
        node: that publishes `cmd_vel`.
        board: gets the section `hand`: the window that has the stick, and why nothing is flown.
        speed_m_s, climb_m_s: at full stick.
    """

    def __init__(self, node: Node, board: Board, speed_m_s: float, climb_m_s: float) -> None:
        self._node, self._board = node, board
        self._speeds = (speed_m_s, climb_m_s)
        self._stick = HandStick(*self._speeds)
        self._owner, self._heard_s = '', 0.0
        self._inbox: deque[tuple[str, Vector, float]] = deque(maxlen=20)
        self._commands = node.create_publisher(TwistStamped, 'cmd_vel', qos.COMMAND)
        node.create_timer(PERIOD_S, self._on_tick, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._show()

    def stick(self, window: str, given: Mapping[str, Any]) -> None:
        """A position of a window's stick, from any thread; what is no stick is dropped.

        Args:
            window: its id.
            given: `stick` (east, north, up from -1 to 1) and `at`, seconds of the window's clock.
        """
        values = given.get('stick'), given.get('at')
        stick, at = values
        if isinstance(stick, list) and len(stick) == len(ZERO) and all(type(one) in (int, float) for one in (*stick, at)):
            self._inbox.append((window, (float(stick[0]), float(stick[1]), float(stick[2])), float(at)))

    def take(self, window: str) -> Reply:
        """Give a window the stick.

        Args:
            window: its id.
        """
        if self._owner and self._owner != window:
            return no(mark('another window flies; let go there first'))
        if self._phase() in POLICY_FLIES:
            return no(mark('the policy flies; HOLD first'))
        self._owner, self._heard_s, self._stick = window, time.monotonic(), HandStick(*self._speeds)
        self._inbox.clear()
        self._show()
        return {'ok': True, 'message': mark('you fly: arrow keys, sticks or gamepad')}

    def release(self, window: str = '') -> Reply:
        """Take the stick from a window, '' whichever has it; the vehicle stops.

        Args:
            window: its id.
        """
        if self._owner and window in ('', self._owner):
            self._owner = ''
            self._stick.let_go()
            self._publish(time.monotonic())
            self._show()
        return {'ok': True, 'message': mark('the stick is let go')}

    def _phase(self) -> str:
        return str(self._value('flight').get('phase', ''))

    def _value(self, name: str) -> Mapping[str, Any]:
        section = self._board.sections.get(name)
        return {} if section is None or section.value is None else section.value

    def _on_tick(self) -> None:
        now_s = time.monotonic()
        while self._inbox:
            window, stick, at_s = self._inbox.popleft()
            if window == self._owner and self._stick.move(stick, at_s, now_s):
                self._heard_s = now_s
        if self._owner and (now_s - self._heard_s > GONE_S or self._phase() in POLICY_FLIES):
            self.release()
        self._publish(now_s)

    def _publish(self, now_s: float) -> None:
        """A policy that begins has the vehicle: not even a zero goes beside its commands."""
        velocity = self._stick.velocity(now_s)
        if velocity is not None and self._value('vehicle').get('commandable') and self._phase() not in POLICY_FLIES:
            self._commands.publish(velocity_command(velocity, between_poses_ns(self._node.get_clock().now().nanoseconds)))

    def _show(self) -> None:
        self._board.put('hand', {'window': self._owner})
