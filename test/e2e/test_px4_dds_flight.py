"""PX4 by its DDS topics from the first demonstration to the replay; PX4 is a STAND-IN (support/px4_dds.py) in real time."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped
from std_srvs.srv import Trigger

from advise_msgs.action import Fly
from advise_msgs.msg import Policy, VehicleStatus
from advise_ros.ros import qos
from support.flying import until_heard
from support.foreign_messages import PX4
from support.graph import Graph
from support.policies import square
from support.scripted_px4 import ScriptedPx4

PATIENCE_S = 120.0
STAGES = ('demonstrations', 'policies', 'commands', 'flight statuses')


@pytest.fixture
def px4(graph: Graph) -> Iterator[Any]:
    PX4.load()
    from support.px4_dds import Px4OnDds

    one = Px4OnDds(graph, ScriptedPx4(drift_ned=(0.1, -0.1, 0.05)))
    yield one
    one.close()


def test_a_square_is_taught_learnt_flown_and_replayed(graph: Graph, px4: Any, square_file: str, tmp_path: Path) -> None:
    grid, on_grid, bag = square(), {'grid_file': square_file}, tmp_path / 'bag'
    logger = graph.start('logger', {'bag': str(bag)})
    graph.start(
        'mavlink_bridge', {**on_grid, 'url': 'px4_dds:'}, remaps={'cmd_vel': 'guard/cmd_vel'}, env=PX4.environment(graph.env))
    for name in ('guard', 'recorder', 'policy', 'advise'):
        graph.start(name, on_grid)
    until_heard(graph, '/pose', '/recorder', timeout_s=PATIENCE_S)

    pilot = graph.start('pilot', {**on_grid, 'noise_rate': 0.0, 'heard_timeout_s': PATIENCE_S})
    learnt = graph.wait_for('advise/policy', Policy, lambda p: p.demonstrations == 1, qos.latched(), timeout_s=PATIENCE_S)
    assert pilot.wait_exit(PATIENCE_S) == 0, pilot.text

    graph.wait_for('vehicle_status', VehicleStatus, lambda s: s.ready and not s.armed, qos.latched(), new=True)
    assert graph.call(Trigger, 'mavlink_bridge/takeoff').success
    graph.wait_for('vehicle_status', VehicleStatus, lambda s: s.commandable, qos.latched(), new=True)
    flown = graph.listen('pose', PoseStamped, qos.SENSOR)
    begun = len(flown)
    handle = graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=0, policy_version=learnt.version))
    result = graph.result(handle, PATIENCE_S).result
    assert (result.success, result.steps) == (True, 8), result.message
    places = [one.pose.position for one in flown[begun:]]
    assert set(grid.waypoints) <= {grid.cell_at(place.x, place.y) for place in places}
    assert not px4.outside_offboard
    assert graph.call(Trigger, 'mavlink_bridge/land').success
    graph.wait_for('vehicle_status', VehicleStatus, lambda s: not s.armed, qos.latched(), new=True)
    logger.signal(signal.SIGINT)
    assert logger.wait_exit() == 0, logger.text

    replay = graph.run('replay', str(bag), '--json', str(tmp_path / 'report.json'), timeout_s=PATIENCE_S)
    assert replay.popen.returncode == 0, replay.describe()
    report = json.loads((tmp_path / 'report.json').read_text())
    stages = {stage['name']: stage for stage in report['stages']}
    for name in STAGES:
        assert stages[name]['equal'] == stages[name]['checked'] >= 1, (name, replay.describe())
