"""fly_check: what is right and what is not, by parameters, estimator and state, and against both simulated dialects."""

from __future__ import annotations

import itertools
import socket
import threading
from pathlib import Path

import pytest

from advise_ros.commands import fly_check
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink import preflight
from advise_ros.mavlink.companion import Status
from advise_ros.mavlink.findings import Level, Room
from advise_ros.mavlink.preflight import parameter_findings, state_findings
from advise_ros.mavlink.readings import Readings
from advise_ros.sim.arducopter import ArduCopter
from advise_ros.sim.px4 import SimulatedPx4
from support import reserve
from support.on_the_air import on_the_air
from support.sim_companion import Companion

Capture = pytest.CaptureFixture[str]
STATUS = Status(
    'px4', 'LOITER', connected=True, ready=True, armed=False, in_air=False, commandable=False, waiting_for='', text='',
)


def levels(autopilot: str, values: dict[str, float], room: Room | None = None) -> dict[str, Level]:
    found = parameter_findings(autopilot, values, room)
    return {finding.what.split()[0].rstrip(':'): finding.level for finding in found}


@pytest.mark.parametrize(('autopilot', 'name', 'value', 'level'), [
    ('ardupilot', 'GUID_TIMEOUT', 1.0, Level.RIGHT), ('ardupilot', 'GUID_TIMEOUT', 3.0, Level.ADVICE),
    ('ardupilot', 'GUID_TIMEOUT', 10.0, Level.WRONG), ('ardupilot', 'FS_GCS_ENABLE', 0.0, Level.ADVICE),
    ('ardupilot', 'FS_GCS_ENABLE', 1.0, Level.RIGHT), ('ardupilot', 'FENCE_ENABLE', 0.0, Level.WRONG),
    ('ardupilot', 'FENCE_ENABLE', 1.0, Level.RIGHT), ('ardupilot', 'FENCE_ACTION', 0.0, Level.WRONG),
    ('ardupilot', 'ARMING_CHECK', 0.0, Level.WRONG), ('px4', 'COM_OF_LOSS_T', 1.0, Level.RIGHT),
    ('px4', 'COM_OF_LOSS_T', 5.0, Level.WRONG), ('px4', 'COM_OBL_RC_ACT', 0.0, Level.WRONG),
    ('px4', 'COM_OBL_RC_ACT', 5.0, Level.RIGHT), ('px4', 'COM_RCL_EXCEPT', 0.0, Level.ADVICE),
    ('px4', 'COM_RCL_EXCEPT', 6.0, Level.RIGHT), ('px4', 'NAV_DLL_ACT', 2.0, Level.ADVICE),
    ('ardupilot', 'GUID_TIMEOUT', 0.1, Level.ADVICE), ('ardupilot', 'FENCE_TYPE', 7.0, Level.RIGHT),
    ('ardupilot', 'FENCE_TYPE', 6.0, Level.WRONG), ('ardupilot', 'FENCE_TYPE', 1.0, Level.WRONG),
    ('ardupilot', 'ARMING_CHECK', 1.0, Level.RIGHT), ('ardupilot', 'ARMING_CHECK', 448.0, Level.ADVICE),
    ('ardupilot', 'ARMING_SKIPCHK', 0.0, Level.RIGHT), ('ardupilot', 'ARMING_SKIPCHK', 8.0, Level.ADVICE),
    ('ardupilot', 'ARMING_SKIPCHK', -1.0, Level.WRONG), ('px4', 'COM_OF_LOSS_T', 0.0, Level.WRONG),
    ('px4', 'COM_OBL_RC_ACT', 7.0, Level.WRONG), ('px4', 'GF_ACTION', 4.0, Level.WRONG),
    ('px4', 'GF_ACTION', 3.0, Level.RIGHT),
    ('px4', 'GF_ACTION', 1.0, Level.WRONG), ('px4', 'GF_MAX_HOR_DIST', 0.0, Level.WRONG),
])
def test_each_parameter_is_judged_and_what_is_wrong_has_a_remedy(autopilot: str, name: str, value: float, level: Level) -> None:
    (finding,) = [f for f in parameter_findings(autopilot, {name: value}, None) if f.what.startswith(f'{name} = {value:g}:')]
    assert finding.level is level
    assert (name in finding.remedy) == (level is not Level.RIGHT)
    assert finding.change is None or (finding.change.name == name and level is not Level.RIGHT)


