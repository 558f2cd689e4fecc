"""Grid files: what loads, and one sentence for each mistake."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from advise_ros.core.errors import InputError
from advise_ros.recording.gridfile import grid_to_mapping, load_grid
from support.paths import ROOT

GOOD: dict[str, Any] = {
    'resolution': 2.0, 'width': 3, 'height': 2, 'origin': [-1.0, -1], 'altitude': 5,
    'waypoints': [[2, 0], [0, 1], [0, 0]], 'blocked': [[1, 1]],
}


def written(tmp_path: Path, document: Any) -> Path:
    path = tmp_path / 'grid.yaml'
    path.write_text(document if isinstance(document, str) else yaml.safe_dump(document))
    return path


def test_cells_are_columns_and_rows(tmp_path: Path) -> None:
    grid = load_grid(written(tmp_path, {'grid': GOOD}))
    assert (grid.waypoints, grid.blocked, grid.altitude_m) == ((2, 3, 0), (4,), 5.0)
    assert load_grid(written(tmp_path, {'grid': grid_to_mapping(grid)})) == grid


def test_blocked_may_be_missing(tmp_path: Path) -> None:
    assert load_grid(written(tmp_path, {'grid': {k: v for k, v in GOOD.items() if k != 'blocked'}})).blocked == ()


@pytest.mark.parametrize(('name', 'waypoints'), [('grid_6x6.yaml', 4), ('grid_demo.yaml', 6), ('grid_demo_other.yaml', 6)])
def test_the_grids_that_ship_load(name: str, waypoints: int) -> None:
    assert load_grid(ROOT / 'config' / name).n_layers == waypoints


@pytest.mark.parametrize(
    ('change', 'expected'),
    [
        ({'waypoints': [[3, 0]]}, 'waypoint [3, 0] lies outside the 3 x 2 grid'),
        ({'blocked': [[0, -1]]}, 'blocked cell [0, -1] lies outside'),
        ({'blocked': [[1, 0], [1, 1]]}, 'there is no way'),
        ({'waypoints': []}, 'waypoints is empty'),
        ({'waypoints': [5]}, 'two whole numbers'),
        ({'waypoints': [[1.0, 0]]}, 'two whole numbers'),
        ({'waypoints': 'here'}, 'must be a list of cells'),
        ({'width': 0}, "'width' is 0"),
        ({'width': 2.5}, "'width' is 2.5"),
        ({'height': True}, "'height' is True"),
        ({'resolution': 'wide'}, "'resolution' is 'wide'"),
        ({'resolution': float('nan')}, 'resolution is nan'),
        ({'altitude': -1.0}, 'altitude is -1.0'),
        ({'origin': [1.0]}, "'origin' is [1.0]"),
        ({'origin': None}, "'origin' is None"),
        ({'way_points': []}, "'way_points' is unknown; did you mean 'waypoints'?"),
        ({'colour': 1}, "'colour' is unknown; known: resolution"),
    ],
)
def test_each_mistake_is_named(tmp_path: Path, change: dict[str, Any], expected: str) -> None:
    path = written(tmp_path, {'grid': {**GOOD, **change}})
    with pytest.raises(InputError) as caught:
        load_grid(path)
    assert expected in str(caught.value) and str(path) in str(caught.value)


@pytest.mark.parametrize('key', ['resolution', 'width', 'height', 'origin', 'altitude', 'waypoints'])
def test_a_missing_key_is_named(tmp_path: Path, key: str) -> None:
    path = written(tmp_path, {'grid': {k: v for k, v in GOOD.items() if k != key}})
    with pytest.raises(InputError, match=f"key '{key}' is missing"):
        load_grid(path)


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('{', 'not a YAML file'), ('', "no mapping 'grid'"), ('[1]', "no mapping 'grid'"), ('grid: 3', "no mapping 'grid'"),
        ('a: 1\ngrid: {}', "'a' is unknown"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(InputError, match=expected):
        load_grid(written(tmp_path, text))


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='no grid file is given'):
        load_grid('')
    with pytest.raises(InputError, match='there is no such file'):
        load_grid(tmp_path / 'nothing.yaml')
    with pytest.raises(InputError, match='cannot be read'):
        load_grid(tmp_path)
    (tmp_path / 'binary').write_bytes(bytes(range(128, 256)))
    with pytest.raises(InputError, match='not a YAML file'):
        load_grid(tmp_path / 'binary')
