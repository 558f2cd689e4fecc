"""The real nodes live through a recorded session again and publish the same."""

import json
from pathlib import Path

from support.graph import Graph

BAG = Path(__file__).parents[2] / 'bags' / 'simulated_session'
PATIENCE_S = 200.0


def test_the_real_nodes_give_what_the_bag_holds(graph: Graph, tmp_path: Path) -> None:
    report = tmp_path / 'report.json'
    arguments = ('--live', '--speed', '60', '--domain', str(graph.domain_id), '--json', str(report))
    replay = graph.run('replay', str(BAG), *arguments, timeout_s=PATIENCE_S)
    assert replay.popen.returncode == 0, replay.describe()
    stages = {stage['name']: stage for stage in json.loads(report.read_text())['stages']}
    for name in ('demonstrations', 'policies', 'queries', 'commands', 'flight statuses'):
        live = stages[f'{name}, live']
        assert live['equal'] == live['checked'] >= 1, replay.describe()
        # The watchdog's zero velocity is by the clock on the wall and is not asked for.
        assert name == 'flight statuses' or live['checked'] >= stages[name]['checked'] - 5


def test_other_parameters_cannot_be_lived_through(graph: Graph) -> None:
    replay = graph.run('replay', str(BAG), '--live', '-p', 'advise.clusters:=3')
    assert replay.popen.returncode == 2 and 'leave --override out' in replay.describe()
