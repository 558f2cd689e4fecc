"""The learnt route leaves the page as a file and as a vehicle's mission; and what axe has to say of the page."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser

from advise_msgs import msg
from advise_ros.core.grid.grid import Grid, optimal_actions
from advise_ros.missions.files import read_mission
from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.ros import convert, qos
from support.browser import PHONE, Person, start_console
from support.graph import Graph

GRID = Grid(2.0, 4, 2, (-1.0, -1.0), 2.0, waypoints=(3, 4))

DARK = "(dark) => document.querySelector('.console').classList.contains('dark') === dark"


def learnt(graph: Graph) -> None:
    """A policy that flies the route, and a question, published as a learner does."""
    grid = convert.grid_to_msg(GRID)
    greedy = [max(optimal_actions(GRID, state), default=0) for state in range(GRID.n_states)]
    policy = msg.Policy(version=1, grid=grid, greedy=greedy, probabilities=[0.25] * 4 * GRID.n_states)
    query = msg.AdviceQuery(query_id=1, policy_version=1, grid=grid, budget_left=-1, question='Which way?', states=[1, 2])
    query.demonstrated = query.policy = [0.25] * 4
    graph.publisher('advise/policy', msg.Policy, qos.latched(), readers=0).publish(policy)
    graph.publisher('advise/query', msg.AdviceQuery, qos.latched(), readers=0).publish(query)


@pytest.fixture
def address(graph: Graph, tmp_path: Path, free_udp_port: int) -> str:
    grid = tmp_path / 'grid.yaml'
    grid.write_text(yaml.safe_dump({'grid': {**grid_to_mapping(GRID), 'origin_wgs84': [47.3977, 8.5456]}}))
    learnt(graph)
    graph.start('simulator', {'endpoint': f'udpout:127.0.0.1:{free_udp_port}', 'autopilot': 'px4'})
    return start_console(graph, grid_file=str(grid), mission_url=f'udpin:127.0.0.1:{free_udp_port}')[1]


def test_the_route_leaves_as_a_file_and_as_a_mission(address: str, browser: Browser, tmp_path: Path) -> None:
    anna = Person(browser, address, 'Anna')
    with anna.page.expect_download() as begun:
        anna.at('route-plan').click()
    saved = tmp_path / begun.value.suggested_filename
    begun.value.save_as(saved)
    assert saved.name == 'route.plan' and len(read_mission(saved).waypoints) >= 3
    anna.at('route-upload').click()
    anna.shows('note', 'vehicle 1 (px4) has the route: take-off and ')
    assert not anna.errors


@pytest.mark.parametrize('scheme', ['light', 'dark'])
def test_axe_finds_nothing(address: str, browser: Browser, scheme: str) -> None:
    for viewport in (None, PHONE):
        anna = Person(browser, address, 'Anna', viewport=viewport)
        anna.page.emulate_media(color_scheme=scheme)
        anna.at('question').wait_for()
        anna.page.wait_for_function(DARK, arg=scheme == 'dark')
        found = Axe().run(anna.page)
        assert not found.violations_count, found.generate_report()