def test_a_fence_must_leave_room_for_our_own() -> None:
    room = Room(reach_m=40.0, high_m=12.0)
    found = levels('ardupilot', {'FENCE_RADIUS': 42.0, 'FENCE_ALT_MAX': 15.0, 'FENCE_MARGIN': 2.0}, room)
    assert (found['FENCE_RADIUS'], found['FENCE_ALT_MAX']) == (Level.WRONG, Level.RIGHT)
    found = levels('px4', {'GF_MAX_HOR_DIST': 50.0, 'GF_MAX_VER_DIST': 12.0}, room)
    assert (found['GF_MAX_HOR_DIST'], found['GF_MAX_VER_DIST']) == (Level.RIGHT, Level.WRONG)
    missing = set(preflight.RULES['px4'].REQUIRED) - {'GF_MAX_HOR_DIST', 'GF_MAX_VER_DIST'}
    assert {name for name, level in found.items() if level is Level.UNKNOWN} == missing


def change_of(autopilot: str, name: str, values: dict[str, float], room: Room | None = None) -> float | None:
    """The value that is recommended for a parameter."""
    wanted = {change.name: change.value for change in preflight.changes(parameter_findings(autopilot, values, room))}
    return wanted.get(name)


def test_px4_comes_home_below_the_ceiling_of_its_fence() -> None:
    """Its return climbs to RTL_RETURN_ALT first; a ceiling below that stops it for good."""
    room = Room(reach_m=15.0, high_m=8.0)
    # No fence so far: the ceiling that is recommended leaves room for the return.
    assert change_of('px4', 'GF_MAX_VER_DIST', {'GF_MAX_VER_DIST': 0.0, 'RTL_RETURN_ALT': 30.0}, room) == 32.0
    assert change_of('px4', 'RTL_RETURN_ALT', {'GF_MAX_VER_DIST': 0.0, 'RTL_RETURN_ALT': 30.0}, room) is None
    # A ceiling that somebody chose stays, and the return goes below it.
    (finding,) = [f for f in parameter_findings('px4', {'GF_MAX_VER_DIST': 12.0, 'RTL_RETURN_ALT': 30.0}, room)
                  if f.what.startswith('RTL_RETURN_ALT')]
    assert finding.level is Level.WRONG
    assert 'never comes home' in finding.what
    assert finding.change is not None
    assert finding.change.value == 10.0
    # One that is raised because the route needs it counts as it will be.
    assert change_of('px4', 'GF_MAX_VER_DIST', {'GF_MAX_VER_DIST': 5.0, 'RTL_RETURN_ALT': 8.0}, room) == 9.0
    assert change_of('px4', 'RTL_RETURN_ALT', {'GF_MAX_VER_DIST': 5.0, 'RTL_RETURN_ALT': 8.0}, room) == 7.0
    assert levels('px4', {'GF_MAX_VER_DIST': 32.0, 'RTL_RETURN_ALT': 30.0}, room)['RTL_RETURN_ALT'] is Level.RIGHT


