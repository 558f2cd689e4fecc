"""What flies speaks DDS by UDP alone: it shares no memory, and so no locks, with anybody."""

from __future__ import annotations

from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray

from advise_ros.middleware import LOOPBACK, PROFILES, RANGE, TRANSPORTS, without_shared_memory
from support.graph import Graph
from support.paths import ROOT

OURS = {RANGE: 'SUBNET', PROFILES: str(LOOPBACK), TRANSPORTS: 'UDPv4'}


@pytest.mark.parametrize(('given', 'chosen'), [
    ({RANGE: 'LOCALHOST'}, OURS),
    (OURS, OURS),
    ({**OURS, RANGE: 'LOCALHOST'}, OURS),
    ({}, {TRANSPORTS: 'UDPv4'}),
    ({RANGE: 'SUBNET'}, {RANGE: 'SUBNET', TRANSPORTS: 'UDPv4'}),
    ({RANGE: 'SUBNET', TRANSPORTS: 'DEFAULT'}, {RANGE: 'SUBNET', TRANSPORTS: 'DEFAULT'}),
    ({RANGE: 'LOCALHOST', PROFILES: 'mine.xml'}, {RANGE: 'LOCALHOST', PROFILES: 'mine.xml'}),
])
def test_what_is_chosen(given: dict[str, str], chosen: dict[str, str]) -> None:
    environment = dict(given)
    without_shared_memory(environment)
    assert environment == chosen


@pytest.mark.parametrize('discovery', ['LOCALHOST', 'SUBNET'])
def test_what_flies_shares_no_memory_and_is_found(graph: Graph, discovery: str) -> None:
    node = graph.start_fresh('guard', {'fence': 'off'}, env={RANGE: discovery, PROFILES: '', TRANSPORTS: ''})
    graph.wait_for('/diagnostics', DiagnosticArray, lambda array: array.status[0].name == '/guard')
    assert '/dev/shm/fastrtps' not in Path(f'/proc/{node.pid}/maps').read_text()


def test_others_keep_what_ros_gives_them(graph: Graph) -> None:
    node = graph.start_fresh('recorder', {'grid_file': str(ROOT / 'config' / 'grid_6x6.yaml')})
    graph.wait_for('/diagnostics', DiagnosticArray, lambda array: array.status[0].name == '/recorder')
    assert '/dev/shm/fastrtps' in Path(f'/proc/{node.pid}/maps').read_text()
