"""The console's requests to a graph that does not reply."""

from __future__ import annotations

import pytest
from rclpy.node import Node
from std_srvs.srv import Trigger

from advise_ros.console import requests as desk_module
from advise_ros.console.listener import GraphListener
from advise_ros.console.requests import RequestDispatcher
from support.graph import Graph


def test_a_request_that_nobody_replies_to_is_given_up_and_forgotten(graph: Graph, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(desk_module, 'PATIENCE_S', 0.0)

    silent = Node('silent', context=graph.context)  # No executor has it, so it replies to nothing.
    silent.create_service(Trigger, 'advise/undo', lambda _, response: response)
    requests = RequestDispatcher(graph.node, GraphListener(graph.node, 5.0))
    client = requests._trigger['undo']
    graph.wait_until(client.service_is_ready)
    for _ in range(3):
        reply = requests.act('undo', {}).result(60)
        assert reply['message'].startswith('no reply to undo within 0 s')
    graph.wait_until(lambda: not client._pending_requests)
    silent.destroy_node()