@pytest.mark.parametrize(('values', 'words'), [
    ({'RTL_ALT': 1500.0, 'FENCE_ALT_MAX': 100.0}, 'it climbs to 15 m to return, inside its fence'),
    ({'RTL_ALT_M': 15.0, 'FENCE_ALT_MAX': 100.0}, 'it climbs to 15 m to return, inside its fence'),
    ({'RTL_ALT': 1500.0, 'FENCE_ALT_MAX': 10.0, 'FENCE_MARGIN': 2.0}, 'with its fence on it climbs to 8 m to return'),
    ({'RTL_ALT': 0.0, 'FENCE_ALT_MAX': 10.0}, 'it returns at the altitude that it has'),
])
def test_arducopter_limits_its_return_by_its_fence_under_the_old_name_and_the_new(values: dict[str, float], words: str) -> None:
    (finding,) = [f for f in parameter_findings('ardupilot', values, None) if f.what.startswith('RTL_ALT')]
    assert finding.level is Level.RIGHT
    assert words in finding.what


@pytest.mark.parametrize(('autopilot', 'name'), [('ardupilot', 'GUID_TIMEOUT'), ('px4', 'COM_OF_LOSS_T')])
def test_a_time_out_is_said_with_how_far_it_flies_past_our_fence(autopilot: str, name: str) -> None:
    (finding,) = [f for f in parameter_findings(autopilot, {name: 3.0}, Room(15.0, 8.0, speed_m_s=2.0, braking_m_s2=2.0))
                  if f.what.startswith(name)]
    assert 'up to 7.0 m past our own fence at 2 m/s' in finding.what
    assert finding.change is not None


def test_nothing_is_written_that_drags_other_parameters_along_or_that_somebody_chose() -> None:
    written = set()
    for autopilot, value in itertools.product(preflight.RULES, (-1.0, 0.0, 4.0, 7.0, 448.0)):
        values = dict.fromkeys(preflight.names(autopilot), value)
        written |= {change.name for change in preflight.changes(parameter_findings(autopilot, values, Room(15.0, 8.0)))}
    assert 'GUID_TIMEOUT' in written
    assert not written & {'MPC_XY_VEL_MAX', 'FS_GCS_ENABLE', 'NAV_DLL_ACT', 'COM_RCL_EXCEPT'}
    assert change_of('ardupilot', 'ARMING_CHECK', {'ARMING_CHECK': 448.0}) is None


def test_the_state_is_told_with_the_autopilots_words() -> None:
    assert [f.level for f in state_findings(STATUS, [])] == [Level.RIGHT, Level.RIGHT]
    assert state_findings(STATUS._replace(armed=True), [])[1].what == 'it is armed'
    waiting = state_findings(STATUS._replace(ready=False, waiting_for='EKF position'), ['PreArm: Compass'])
    assert waiting[1].what == 'it is not ready to arm; it waits for: EKF position'
    assert waiting[2].what == 'it says: PreArm: Compass'


@pytest.mark.parametrize(('dialect', 'autopilot'), [(ArduCopter, 'ardupilot'), (SimulatedPx4, 'px4')])
def test_parameters_are_read_from_both_dialects_and_asked_for_again(dialect: type, autopilot: str) -> None:
    companion = Companion(dialect=dialect)
    readings = Readings((*preflight.names(autopilot), 'NO_SUCH_NAME'), bytewise=autopilot == 'px4')
    lost = True
    for turn in range(40):
        for message in readings.step((1, 1), turn * 0.2):
            for reply in companion.say(message):
                reply.pack(mav.dialect.MAVLink(None, 1, 1))
                if not lost:
                    readings.observe(mav.dialect.MAVLink(None).decode(bytearray(reply.get_msgbuf())))
        lost = turn < 3
    assert readings.done
    of_other_versions = {'ARMING_SKIPCHK', 'RTL_ALT_M', 'COM_OBL_ACT'}
    assert set(readings.values) == set(preflight.names(autopilot)) - of_other_versions
    wanted = {'ardupilot': ('GUID_TIMEOUT', 3.0), 'px4': ('GF_ACTION', 2.0)}[autopilot]
    assert readings.values[wanted[0]] == wanted[1]


def test_what_not_every_version_has_is_soon_no_longer_waited_for() -> None:
    readings = Readings(('ONE', 'NEWER'), bytewise=False, optional=frozenset({'NEWER'}))
    readings.observe(mav.dialect.MAVLink_param_value_message(b'ONE', 1.0, 9, 1, 0))
    asked = [len(readings.step((1, 1), turn * 0.5)) for turn in range(8)]
    assert asked == [1, 1, 1, 0, 0, 0, 0, 0]
    assert readings.done


