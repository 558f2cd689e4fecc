"""fly_check --apply and --undo against both simulated dialects: what is written, what is kept, and when it refuses."""

from __future__ import annotations

import _thread
import json
from pathlib import Path
from typing import Any

import pytest

from advise_ros.commands import checked_vehicle, fly_check
from advise_ros.mavlink.findings import Change
from advise_ros.mavlink.messages import dialect as mavlink
from advise_ros.mavlink.parameter_values import as_carried, decode, encode
from advise_ros.mavlink.writings import Writings
from advise_ros.sim.arducopter import ArduCopter
from advise_ros.sim.px4 import SimulatedPx4
from support import reserve
from support.on_the_air import on_the_air, parameters_of
from support.paths import ROOT

Capture = pytest.CaptureFixture[str]
GRID = str(ROOT / 'config' / 'grid_6x6.yaml')
DIALECTS = pytest.mark.parametrize('dialect', [ArduCopter, SimulatedPx4])
# Out of the box, beside grid_6x6: what is written, in this order.
WRITTEN = {
    ArduCopter: ['GUID_TIMEOUT', 'FENCE_ENABLE'],
    SimulatedPx4: ['COM_OBL_RC_ACT', 'GF_MAX_HOR_DIST', 'GF_MAX_VER_DIST'],
}


@pytest.fixture(autouse=True)
def listens_briefly(monkeypatch: pytest.MonkeyPatch) -> None:
    """The autopilot lives ten times as fast as a real one; test_preflight.py listens to it as long as a user does."""
    monkeypatch.setattr(checked_vehicle, 'LISTEN_S', 0.4)


def arguments(port: int, *more: str) -> list[str]:
    return [f'udpin:127.0.0.1:{port}', '--wait', '20', '--grid', GRID, *more]


def values_of(autopilot: Any) -> dict[str, float]:
    return dict(parameters_of(autopilot).values)


@DIALECTS
def test_it_writes_what_it_recommends_and_puts_it_back(dialect: Any, tmp_path: Path, capsys: Capture) -> None:
    port, file, second = reserve.free_udp_port(), tmp_path / 'old.json', tmp_path / 'second.json'
    with on_the_air(dialect, port) as autopilot:
        before = values_of(autopilot)
        assert fly_check.run(arguments(port, '--apply', '--yes', '--save', str(file))) == 0
        said = capsys.readouterr().out
        after = values_of(autopilot)
        changed = [name for name in after if after[name] != before[name]]
        assert sorted(changed) == sorted(WRITTEN[dialect])
        number = len(changed)
        assert f'{number} of {number} parameters are written and read back' in said
        assert f'--undo {file}' in said
        assert [entry['name'] for entry in json.loads(file.read_text())['parameters']] == WRITTEN[dialect]

        assert fly_check.run(arguments(port, '--apply', '--yes', '--save', str(second))) == 0
        assert not second.exists()  # Nothing more to write.

        assert fly_check.run(arguments(port, '--undo', str(file), '--yes', '--save', str(second))) == 0
        assert values_of(autopilot) == before
        assert f'{number} of {number} parameters are written and read back' in capsys.readouterr().out
        assert fly_check.run(arguments(port, '--undo', str(file), '--yes')) == 0
        assert 'nothing to put back' in capsys.readouterr().out
    assert not autopilot.vehicle.armed


