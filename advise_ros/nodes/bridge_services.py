"""The services by which a person asks a bridge's vehicle for something, and their answers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from advise_ros.mavlink.requests import Goal, GoalRequest
from advise_ros.ros.managed import ManagedNode


class BridgeServices:
    """`mavlink_bridge/arm`, `takeoff`, `land` and `take_over`: each begins a goal and answers by the vehicle's word.

    Args:
        node: that offers them.
        begin: begins a goal, or answers it at once with a refusal.
    """

    def __init__(self, node: ManagedNode, begin: Callable[[Goal], GoalRequest]) -> None:
        self._begin, self._log = begin, node.get_logger()
        self._pending: list[tuple[GoalRequest, Future]] = []
        group = ReentrantCallbackGroup()
        node.create_service(SetBool, 'mavlink_bridge/arm', self._on_arm, callback_group=group)
        for name, goal in (('takeoff', Goal.TAKEOFF), ('land', Goal.LAND), ('take_over', Goal.TAKE_OVER)):
            node.create_service(Trigger, f'mavlink_bridge/{name}', self._asks(goal), callback_group=group)

    async def _on_arm(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        return await self._ask(Goal.ARM if request.data else Goal.DISARM, response)

    def _asks(self, goal: Goal) -> Callable[[Any, Any], Any]:
        async def on_request(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            return await self._ask(goal, response)

        return on_request

    async def _ask(self, goal: Goal, response: Any) -> Any:
        asked = self._begin(goal)
        if asked.reply is None:
            answered: Future = Future()
            self._pending.append((asked, answered))
            await answered
        assert asked.reply is not None
        response.success, response.message = asked.reply
        if response.success:
            self._log.info(f'{goal.value}: {response.message}')
        else:
            self._log.warning(response.message)
        return response

    def answer(self) -> None:
        """Let the answers go out that are known now."""
        known = [answered for asked, answered in self._pending if asked.reply is not None]
        self._pending = [(asked, answered) for asked, answered in self._pending if asked.reply is None]
        for answered in known:
            answered.set_result(None)

    def give_up(self, why: str) -> None:
        """Answer all that is open with a refusal."""
        for asked, _ in self._pending:
            asked.answer(accepted=False, message=f'{asked.goal.value} given up: {why}')
        self.answer()
