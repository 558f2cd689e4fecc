"""The file of what a simulated person wants beside the map."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.wishfile import load_wish

GRID = Grid(1.0, 4, 3, (0.0, 0.0), 2.0, (11, 0))


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / 'garden.yaml'
    path.write_text(text)
    return path


def test_cells_are_read_once_each_and_ascending(tmp_path: Path) -> None:
    assert load_wish(written(tmp_path, 'keep_out: [[2, 1], [1, 1], [2, 1]]'), GRID) == (5, 6)
    assert load_wish(written(tmp_path, 'keep_out: []'), GRID) == ()
    assert load_wish('', GRID) == ()


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('keep_out: [[4, 1]]', 'cell to keep out of [4, 1] lies outside the 4 x 3 grid; x goes from 0 to 3'),
        ('keep_out: [[1, 1], [3, 2]]', 'cell to keep out of [3, 2] is waypoint 1 of the grid; take it out'),
        ('keep_out: [[1, 0], [1, 1], [1, 2]]', 'no way round is left between the waypoints; take some of the 3 cells'),
        ('keep_out: [[1, 0.5]]', "key 'keep_out' holds [1, 0.5]; a cell is two whole numbers [x, y]"),
        ('keep_out: here', "key 'keep_out' is 'here'; it must be a list of cells [x, y]"),
        ('blocked: [[1, 1]]', "it has no key 'keep_out'; see config/garden.yaml"),
        ('keep_out: []\nblocked: []', "key 'blocked' is unknown beside 'keep_out'; drop it"),
        ('- 1', "it has no key 'keep_out'"),
        ('keep_out: [[1, 1]', 'it is not a YAML file (line'),
        ('keep_out:\n\t- [1, 1]', 'line 2 is indented by a tab; YAML takes spaces only'),
    ],
)
def test_each_mistake_is_one_sentence_with_the_files_name(tmp_path: Path, text: str, said: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(InputError, match=re.escape(said)) as caught:
        load_wish(path, GRID)
    assert str(caught.value).startswith(f'wish file {path}: ')


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r'none\.yaml: there is no such file; name a YAML file with keep_out, see config'):
        load_wish(tmp_path / 'none.yaml', GRID)
