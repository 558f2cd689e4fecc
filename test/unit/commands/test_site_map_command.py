"""What a recorded session learnt of its site, kept by the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from advise_ros.commands import replay
from advise_ros.commands.site_map import run
from advise_ros.recording.mapfile import read_map
from advise_ros.recording.sitefile import load_site
from support.session_bag import GRID, session_bag

SITE = ['-p', 'advise.acquisition:=site']


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Of a session that learnt by the paper's way."""
    return str(session_bag().write(tmp_path_factory.mktemp('recorded') / 'bag'))


def test_flights_and_answers_of_a_bag_are_kept_and_begun_with_again(
    bag: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / 'site.yaml'
    assert run([bag, '--out', str(out), *SITE]) == 0
    (route,) = load_site(out, GRID).prior.routes
    assert route.waypoints == GRID.waypoints and len(route.flights) == 2 and route.answers
    assert f'{out}: 1 route, 2 flights' in capsys.readouterr().out
    assert read_map(out).values.shape == (GRID.height, GRID.width)
    assert replay.run([bag, *SITE, '-p', f'advise.site_map_file:={out}']) in (0, 1)
    assert 'error' not in capsys.readouterr().err


def test_each_mistake_is_one_sentence(bag: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / 'mine.yaml').write_text('mine')
    for arguments, words in (
        ([bag, '--out', str(tmp_path / 'a.yaml')], "had acquisition 'occupancy' and learnt nothing of the site"),
        ([bag, '--out', str(tmp_path / 'mine.yaml'), *SITE], 'mine.yaml would be overwritten, and advise did not write it'),
        ([bag, '--out', str(tmp_path / 'a.pgm'), *SITE], 'name a .yaml file'),
        ([str(tmp_path / 'none'), '--out', str(tmp_path / 'a.yaml')], 'none'),
    ):
        assert run(arguments) == 2
        said = capsys.readouterr().err
        assert words in said and len(said.splitlines()) == 1
    assert [one.name for one in tmp_path.iterdir()] == ['mine.yaml']
