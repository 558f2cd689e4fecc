"""The parameters of every node in the graph, read as nodes appear, without ever waiting."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.task import Future

# A request may go to a node that was killed and is still discovered: after this many refreshes it is sent again.
PATIENCE = 6
PARAMETER_EVENTS = '/parameter_events'

OnParameters = Callable[[str, dict[str, Any]], None]


class ParameterWatch:
    """Asks each node once for all its parameters; one that was started again is asked again.

    Nodes of the same name are distinguished by their publisher of parameter events, which rclpy and rclcpp give
    every node: a killed one stays in the graph for a while, and its successor may come before it is gone.

    Call `refresh` now and then; answers arrive through the executor.
    """

    def __init__(self, node: Node, on_parameters: OnParameters) -> None:
        self._node = node
        self._on_parameters = on_parameters
        self._clients: dict[str, tuple[Client, Client]] = {}
        # Nodes that were asked, by name: the identities of their publishers.
        self._asked: dict[str, set[bytes]] = {}
        self._unanswered: dict[str, int] = {}

    def refresh(self) -> None:
        present = self._present()
        gone = (set(self._asked) | set(self._clients)) - set(present)
        anew = {name for name, asked in self._asked.items() if present.get(name, set()) - asked}
        for name in gone | anew | self._not_answering():
            self._forget(name)
            self._asked.pop(name, None)
        for name in set(present) - set(self._asked):
            self._ask_when_ready(name, present[name])

    def _present(self) -> dict[str, set[bytes]]:
        found: dict[str, set[bytes]] = {}
        for publisher in self._node.get_publishers_info_by_topic(PARAMETER_EVENTS):
            if not publisher.node_name.startswith('_'):
                name = f'{publisher.node_namespace.rstrip("/")}/{publisher.node_name}'
                found.setdefault(name, set()).add(bytes(publisher.endpoint_gid))
        return found

    def _not_answering(self) -> set[str]:
        """Nodes that were asked a while ago."""
        self._unanswered = {name: refreshes + 1 for name, refreshes in self._unanswered.items()}
        return {name for name, refreshes in self._unanswered.items() if refreshes > PATIENCE}

    def _ask_when_ready(self, name: str, identities: set[bytes]) -> None:
        if name not in self._clients:
            self._clients[name] = (
                self._node.create_client(ListParameters, f'{name}/list_parameters'),
                self._node.create_client(GetParameters, f'{name}/get_parameters'),
            )
        lister, getter = self._clients[name]
        if lister.service_is_ready() and getter.service_is_ready():
            self._asked[name] = identities
            self._unanswered[name] = 0
            lister.call_async(ListParameters.Request()).add_done_callback(
                lambda future: self._listed(name, future)
            )

    def _listed(self, name: str, future: Future) -> None:
        clients, response = self._clients.get(name), future.result()
        if clients is None or response is None:
            return
        names = list(response.result.names)
        clients[1].call_async(GetParameters.Request(names=names)).add_done_callback(
            lambda answer: self._got(name, names, answer)
        )

    def _got(self, name: str, names: list[str], future: Future) -> None:
        response = future.result()
        if response is not None:
            self._on_parameters(name, _as_python(names, response.values))
        self._forget(name)

    def _forget(self, name: str) -> None:
        self._unanswered.pop(name, None)
        for client in self._clients.pop(name, ()):
            self._node.destroy_client(client)


def _as_python(names: list[str], values: list[ParameterValue]) -> dict[str, Any]:
    return {name: parameter_value_to_python(value) for name, value in zip(names, values, strict=False)}
