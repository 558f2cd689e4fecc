"""The pilot node against a vehicle of plain arithmetic."""

from pathlib import Path

import yaml

from advise_ros.core.grid import Grid
from advise_ros.recording.gridfile import grid_to_mapping
from support.graph import Graph
from support.mock_bridge import MockBridge
from support.policies import square


def grid_file(folder: Path, grid: Grid) -> str:
    path = folder / 'grid.yaml'
    path.write_text(yaml.safe_dump({'grid': grid_to_mapping(grid)}))
    return str(path)


def test_two_demonstrations_are_flown_and_the_pilot_leaves(graph: Graph, tmp_path: Path) -> None:
    grid = square()
    bridge = MockBridge(graph, grid, in_air=False, speedup=20.0)
    pilot = graph.start('pilot', {'grid_file': grid_file(tmp_path, grid), 'flights': 2, 'seed': 3, 'speed_m_s': 2.0})
    assert pilot.wait_exit(60.0) == 0, pilot.text
    assert (bridge.takeoffs, bridge.landings) == (2, 2)
    assert not bridge.strange
    print(pilot.err, len(bridge.commands), bridge.now_ns / 1e9)
