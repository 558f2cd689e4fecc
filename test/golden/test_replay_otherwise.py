"""Replay with other parameters, against a baseline, and as JUnit XML."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from advise_ros.commands import replay
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.replay.overrides import other_grid, parse
from support.session_bag import GRID, session_bag


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return session_bag().write(tmp_path_factory.mktemp('session') / 'bag')


def replayed(bag: Path, directory: Path, *arguments: str) -> tuple[int, dict]:
    """Exit code and JSON."""
    report = directory / 'report.json'
    code = replay.run([str(bag), '--json', str(report), *arguments])
    return code, json.loads(report.read_text())


def stages(values: dict) -> Iterator[tuple[str, bool, str]]:
    return ((stage['name'], stage['checked'] == stage['equal'], stage['difference']) for stage in values['stages'])


# -- other parameters ------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ('override', 'changed', 'words'),
    [
        ('advise.clusters:=8', {'queries'}, r'/advise/query at [\d.]+: states would have \d+ entries, had \d+'),
        ('policy.speed_m_s:=2.5', {'commands'}, r'/cmd_vel at [\d.]+: twist.linear.\w would be \S+, was \S+'),
        ('advise.clusters:=4', set(), ''),
        (
            'grid.resolution:=1.0', {'demonstrations', 'policies', 'queries', 'commands', 'flight statuses'},
            r'/demonstration at [\d.]+: states would have \d+ entries, had \d+',
        ),
    ],
)  # fmt: skip
def test_what_would_have_changed_is_shown(bag: Path, tmp_path: Path, override: str, changed: set[str], words: str) -> None:
    code, values = replayed(bag, tmp_path, '-p', override)
    assert code == (1 if changed else 0)
    found = list(stages(values))
    assert {name for name, agrees, _ in found if not agrees} == changed
    assert re.fullmatch(words, next((difference for _, agrees, difference in found if not agrees), '').split(' (')[0])
    node, _, rest = override.partition('.')
    assert values['overrides'][node] == {rest.split(':=')[0]: pytest.approx(float(rest.split(':=')[1]))}


def test_what_changes_early_changes_what_follows(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Rebuilt demonstrations are learnt from, and the policy learnt is flown."""
    code, values = replayed(bag, tmp_path, '-p', 'grid.waypoints:=[[0, 2], [2, 2], [0, 0]]')
    assert code == 1
    assert {name for name, agrees, _ in stages(values) if not agrees} >= {'demonstrations', 'policies', 'commands'}
    assert 'the answers were given on the grid that was flown and are left out' in capsys.readouterr().out


def test_finer_cells_keep_the_map() -> None:
    found = other_grid(GRID, {'resolution': 1.0})
    assert (found.width, found.height, found.resolution_m) == (6, 6, 1.0)
    assert [found.cell_at(*GRID.centre_enu_m(cell)) for cell in GRID.waypoints] == list(found.waypoints)
    coarse = other_grid(Grid(2.0, 4, 4, (0.0, 0.0), 5.0, (1, 0, 15), blocked=(3,)), {'resolution': 4.0})
    assert (coarse.width, coarse.height, coarse.waypoints, coarse.blocked) == (2, 2, (0, 3), (1,))


@pytest.mark.parametrize(
    ('word', 'sentence'),
    [
        ('clusters:=8', 'is malformed'),
        ('advise.clusters', 'is malformed'),
        ('drone.speed:=1', "there is no 'drone' to replay"),
        ('advise.cluster:=8', "parameter 'cluster' is unknown; did you mean 'clusters'?"),
        ('advise.gamma:=7', 'allowed: 0 to 0.9999'),
        ('advise.clusters:=[', 'its value is not one'),
        ('grid.size:=3', 'a grid has no such key'),
    ],
)
def test_a_wrong_override_is_one_sentence(word: str, sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        parse([word])


def test_an_override_that_makes_no_grid_exits_2(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for override in ('grid.luck:=1', 'grid.resolution:=0', 'grid.waypoints:=[[9, 9]]'):
        assert replay.run([str(bag), '-p', override]) == 2
        captured = capsys.readouterr()
        assert captured.err.count('\n') == 1 and not captured.out


def test_the_same_grid_changes_nothing_and_leaves_no_answer_out(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert replay.run([str(bag), '-p', f'grid.width:={GRID.width}']) == 0
    assert 'are left out' not in capsys.readouterr().out


# -- a baseline ------------------------------------------------------------------------------------
def test_a_session_decides_as_its_own_baseline(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert replay.run([str(bag), '--json', str(tmp_path / 'baseline.json')]) == 0
    capsys.readouterr()
    assert replay.run([str(bag), '--against', str(tmp_path / 'baseline.json')]) == 0
    assert 'decides as' in capsys.readouterr().out
    code, values = replayed(bag, tmp_path, '--against', str(bag))
    assert code == 0 and all(stage['checked'] == stage['equal'] > 0 for stage in values['beside'])


def test_another_session_and_other_parameters_differ_from_a_baseline(bag: Path, tmp_path: Path) -> None:
    other = session_bag(answers=2).write(tmp_path / 'other')
    code, values = replayed(bag, tmp_path, '--against', str(other))
    found = {stage['name'].removesuffix(' as in the baseline'): stage for stage in values['beside']}
    assert code == 1
    assert found['demonstrations']['checked'] == found['demonstrations']['equal'] == 2
    assert found['policies']['difference'] == 'number 4 of the policies is missing'
    assert 'the positions are not those of the baseline' in found['commands']['notes'][0] and not found['commands']['checked']
    code, values = replayed(bag, tmp_path, '--against', str(bag), '-p', 'advise.clusters:=3')
    assert code == 1 and 'number 1 of the queries: states' in values['beside'][2]['difference']


@pytest.mark.parametrize('text', ['', '[]', '{"inputs": "", "decisions": {"policies": [7]}}', None])
def test_what_is_no_baseline(bag: Path, tmp_path: Path, text: str | None, capsys: pytest.CaptureFixture[str]) -> None:
    if text is not None:
        (tmp_path / 'baseline.json').write_text(text)
    assert replay.run([str(bag), '--against', str(tmp_path / 'baseline.json')]) == 2
    assert re.search(r'baseline\.json (is not by replay|cannot be read)', capsys.readouterr().err)


# -- JUnit -----------------------------------------------------------------------------------------
def test_each_stage_is_a_test_case(bag: Path, tmp_path: Path) -> None:
    file = tmp_path / 'verdict.xml'
    assert replay.run([str(bag), '--junit', str(file)]) == 0
    suite = ET.parse(file).getroot().find('testsuite')
    assert suite is not None and (suite.get('tests'), suite.get('failures')) == ('7', '0')
    assert replay.run([str(bag), '--junit', str(file), '--against', str(bag), '-p', 'advise.clusters:=3']) == 1
    (failure,) = ET.parse(file).getroot().iter('failure')
    assert 'number 1 of the queries' in failure.get('message', '')
