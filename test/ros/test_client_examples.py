"""The examples of clients that let the drone fly, as they stand, against the policy node and a vehicle of plain arithmetic."""

from __future__ import annotations

import signal
import sys

import pytest

from advise_msgs.action import Fly
from advise_msgs.msg import FlightStatus, Policy
from advise_ros.ros import qos
from support.graph import Graph
from support.mock_bridge import MockBridge
from support.paths import ROOT
from support.policies import best, policy_message, square
from support.processes import Process

EXAMPLES = ('fly_client.py', 'behaviour_tree.py')


def start(graph: Graph, example: str) -> Process:
    return graph.start_command(example, [sys.executable, str(ROOT / 'examples' / example)], graph.env)


@pytest.mark.parametrize('example', EXAMPLES)
def test_it_flies_says_why_not_and_cancels(graph: Graph, example: str) -> None:
    grid = square()
    bridge = MockBridge(graph, grid, speedup=20.0)
    statuses = graph.listen('policy/status', FlightStatus, qos.latched(100))
    graph.start('policy', {'speed_m_s': 2.0, 'pose_timeout_s': 30.0})
    refused = start(graph, example)
    code = refused.wait_exit()
    assert f'error {Fly.Result.NO_POLICY}: ' in refused.text
    assert code == (1 if example == 'fly_client.py' else 0)

    graph.publisher('advise/policy', Policy, qos.latched()).publish(policy_message(grid, best(grid)))
    graph.cancel(graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1)))
    graph.wait_until(lambda: statuses[-1].phase == FlightStatus.CANCELED, what='the end of the flight that shows it is ready')
    flown = start(graph, example)
    assert flown.wait_exit() == 0
    assert statuses[-1].phase == FlightStatus.SUCCEEDED
    assert 'final waypoint' in flown.text or 'SUCCESS' in flown.text, flown.text

    bridge.slow_down(2.0)
    canceled = start(graph, example)
    graph.wait_until(lambda: statuses[-1].phase == FlightStatus.FLYING, what='flight')
    canceled.signal(signal.SIGINT)
    graph.wait_until(lambda: statuses[-1].phase == FlightStatus.CANCELED, what='the end of the flight')
    canceled.wait_exit()
