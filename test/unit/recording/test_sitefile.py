"""What was learnt of a site, on disk."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.site.prior import UNKNOWN, KeptAnswer, KeptFlight, KeptRoute, SitePrior
from advise_ros.recording.mapfile import read_map
from advise_ros.recording.sitefile import begin_site, load_site, save_site, site_of_text, site_text

GRID = Grid(2.0, 4, 3, (-1.0, -1.0), 5.0, (3, 11, 0), blocked=(5,))
KEEP_OUT = np.linspace(0.0, 1.0, 12)
ROUTE = KeptRoute(
    (3, 11, 0), (KeptFlight('flight-001', (5, 99), (0, 1, 2), (1, 1, 1)),),
    (KeptAnswer((13, 14), (1,), (0, 3), 'anna', 'a "word"'),),
)
KNOWN = SitePrior((), (ROUTE,))


def saved(folder: Path, prior: SitePrior = KNOWN) -> Path:
    save_site(folder / 'site.yaml', GRID, KEEP_OUT, prior)
    return folder / 'site.yaml'


def test_what_is_kept_is_there_again_for_another_route(tmp_path: Path) -> None:
    path = saved(tmp_path)
    assert sorted(one.name for one in tmp_path.iterdir()) == ['site.json', 'site.pgm', 'site.yaml']
    assert load_site(path, replace(GRID, waypoints=(2, 8))) == (KNOWN, '')
    assert site_of_text(site_text(KNOWN), 12) == KNOWN
    assert site_of_text(site_text(SitePrior()), 12) == SitePrior()


def test_the_map_is_one_that_map_server_reads_and_obstacles_are_unknown_in_it(tmp_path: Path) -> None:
    values = read_map(saved(tmp_path)).values.ravel()
    assert np.isnan(values[5]) and np.allclose(np.delete(values, 5), np.round(np.delete(KEEP_OUT, 5), 2))


def test_a_map_of_any_hand_counts_as_probabilities(tmp_path: Path) -> None:
    path = saved(tmp_path)
    (tmp_path / 'site.json').unlink()
    found = load_site(path, GRID)
    assert found.remark == '' and found.prior.routes == ()
    assert found.prior.before[:5] == (0, 9, 18, 27, 36) and found.prior.before[5] == UNKNOWN


def test_a_map_that_was_painted_on_counts_as_it_is_now(tmp_path: Path) -> None:
    path = saved(tmp_path)
    image = bytearray((tmp_path / 'site.pgm').read_bytes())
    image[-1] = 100  # The southern row's last cell.
    (tmp_path / 'site.pgm').write_bytes(bytes(image))
    found = load_site(path, GRID)
    assert 'was changed since it was written' in found.remark
    assert found.prior.routes == () and found.prior.before[3] == 100


def test_other_cells_take_the_map_by_area_and_what_lies_off_it_is_unknown(tmp_path: Path) -> None:
    path = saved(tmp_path)
    found = load_site(path, Grid(4.0, 3, 1, (-1.0, -1.0), 5.0, (2,)))
    assert 'has other cells' in found.remark
    three = np.round(100 * KEEP_OUT[[0, 1, 4]])  # The fourth cell is an obstacle.
    assert found.prior == SitePrior((round(three.mean()), round(np.round(100 * KEEP_OUT[[2, 3, 6, 7]]).mean()), UNKNOWN))
    with pytest.raises(InputError, match='no known part of it lies on the grid'):
        load_site(path, replace(GRID, origin_enu_m=(50.0, 0.0)))


@pytest.mark.parametrize(('change', 'words'), [
    ({'advise_site': 2}, 'its format is 2, this version reads 1'),
    ({'routes': [{}]}, "'waypoints' is missing"),
    ({'routes': [{'waypoints': [12], 'flights': [], 'answers': []}]}, 'whole numbers from 0 to 11'),
    ({'before': [1, 2]}, '2 probabilities for 12 cells'),
    ({'routes': 3}, 'is damaged'),
])
def test_a_damaged_file_is_one_sentence(tmp_path: Path, change: dict[str, object], words: str) -> None:
    path = saved(tmp_path)
    values = json.loads((tmp_path / 'site.json').read_text())
    (tmp_path / 'site.json').write_text(json.dumps({**values, **change}))
    with pytest.raises(InputError, match=words) as caught:
        load_site(path, GRID)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('text', ['{', '[]', '{"before": 1}', '{"before": [], "routes": [{"waypoints": [3], "flights": [4]}]}'])
def test_other_text_is_refused(text: str) -> None:
    with pytest.raises(InputError, match='what is known of the site is damaged'):
        site_of_text(text, 12)


def test_nothing_that_is_there_is_overwritten(tmp_path: Path) -> None:
    path = saved(tmp_path)
    assert begin_site(str(path), str(path), GRID).prior == KNOWN
    assert begin_site(str(path), str(tmp_path / 'other.yaml'), GRID).prior == KNOWN
    with pytest.raises(InputError, match='holds what another session learnt; set site_map_file to it, too'):
        begin_site('', str(path), GRID)
    (tmp_path / 'photo.pgm').touch()
    with pytest.raises(InputError, match=r'photo.pgm would be overwritten, and advise did not write it'):
        begin_site('', str(tmp_path / 'photo.yaml'), GRID)
    with pytest.raises(InputError, match=r'name a .yaml file'):
        begin_site('', str(tmp_path / 'site.pgm'), GRID)
    with pytest.raises(InputError, match='cannot be written'):
        save_site(tmp_path / 'no' / 'site.yaml', GRID, KEEP_OUT, KNOWN)


def test_a_file_to_go_on_in_need_not_be_there_yet(tmp_path: Path) -> None:
    path = str(tmp_path / 'site.yaml')
    found = begin_site(path, path, GRID)
    assert not found.prior and 'is not there yet' in found.remark
    assert begin_site('', '', GRID) == (SitePrior(), '')
    with pytest.raises(InputError, match='no such file'):
        begin_site(path, '', GRID)