@pytest.mark.parametrize(('answer', 'written'), [('y', True), ('', False), ('no', False)])
def test_it_asks_first(
    answer: str, written: bool, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[str] = []

    def answered(question: str) -> str:
        asked.append(question)
        return answer

    monkeypatch.setattr('sys.stdin.isatty', lambda: True)
    monkeypatch.setattr('builtins.input', answered)
    monkeypatch.chdir(tmp_path)
    port = reserve.free_udp_port()
    with on_the_air(SimulatedPx4, port) as autopilot:
        before = values_of(autopilot)
        assert fly_check.run(arguments(port, '--apply')) == (0 if written else 1)
        assert (values_of(autopilot) != before) == written
    assert asked == ['write 3 parameters? [y/N] ']
    said = capsys.readouterr().out
    assert 'COM_OBL_RC_ACT   0 -> 5   it holds when setpoints end' in said
    assert ('nothing is written' in said) != written
    assert len(list(tmp_path.glob('fly_check-px4-1-*.json'))) == written


def test_without_a_terminal_it_writes_only_when_told_to(capsys: Capture) -> None:
    assert fly_check.run(arguments(1, '--apply')) == 2
    said = capsys.readouterr().err
    assert said == 'error: --apply asks before it writes, and there is no terminal to answer at; give --yes to let it write\n'


@pytest.fixture
def stays_armed(monkeypatch: pytest.MonkeyPatch) -> None:
    """An armed vehicle on the ground does not disarm itself."""
    monkeypatch.setattr('advise_ros.sim.vehicle.DISARM_DELAY_S', 1e9)


@DIALECTS
@pytest.mark.usefixtures('stays_armed')
def test_an_armed_vehicle_is_not_written_to(dialect: Any, tmp_path: Path, capsys: Capture) -> None:
    port, file = reserve.free_udp_port(), tmp_path / 'old.json'

    def arm(autopilot: Any, message: Any) -> None:
        autopilot.vehicle.armed = True

    with on_the_air(dialect, port, before=arm) as autopilot:
        before = values_of(autopilot)
        assert fly_check.run(arguments(port, '--apply', '--yes', '--save', str(file))) == 2
        assert values_of(autopilot) == before
    assert capsys.readouterr().err == 'error: nothing is written: it is armed: disarm it and try again\n'
    assert not file.exists()


@pytest.mark.usefixtures('stays_armed')
def test_a_vehicle_that_is_armed_meanwhile_gets_no_more(tmp_path: Path, capsys: Capture) -> None:
    port, file = reserve.free_udp_port(), tmp_path / 'old.json'

    def arm_at_the_second(autopilot: Any, message: Any) -> None:
        if message.get_type() == 'PARAM_SET' and message.param_id == 'GF_MAX_HOR_DIST':
            parameters_of(autopilot).settable.pop('GF_MAX_HOR_DIST', None)
            autopilot.vehicle.armed = True

    with on_the_air(SimulatedPx4, port, before=arm_at_the_second) as autopilot:
        assert fly_check.run(arguments(port, '--apply', '--yes', '--save', str(file))) == 1
        assert parameters_of(autopilot)['GF_MAX_VER_DIST'] == 0.0
    said = capsys.readouterr().out
    assert 'it is armed: disarm it and try again: 1 of 3 parameters are written' in said
    assert 'not written  GF_MAX_VER_DIST' in said


def test_interrupted_it_says_how_far_it_came_and_nothing_is_lost(tmp_path: Path, capsys: Capture) -> None:
    port, file, second = reserve.free_udp_port(), tmp_path / 'old.json', tmp_path / 'second.json'
    interrupted: list[str] = []

    def interrupt_at_the_second(autopilot: Any, message: Any) -> None:
        if message.get_type() == 'PARAM_SET' and message.param_id == 'GF_MAX_HOR_DIST' and not interrupted:
            interrupted.append(message.param_id)
            _thread.interrupt_main()

    with on_the_air(SimulatedPx4, port, before=interrupt_at_the_second) as autopilot:
        before = values_of(autopilot)
        assert fly_check.run(arguments(port, '--apply', '--yes', '--save', str(file))) == 130
        said = capsys.readouterr().out
        assert 'interrupted: ' in said
        assert 'written      COM_OBL_RC_ACT = 5' in said
        assert 'not written  GF_MAX_VER_DIST = 32' in said
        assert f'--undo {file}' in said
        kept = {entry['name']: entry['old'] for entry in json.loads(file.read_text())['parameters']}
        assert kept == {name: before[name] for name in WRITTEN[SimulatedPx4]}  # What was not reached, too.
        assert fly_check.run(arguments(port, '--undo', str(file), '--yes', '--save', str(second))) == 0
        assert values_of(autopilot) == before


def test_a_value_that_the_autopilot_refuses_is_named(tmp_path: Path, capsys: Capture) -> None:
    port, file = reserve.free_udp_port(), tmp_path / 'old.json'
    with on_the_air(SimulatedPx4, port) as autopilot:
        del parameters_of(autopilot).settable['GF_MAX_VER_DIST']
        assert fly_check.run(arguments(port, '--apply', '--yes', '--save', str(file))) == 1
    said = capsys.readouterr().out
    assert 'GF_MAX_VER_DIST stays 0: the autopilot refuses 32: 2 of 3 parameters are written' in said


def test_old_values_are_put_back_only_where_they_came_from(tmp_path: Path, capsys: Capture) -> None:
    port, file = reserve.free_udp_port(), tmp_path / 'old.json'
    entry = {'name': 'GUID_TIMEOUT', 'old': 3.0, 'new': 1.0}
    file.write_text(json.dumps({'autopilot': 'ardupilot', 'system': 1, 'parameters': [entry]}))
    with on_the_air(SimulatedPx4, port):
        assert fly_check.run(arguments(port, '--undo', str(file), '--yes')) == 2
    assert f'{file} is of ardupilot system 1, and px4 system 1 is here' in capsys.readouterr().err


def test_a_file_of_old_values_is_never_overwritten(tmp_path: Path, capsys: Capture) -> None:
    port, file = reserve.free_udp_port(), tmp_path / 'old.json'
    file.write_text('precious')
    with on_the_air(SimulatedPx4, port) as autopilot:
        before = values_of(autopilot)
        assert fly_check.run(arguments(port, '--apply', '--yes', '--save', str(file))) == 2
        assert values_of(autopilot) == before
    assert file.read_text() == 'precious'
    assert f'{file} exists and may hold old values that you need' in capsys.readouterr().err


@pytest.mark.parametrize('content', ['', '[]', '{"autopilot": "px4"}', '{"autopilot": "px4", "system": 1, "parameters": [1]}'])
def test_a_file_that_holds_no_old_values_is_one_sentence(content: str, tmp_path: Path, capsys: Capture) -> None:
    file = tmp_path / 'old.json'
    file.write_text(content)
    assert fly_check.run(arguments(1, '--undo', str(file), '--yes')) == 2
    said = capsys.readouterr().err
    assert f'{file} is no file of old parameters' in said
    assert said.count('\n') == 1


# -- on the wire ------------------------------------------------------------------------------
INT32, REAL32 = int(mavlink.MAV_PARAM_TYPE_INT32), int(mavlink.MAV_PARAM_TYPE_REAL32)


def said(name: str, value: float, kind: int) -> Any:
    return mavlink.MAVLink_param_value_message(name.encode(), value, kind, 1, 0)


def over_the_wire(message: Any) -> Any:
    message.pack(mavlink.MAVLink(None, 1, 1))
    return mavlink.MAVLink(None).decode(bytearray(message.get_msgbuf()))


@pytest.mark.parametrize('value', [0.0, 1.0, 5.0, -1.0, 2147483647.0])
def test_px4s_whole_numbers_travel_as_bytes_and_arducopters_as_floats(value: float) -> None:
    bytewise = over_the_wire(said('A', encode(value, INT32, bytewise=True), INT32))
    assert decode(bytewise, bytewise=True) == value
    assert encode(5.0, INT32, bytewise=True) == pytest.approx(7.0e-45, rel=0.01)
    assert encode(value, INT32, bytewise=False) == value
    assert encode(value, REAL32, bytewise=True) == value


def test_each_is_written_until_it_reads_back_and_the_first_in_vain_ends_it() -> None:
    changes = [Change('A', 5.0, ''), Change('B', 0.1, ''), Change('C', 1.0, '')]
    writings = Writings(changes, {'A': INT32, 'B': REAL32, 'C': REAL32}, bytewise=True)
    assert writings.unconfirmed is None
    writings.observe(said('A', encode(5.0, INT32, bytewise=True), INT32))  # On its way before anything was sent.
    assert writings.written == []
    write, read = writings.step((1, 1), 0.0)
    assert (write.get_type(), read.get_type(), write.param_type) == ('PARAM_SET', 'PARAM_REQUEST_READ', INT32)
    assert writings.unconfirmed == changes[0]
    assert writings.step((1, 1), 0.2) == []
    assert len(writings.step((1, 1), 0.6)) == 2  # Lost: once more.
    writings.observe(over_the_wire(said('A', encode(5.0, INT32, bytewise=True), INT32)))
    assert writings.written == changes[:1]
    writings.step((1, 1), 0.7)
    writings.observe(over_the_wire(said('B', 0.1, REAL32)))  # 32 bits of it.
    assert writings.written == changes[:2]
    assert as_carried(0.1, REAL32) != 0.1
    for turn in range(20):
        writings.step((1, 1), 1.0 + turn)
    assert writings.done
    assert writings.failure == 'C: no answer to 6 tries'
    writings.observe(said('C', 0.0, REAL32))
    assert writings.left == (changes[2],)
