"""Goals for the policy node, and why it refused one."""

from __future__ import annotations

import time
from concurrent.futures import Future as Promise
from typing import Any, NamedTuple

from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.task import Future

from advise_msgs.action import Fly
from advise_ros.console.board import Board
from advise_ros.console.language import mark

Reply = dict[str, Any]
# The reason of a refused goal comes on a topic, within this (steady time).
REASON_PATIENCE_S = 1.0


class Refused(NamedTuple):
    """A goal that was refused when the policy node had refused `known` others."""

    promise: Promise[Reply]
    known: int
    until_s: float


class FlightGoals:
    """Sends goals; call `look` now and then. Everything happens in the thread of the node's executor."""

    def __init__(self, node: Node, board: Board) -> None:
        self._fly = ActionClient(node, Fly, 'policy/fly')
        self._board = board
        self._refused: list[Refused] = []

    @property
    def is_served(self) -> bool:
        """A policy node is there, or was a moment ago."""
        return bool(self._fly.server_is_ready())

    def send(self, promise: Promise[Reply], start_cell: int) -> Future:
        """Fly the newest policy from a cell; the promise gets what the policy node replies."""
        known = self._refusals()[0]
        sent: Future = self._fly.send_goal_async(Fly.Goal(start_cell=start_cell))
        sent.add_done_callback(
            lambda done: None if done.cancelled() else self._on_reply(promise, known, bool(done.result().accepted))
        )
        return sent

    def look(self, now_s: float) -> None:
        """Give the reasons of refusals as they come."""
        count, why = self._refusals()
        for refused in self._refused:
            if count != refused.known:
                resolve(refused.promise, no(mark('the policy node refused: {why}'), why=why))
            elif now_s > refused.until_s:
                resolve(refused.promise, no(mark('the policy node refused, and did not say why; look at its log')))
        self._refused = [refused for refused in self._refused if not refused.promise.done()]

    def _refusals(self) -> tuple[int, str]:
        """How many goals the policy node has refused, and why the last one."""
        flight = self._board.sections.get('flight')
        return (flight.value['refusals'], flight.value['refusal']) if flight else (0, '')

    def _on_reply(self, promise: Promise[Reply], known: int, accepted: bool) -> None:
        if accepted:
            resolve(promise, {'ok': True, 'message': 'on its way', 'say': [mark('on its way'), {}]})
        else:
            self._refused.append(Refused(promise, known, time.monotonic() + REASON_PATIENCE_S))


def no(text: str, **given: object) -> Reply:
    """A reply that says why not; `text` is marked for translation, `{name}` in it stands for what is given."""
    return {'ok': False, 'message': text.format_map(given), 'say': [text, given]}


def resolve(promise: Promise[Reply], reply: Reply) -> None:
    """Give a reply, unless there was one."""
    if not promise.done():
        promise.set_result(reply)
