"""The command discretise."""

from pathlib import Path

import numpy as np
import pytest

from advise_ros.commands.discretise import run
from advise_ros.core.demonstrations.samples import CommandSamples, PolicyEvent, PoseSamples, Recording, VehicleEvent
from advise_ros.recording.batch import why_no_flight
from advise_ros.recording.demofile import load_demonstrations
from advise_ros.recording.gridfile import load_grid
from support.paths import ROOT

LOG, BAG = (str(ROOT / 'bags' / name) for name in ('arducopter_flight1.tlog', 'arducopter_five_flights'))
GRID = str(ROOT / 'config' / 'grid_6x6.yaml')


def test_log_and_bag_become_one_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / 'demos.json'
    assert run([LOG, BAG, '--grid', GRID, '--out', str(out)]) == 0
    found = load_demonstrations(out, load_grid(GRID))
    assert [d.demonstration_id for d in found] == [f'flight-{number:03}' for number in range(1, 7)]
    table = capsys.readouterr().out
    assert table.count('(5,0) (5,5) (0,5) (0,0)') == 6 and table.count('final waypoint') == 6
    assert '993 samples' in table and f'6 demonstrations written to {out}' in table.replace('\n', '')


def test_good_recordings_are_kept_when_another_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, empty = tmp_path / 'demos.json', tmp_path / 'empty.tlog'
    empty.touch()
    assert run([str(empty), LOG, str(tmp_path / 'none.tlog'), '--grid', GRID, '--out', str(out)]) == 2
    assert len(load_demonstrations(out, load_grid(GRID))) == 1
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == 2 and 'empty.tlog is empty' in errors[0] and 'none.tlog: there is no such file' in errors[1]


@pytest.mark.parametrize(
    ('arguments', 'expected'),
    [
        (['--grid', 'none.yaml'], 'grid file none.yaml: there is no such file'),
        (['--grid', GRID, '--hysteresis-m', '1.0'], "'hysteresis_m' is 1; it must be below half a cell"),
        (['--grid', GRID, '--max-gap-s', '-1'], "parameter 'max_gap_s' is -1.0; allowed: 0.05 to 3600"),
        (['--grid', GRID, '--out', '/no/such/folder/x.json'], 'cannot be written'),
        (['--grid', GRID, '--obstacle-map', 'none.yaml'], 'map file none.yaml: there is no such file'),
        (['--grid', str(ROOT / 'config/grid_demo.yaml')], 'gives no demonstration on this grid'),
    ],
)
def test_each_mistake_is_one_sentence(arguments: list[str], expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([LOG, *arguments]) == 2
    shown = capsys.readouterr()
    assert expected in shown.err and shown.err.count('\n') == 1 and 'Traceback' not in shown.err


@pytest.mark.parametrize(('option', 'name'), [('--command-topic', '/cmd'), ('--status-topic', 'pose')])
def test_topics_that_are_asked_for_must_be_there(option: str, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([BAG, '--grid', GRID, option, name]) == 2
    error = capsys.readouterr().err
    assert f"on a topic '{name}'; it has /cmd_vel (geometry_msgs" in error and f'({option})' in error


@pytest.mark.parametrize(
    ('stamp_ns', 'x_m', 'expected'),
    [(1, np.nan, 'none of its positions is a number'), (0, 0.0, 'none of its positions has a stamp'),
     (1, 0.0, 'no flight reaches 5 m, the highest position is 5.0 m')],
)
def test_why_there_is_no_flight_is_told_truly(stamp_ns: int, x_m: float, expected: str) -> None:
    poses = PoseSamples(np.full(3, stamp_ns), np.array([[x_m, 0.0, 5.0]] * 3))
    commands = CommandSamples(np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
    assert expected in why_no_flight(load_grid(GRID), Recording(poses, commands))


def test_a_state_that_denies_the_flight_is_named_as_the_reason() -> None:
    poses = PoseSamples(np.arange(1, 4), np.array([[0.0, 0.0, height_m] for height_m in (0.0, 3.0, 5.0)]))
    on_the_ground = Recording(poses, events=(VehicleEvent(1, armed=False, in_air=False),))
    said = 'positions reach 5.0 m, but the state never says that the vehicle is in the air (--status-topic)'
    assert why_no_flight(load_grid(GRID), on_the_ground) == said
    by_policy = Recording(poses, policy=(PolicyEvent(1, flies=True),))
    assert '--policy-flights' in why_no_flight(load_grid(GRID), by_policy)


def test_nothing_is_written_when_nothing_was_found(tmp_path: Path) -> None:
    assert run([LOG, '--grid', str(ROOT / 'config/grid_demo.yaml'), '--out', str(tmp_path / 'x.json')]) == 2
    assert list(tmp_path.iterdir()) == []


def test_help_has_examples_and_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        run(['--help'])
    text = capsys.readouterr().out
    assert ended.value.code == 0
    assert 'examples:' in text and 'exit code' in text and '--hysteresis-m' in text and '--pose-topic' in text


def test_wrong_usage_exits_with_2(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        run(['--out', 'x.json'])
    assert ended.value.code == 2 and 'PATH' in capsys.readouterr().err
