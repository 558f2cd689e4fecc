"""A grid file that a drawing became: the same drawing gives the same bytes, and nothing is written over or half."""

from __future__ import annotations

import json
import stat
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from advise_ros.core.errors import InputError
from advise_ros.recording.gridfile import grid_from_text, grid_to_mapping, load_grid
from advise_ros.recording.gridtext import canonical, grid_text, write_new

SIDE = 6
CELLS = st.tuples(st.integers(0, SIDE - 1), st.integers(0, SIDE - 1)).map(list)
METRES = st.floats(-1e4, 1e4).map(lambda value: round(value, 3))


@st.composite
def drawings(draw: st.DrawFn) -> dict[str, Any]:
    values = {
        'resolution': draw(st.sampled_from([1, 2.0, 0.5])), 'width': SIDE, 'height': SIDE, 'origin': [draw(METRES), draw(METRES)],
        'altitude': draw(st.integers(1, 50)), 'waypoints': draw(st.lists(CELLS, max_size=4)),
        'blocked': draw(st.lists(CELLS, max_size=20)),
    }
    if draw(st.booleans()):
        values |= {'origin_wgs84': [draw(st.floats(-89, 89)), draw(st.floats(-179, 179))], 'heading_deg': draw(METRES)}
    return values


@given(drawings())
def test_a_drawing_comes_back_from_its_file(values: dict[str, Any]) -> None:
    text = grid_text(values)
    (read,) = yaml.safe_load(text).values()
    assert read == canonical(values)
    assert grid_text(read) == text
    assert grid_text(json.loads(json.dumps(values))) == text, 'a browser writes 2 for 2.0'


@given(drawings())
def test_the_loader_has_the_same_grid_of_it_or_refuses_it(values: dict[str, Any]) -> None:
    try:
        grid = grid_from_text(grid_text(values))
    except InputError:
        return
    mapping = grid_to_mapping(grid)
    assert mapping == {key: canonical(values)[key] for key in mapping}


def test_the_order_in_which_cells_were_drawn_does_not_matter() -> None:
    one, other = ({'blocked': cells} for cells in ([[3, 0], [1, 2], [0, 2]], [[0, 2], [3, 0], [1, 2], [3, 0]]))
    assert grid_text(one) == grid_text(other) == 'grid:\n  blocked: [[3, 0], [0, 2], [1, 2]]\n'


def test_what_is_wrong_stays_for_the_loader_to_name() -> None:
    values = {'resolution': 'two', 'blocked': [[1.5, 'x']], 'width': None}
    assert canonical(values) == {'resolution': 'two', 'width': None, 'blocked': [[1.5, 'x']]}


def test_a_key_that_nobody_draws_is_kept() -> None:
    assert 'note: garden' in grid_text({'note': 'garden', 'blocked': []})


def test_a_file_is_written_whole_and_never_over_another(tmp_path: Path) -> None:
    path = tmp_path / 'grid.yaml'
    write_new(path, 'one')
    with pytest.raises(FileExistsError):
        write_new(path, 'two')
    assert path.read_text() == 'one' and stat.S_IMODE(path.stat().st_mode) & 0o600 == 0o600
    write_new(path, 'two', replace=True)
    assert path.read_text() == 'two'
    assert [one.name for one in tmp_path.iterdir()] == ['grid.yaml'], 'nothing is left beside it'


def test_a_shipped_grid_comes_back(tmp_path: Path) -> None:
    from support.paths import ROOT

    grid = load_grid(ROOT / 'config' / 'grid_demo.yaml')
    write_new(tmp_path / 'again.yaml', grid_text(grid_to_mapping(grid)))
    assert load_grid(tmp_path / 'again.yaml') == grid