@pytest.mark.parametrize(('dialect', 'lines'), [
    (ArduCopter, (
        'right   ardupilot multicopter answers', 'right   it is ready to arm', 'WRONG   FENCE_ENABLE = 0',
        'right   its estimator has attitude, velocity and position', 'right   GPS: 3D fix',
    )),
    (SimulatedPx4, (
        'right   px4 multicopter answers', 'right   it is ready to arm', '-> set COM_OBL_RC_ACT to 5 (hold) or 4 (land)',
    )),
])
def test_the_command_finds_what_is_wrong_and_arms_nothing(dialect: type, lines: tuple[str, ...], capsys: Capture) -> None:
    port = reserve.free_udp_port()
    with on_the_air(dialect, port):
        assert fly_check.run([f'udpin:127.0.0.1:{port}', '--wait', '20']) == 1
    said = capsys.readouterr().out
    assert [line for line in lines if line not in said] == []


def test_with_a_key_it_hears_only_who_has_it_and_without_one_it_says_who_signs(tmp_path: Path, capsys: Capture) -> None:
    key, port = bytes(range(32)), reserve.free_udp_port()
    (tmp_path / 'key').write_text(key.hex())
    (tmp_path / 'key').chmod(0o600)
    command = [f'udpin:127.0.0.1:{port}', '--signing-key', str(tmp_path / 'key'), '--wait']
    with on_the_air(SimulatedPx4, port):
        assert fly_check.run([*command, '1']) == 2
        assert 'a frame is not signed, but a key is set; give --signing-key' in capsys.readouterr().err
    with on_the_air(SimulatedPx4, port, key):
        assert fly_check.run([*command, '20']) == 1
        assert 'right   what it sends is signed with the key' in capsys.readouterr().out
        assert fly_check.run([f'udpin:127.0.0.1:{port}', '--wait', '1']) == 1
        assert 'WRONG   what it sends is signed, but no key is set here' in capsys.readouterr().out


@pytest.mark.parametrize(('sent', 'words'), [
    (b'', 'nothing comes; start the autopilot'),
    (b'no mavlink', '10 bytes came that are no MAVLink; see that port and --baud are right'),
    (bytes(mav.dialect.MAVLink_heartbeat_message(1, 3, 0, 0, 4, 3).pack(mav.dialect.MAVLink(None, 7, 1))),
     'system 7 is no multicopter (MAV_TYPE 1); only ArduPilot and PX4 multicopters are flown'),
], ids=['nothing', 'no MAVLink', 'a plane'])
def test_silence_is_told_with_what_is_known_of_its_cause(sent: bytes, words: str, capsys: Capture) -> None:
    with socket.create_server(('127.0.0.1', 0)) as server:
        url = f'tcp:127.0.0.1:{server.getsockname()[1]}'

        def speak() -> None:
            client, _ = server.accept()
            with client:
                client.sendall(sent)
                client.recv(1)  # Our heartbeats, until it hangs up.
                client.settimeout(10)
                while client.recv(1000):
                    pass

        speaker = threading.Thread(target=speak, daemon=True)
        speaker.start()
        assert fly_check.run([url, '--wait', '1']) == 2
        speaker.join(10)
    said = capsys.readouterr().err
    assert said.startswith(f'error: no autopilot answers within 1 s on {url}: ')
    assert words in said


@pytest.mark.parametrize(('given', 'words'), [
    (['nonsense'], "url is 'nonsense'"), (['udpin:127.0.0.1:1', '--grid', '/no/grid.yaml'], '/no/grid.yaml'),
])
def test_wrong_usage_is_one_sentence(given: list[str], words: str, capsys: Capture) -> None:
    assert fly_check.run(given) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count('\n') == 1
