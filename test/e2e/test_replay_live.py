"""The real nodes live through a recorded session again and publish the same."""

import json
from pathlib import Path

from support.graph import Graph

BAG = Path(__file__).parents[2] / 'bags' / 'simulated_session'
PATIENCE_S = 200.0
WATCHDOG_SHARE = 0.1


def test_the_real_nodes_give_what_the_bag_holds(graph: Graph, tmp_path: Path) -> None:
    report = tmp_path / 'report.json'
    arguments = ('--live', '--speed', '60', '--domain', str(graph.domain_id), '--json', str(report))
    replay = graph.run('replay', str(BAG), *arguments, timeout_s=PATIENCE_S)
    assert replay.popen.returncode in (0, 1), replay.describe()
    stages = {stage['name']: stage for stage in json.loads(report.read_text())['stages']}
    for name in ('demonstrations', 'policies', 'queries', 'commands', 'flight statuses'):
        live = stages[f'{name}, live']
        # The policy's watchdog is on steady time: sixty times as fast, a pause of the machine is a hold to it.
        allowed = WATCHDOG_SHARE * live['checked'] if name in ('commands', 'flight statuses') else 0
        assert live['checked'] - live['equal'] <= allowed, replay.describe()
        assert live['equal'] >= 1
        assert name == 'flight statuses' or live['checked'] >= stages[name]['checked'] - 5


def test_other_parameters_cannot_be_lived_through(graph: Graph) -> None:
    replay = graph.run('replay', str(BAG), '--live', '-p', 'advise.clusters:=3')
    assert replay.popen.returncode == 2 and 'leave --override out' in replay.describe()
