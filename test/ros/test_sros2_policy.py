"""config/sros2/policy.xml grants what the running nodes have, and no more."""

from __future__ import annotations

import fnmatch
import importlib.util
import sys
from pathlib import Path
from typing import Any

import pytest

from support.foreign_messages import GEOGRAPHIC, PX4
from support.graph import Graph
from support.learner import write_grid
from support.paths import ROOT
from support.walks import GRID_4X4

# A person's tools, and the bridge on another link.
NOT_STARTED = {'operator', 'teleop', 'mavlink_bridge_px4_dds'}
ALWAYS = {'publish': {'rosout', 'parameter_events', 'diagnostics'}, 'subscribe': {'parameter_events', 'clock'}}


@pytest.fixture(scope='module')
def tool() -> Any:
    spec = importlib.util.spec_from_file_location('sros2_policy', ROOT / 'tools' / 'sros2_policy.py')
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_the_file_is_written_from_the_table(tool: Any) -> None:
    assert tool.TARGET.read_text() == tool.text()


def start_all(graph: Graph, names: set[str], folder: Path, port: int) -> None:
    own: dict[str, dict[str, object]] = {
        'simulator': {'endpoint': f'udpout:127.0.0.1:{port}'}, 'mavlink_bridge': {'url': f'udpin:127.0.0.1:{port}'},
        'logger': {'bag': str(folder / 'bag')}, 'console': {'port': 0},
    }
    grid_file = write_grid(folder, GRID_4X4, place=(47.0, 8.0))
    environment = GEOGRAPHIC.environment(graph.env)
    for name in names:
        on_grid = {} if name in {'simulator', 'logger', 'console'} else {'grid_file': grid_file}
        graph.start(name, {**on_grid, **own.get(name, {})}, env=environment)


def heard_of(graph: Graph, name: str, what: str) -> set[str]:
    """Topics or services of a node, relative, actions as one name; none of one that is not there yet."""
    if name not in graph.node.get_node_names():
        return set()
    found = getattr(graph.node, f'get_{what}_names_and_types_by_node')(name, '/')
    return {topic.removeprefix('/').partition('/_action/')[0] for topic, _ in found}


def test_each_node_is_granted_what_it_has(graph: Graph, tool: Any, tmp_path: Path, free_udp_port: int) -> None:
    names = set(tool.GRANTS) - NOT_STARTED
    start_all(graph, names, tmp_path, free_udp_port)
    for name in sorted(names):
        compare(graph, tool, name, tool.GRANTS[name])


def test_the_bridge_to_px4_is_granted_its_topics_too(graph: Graph, tool: Any, tmp_path: Path) -> None:
    grid_file = write_grid(tmp_path, GRID_4X4)
    graph.start('mavlink_bridge', {'url': 'px4_dds:', 'grid_file': grid_file}, env=PX4.environment(graph.env))
    compare(graph, tool, 'mavlink_bridge', tool.GRANTS['mavlink_bridge_px4_dds'])


def compare(graph: Graph, tool: Any, name: str, grants: Any) -> None:
    """A node has what it is granted and no more; of subscriptions and clients it may have less."""
    actions = {*grants.execute, *grants.call}
    wanted = {
        'publisher': {*ALWAYS['publish'], *grants.publish, *grants.execute},
        'service': {*grants.reply, *grants.execute, *(f'{name}/{own[1:]}' for own in tool.PARAMETER_SERVICES)},
    }
    for what, granted in wanted.items():
        graph.wait_until(lambda: not unused(heard_of(graph, name, what), granted), what=f'{name}: {what}s {granted}')  # noqa: B023
        assert not beyond(heard_of(graph, name, what), granted), name
    allowed = {
        'subscriber': {*ALWAYS['subscribe'], *grants.subscribe, *actions}, 'client': {*grants.request, *actions},
    }
    for what, granted in allowed.items():
        assert not beyond(heard_of(graph, name, what), granted), f'{name} has more {what}s than granted'


def unused(names: set[str], granted: set[str]) -> set[str]:
    return {each for each in granted if not fnmatch.filter(names, each)}


def beyond(names: set[str], granted: set[str]) -> set[str]:
    return {one for one in names if not any(fnmatch.fnmatch(one, each) for each in granted)}
