"""Goals for the policy node, and why it refused one."""

from __future__ import annotations

from concurrent.futures import Future as Promise
from typing import Any

from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.task import Future

from advise_msgs.action import Fly
from advise_ros.console.language import mark

Reply = dict[str, Any]


class FlightGoals:
    """Sends goals. Everything happens in the thread of the node's executor."""

    def __init__(self, node: Node) -> None:
        self._fly = ActionClient(node, Fly, 'policy/fly')

    @property
    def is_served(self) -> bool:
        """A policy node is there, or was a moment ago."""
        return bool(self._fly.server_is_ready())

    def send(self, promise: Promise[Reply], start_cell: int) -> Future:
        """Fly the newest policy from a cell; the promise gets what the policy node replies."""
        sent: Future = self._fly.send_goal_async(Fly.Goal(start_cell=start_cell), lambda _: begun(promise))
        sent.add_done_callback(lambda done: None if done.cancelled() else self._on_reply(promise, done.result()))
        return sent

    def _on_reply(self, promise: Promise[Reply], handle: Any) -> None:
        """A flight that begins feeds that back; a goal that was refused ends, and says why."""
        if not handle.accepted:
            resolve(promise, no(mark('the policy node refused, and did not say why; look at its log')))
            return
        handle.get_result_async().add_done_callback(
            lambda done: None if done.cancelled() else ended(promise, done.result().result)
        )


def begun(promise: Promise[Reply]) -> None:
    """The flight is under way."""
    resolve(promise, {'ok': True, 'message': 'on its way', 'say': [mark('on its way'), {}]})


def ended(promise: Promise[Reply], result: Fly.Result) -> None:
    """The flight is over, or never began."""
    if result.flight_id:
        begun(promise)
    else:
        resolve(promise, no(mark('the policy node refused: {why}'), why=result.error_msg))


def no(text: str, **given: object) -> Reply:
    """A reply that says why not; `text` is marked for translation, `{name}` in it stands for what is given."""
    return {'ok': False, 'message': text.format_map(given), 'say': [text, given]}


def resolve(promise: Promise[Reply], reply: Reply) -> None:
    """Give a reply, unless there was one."""
    if not promise.done():
        promise.set_result(reply)
