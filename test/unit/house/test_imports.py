"""Nodes that neither learn nor draw start fast: what takes seconds to load stays out of them."""

from __future__ import annotations

import subprocess
import sys

import pytest

# Who records or flies has none of these either.
LARGE = ('scipy.sparse', 'scipy.linalg')
SLOW = ('sklearn', 'numba', 'pandas', 'scipy.stats', 'matplotlib', 'cvxpy')
PROGRAM = """
import importlib, sys
importlib.import_module(sys.argv[1])
print(*sorted(set(sys.argv[2:]) & set(sys.modules)))
"""


@pytest.mark.parametrize('node', [
    'advise', 'expert', 'guard', 'logger', 'mavlink_bridge', 'pilot', 'policy', 'recorder', 'simulator', 'teleop',
])
def test_a_node_does_not_load_what_it_never_uses(node: str) -> None:
    command = [sys.executable, '-c', PROGRAM, f'advise_ros.nodes.{node}', *SLOW]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


@pytest.mark.parametrize('node', ['guard', 'logger', 'mavlink_bridge', 'policy', 'recorder'])
def test_a_node_beside_the_vehicle_loads_no_linear_algebra(node: str) -> None:
    command = [sys.executable, '-c', PROGRAM, f'advise_ros.nodes.{node}', *LARGE]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


@pytest.mark.parametrize('node', ['logger', 'policy'])
def test_a_node_without_a_link_loads_no_mavlink(node: str) -> None:
    command = [sys.executable, '-c', PROGRAM, f'advise_ros.nodes.{node}', 'pymavlink']
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
