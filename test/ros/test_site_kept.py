"""What was learnt of a site is kept, and another route over it needs no flight."""

from __future__ import annotations

import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from nav_msgs.msg import OccupancyGrid
from std_msgs.msg import String

from advise_msgs.msg import LearnerStatus
from advise_ros.commands import replay, site_map
from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.raster import Raster
from advise_ros.recording.mapfile import map_texts
from advise_ros.recording.sitefile import load_site
from advise_ros.ros import convert, qos
from support.graph import Graph
from support.learner import LATCHED, Learner, write_grid
from support.walks import walk

GRID = Grid(2.0, 5, 5, (-1.0, -1.0), 3.0, waypoints=(4, 24, 20, 0))
OTHER = replace(GRID, waypoints=(14, 22, 10))
ON_SITE = {'acquisition': 'site', 'enough': 0.25}


def flights(number: int) -> list[Demonstration]:
    return [walk(GRID, index) for index in range(number)]


def test_learnt_on_one_route_flown_on_another_and_replayed_from_the_bag_alone(
    graph: Graph, tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:
    bag, site = tmp_path / 'bag', tmp_path / 'site.yaml'
    logger = graph.start('logger', {'bag': str(bag), 'flush_s': 0.1})
    first = Learner(graph, write_grid(tmp_path, GRID), **ON_SITE, site_map_out=str(site))
    for flight in flights(3):
        first.publish(convert.demonstration_to_msg(flight))
    first.policy(demonstrations=3, log_length=0)
    graph.wait_until(lambda: site.exists() and [len(route.flights) for route in load_site(site, GRID).prior.routes] == [3])
    first.answer(first.open_query(), preferred=[1], avoided=[0, 2, 3])
    first.policy(demonstrations=3, log_length=1)
    graph.wait_until(lambda: [len(route.answers) for route in load_site(site, GRID).prior.routes] == [1])
    assert first.process.terminate() == 0

    (tmp_path / 'other').mkdir()
    second = Learner(graph, write_grid(tmp_path / 'other', OTHER), **ON_SITE, site_map_file=str(site))
    policy = second.policy(demonstrations=0, log_length=0)
    assert convert.grid_from_msg(policy.grid) == OTHER
    second.query_of(policy)
    graph.wait_until(lambda: 'known of the site' in second.process.text and '1 route, 3 flights, 1 answer' in second.process.text)
    given = graph.wait_for('advise/site_prior', String, lambda m: m.data, LATCHED)
    assert '"flights"' in given.data
    graph.wait_for('advise/site_map', OccupancyGrid, lambda m: len(m.data) == 25, LATCHED)
    second.status(LearnerStatus.DONE if not second.queries[-1].query_id else LearnerStatus.ASKING)
    assert second.process.terminate() == 0
    assert logger.terminate(signal.SIGINT) == 0

    site.unlink()  # The bag is enough.
    assert replay.run([str(bag)]) == 0, capsys.readouterr().out
    assert site_map.run([str(bag), '--out', str(tmp_path / 'again.yaml')]) == 0
    kept = load_site(tmp_path / 'again.yaml', OTHER).prior
    assert [(route.waypoints, len(route.flights), len(route.answers)) for route in kept.routes] == [(GRID.waypoints, 3, 1)]
    assert 'with acquisition' not in capsys.readouterr().err


def test_a_map_drawn_by_hand_is_kept_out_of_before_anything_was_flown(graph: Graph, tmp_path: Path) -> None:
    """On cells of 1 m; the route's are 2 m wide."""
    learner = Learner(graph, write_grid(tmp_path, OTHER), **ON_SITE, site_map_file=str(hand_drawn(tmp_path)))
    learner.policy(demonstrations=0, log_length=0)
    heard = graph.wait_for('advise/site_map', OccupancyGrid, lambda m: True, LATCHED)
    assert min(heard.data[cell] for cell in (11, 12, 17)) > 80
    assert heard.data[3] < 20


def hand_drawn(folder: Path) -> Path:
    """Cells 11, 12 and 17 of GRID as a map of 10 x 10 cells of 1 m."""
    values = np.zeros((10, 10))
    values[4:6, 2:6] = values[6:8, 4:6] = 1.0
    described, image = map_texts('hand.pgm', Raster(values, 1.0, (-1.0, -1.0)))
    (folder / 'hand.yaml').write_text(described)
    (folder / 'hand.pgm').write_bytes(image)
    return folder / 'hand.yaml'


@pytest.mark.parametrize(('params', 'words'), [
    ({'acquisition': 'occupancy', 'site_map_file': '{site}'}, "a site's map is of use with acquisition 'site' only"),
    ({'acquisition': 'site', 'site_map_file': '/no/such/site.yaml'}, '/no/such/site.yaml: there is no such file'),
    ({'acquisition': 'site', 'site_map_out': '{site}'}, 'advise did not write it'),
    ({'obstacle_map_file': '{site}', 'obstacle_map_topic': 'map'}, 'leave one of them empty'),
])
def test_wrong_files_end_it_with_one_sentence(graph: Graph, tmp_path: Path, params: dict[str, str], words: str) -> None:
    site = str(hand_drawn(tmp_path))
    given = {name: value.format(site=site) for name, value in params.items()}
    process = graph.start('advise', {'grid_file': write_grid(tmp_path, OTHER), **given})
    assert process.wait_exit() == 2
    assert words in process.text and 'Traceback' not in process.text


def test_obstacles_of_a_map_on_a_topic_are_blocked_for_recorder_learner_and_pilot_alike(graph: Graph, tmp_path: Path) -> None:
    wall = OccupancyGrid()
    wall.header.frame_id = 'map'
    wall.info.resolution, wall.info.width, wall.info.height = 1.0, 2, 2
    wall.info.origin.position.x, wall.info.origin.position.y, wall.info.origin.orientation.w = 3.0, 3.0, 1.0
    wall.data = [100, 0, 0, 0]  # Cell (2, 2), a quarter of it.
    grid_file, blocked = write_grid(tmp_path, GRID), replace(GRID, blocked=(12,))
    by_topic = {'grid_file': grid_file, 'obstacle_map_topic': 'map'}
    learner = Learner(graph, grid_file, obstacle_map_topic='map', clusters=4)
    others = [graph.start(name, by_topic) for name in ('recorder', 'pilot')]
    graph.publisher('map', OccupancyGrid, qos.latched()).publish(wall)
    for node in (learner.process, *others):
        graph.wait_until(lambda node=node: '1 of 25 cells are blocked, with the obstacles of map' in node.text)
    learner.publish(convert.demonstration_to_msg(walk(blocked, 0)))
    policy = learner.policy(demonstrations=1, log_length=0)
    assert convert.grid_from_msg(policy.grid) == blocked
    learner.publish(convert.demonstration_to_msg(walk(GRID, 1)))
    graph.wait_for(
        'advise/status', LearnerStatus, lambda m: 'blocked cells 0 there and 1 ([2, 2] only) here' in m.message, LATCHED,
    )
