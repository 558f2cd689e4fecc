"""The settings that the learner runs with, asked of its own parameters."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import fields

from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.task import Future

from advise_ros import config
from advise_ros.config import AdviseConfig
from advise_ros.core.errors import InputError
from advise_ros.settings import learn_settings

SERVICE = 'advise/get_parameters'
NAMES = tuple(spec.name for spec in fields(AdviseConfig))
# A request without reply for this long (steady time) is made anew.
PATIENCE_S = 5.0


class LearnerSettings:
    """What the learner was started with; until it has replied, the usual settings.

    Attributes:
        value: the settings.
        own: they are the learner's, not the usual ones.
    """

    def __init__(self, node: Node, on_known: Callable[[], None]) -> None:
        self._node, self._on_known = node, on_known
        self._client = node.create_client(GetParameters, SERVICE)
        self._asked: Future | None = None
        self._asked_s = 0.0
        self.value, self.own = learn_settings(AdviseConfig()), False

    def forget(self) -> None:
        """Another learner has started: ask that one."""
        self._drop()
        self.own = False

    def poll(self) -> None:
        """Ask, unless it is known or on its way."""
        if self._asked is not None and time.monotonic() - self._asked_s > PATIENCE_S:
            self._drop()
        if self.own or self._asked is not None or not self._client.service_is_ready():
            return
        self._asked, self._asked_s = self._client.call_async(GetParameters.Request(names=NAMES)), time.monotonic()
        self._asked.add_done_callback(self._on_reply)

    def _drop(self) -> None:
        if self._asked is not None:
            self._client.remove_pending_request(self._asked)
            self._asked = None

    def _on_reply(self, done: Future) -> None:
        if done is not self._asked:
            return
        self._asked = None
        found = {name: parameter_value_to_python(value) for name, value in zip(NAMES, done.result().values, strict=False)}
        try:
            held = config.build(AdviseConfig, {name: value for name, value in found.items() if value is not None})
        except InputError as problem:
            self._node.get_logger().warning(f'the learner has other parameters than this page knows: {problem}')
            return
        self.value, self.own = learn_settings(held), True
        self._on_known()
