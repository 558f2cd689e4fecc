"""fly_check: what is right and what is not, by parameters, by state, and against both simulated dialects."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from advise_ros.commands import fly_check
from advise_ros.config import SimulatorConfig
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.companion import Status
from advise_ros.mavlink.preflight import PARAMETERS, Level, Room, parameter_findings, state_findings
from advise_ros.mavlink.readings import Readings
from advise_ros.sim.arducopter import ArduCopter
from advise_ros.sim.link import Link as SimulatedLink
from advise_ros.sim.px4 import Px4
from support import reserve
from support.sim_companion import Companion

Capture = pytest.CaptureFixture[str]
STATUS = Status(
    'px4', 'LOITER', connected=True, ready=True, armed=False, in_air=False, commandable=False, waiting_for='', text='',
)


def levels(autopilot: str, values: dict[str, float], room: Room | None = None) -> dict[str, Level]:
    found = parameter_findings(autopilot, values, room)
    return {finding.what.split()[0]: finding.level for finding in found}


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
    assert bool(finding.remedy) == (level is not Level.RIGHT)


def test_a_fence_must_leave_room_for_the_route() -> None:
    room = Room(reach_m=40.0, high_m=12.0)
    assert levels('ardupilot', {'FENCE_RADIUS': 30.0, 'FENCE_ALT_MAX': 100.0}, room)['FENCE_RADIUS'] is Level.WRONG
    assert levels('px4', {'GF_MAX_HOR_DIST': 50.0, 'GF_MAX_VER_DIST': 10.0}, room) == {
        **dict.fromkeys(('COM_OF_LOSS_T', 'COM_OBL_RC_ACT', 'COM_RCL_EXCEPT', 'NAV_DLL_ACT', 'GF_ACTION'), Level.UNKNOWN),
        'GF_MAX_HOR_DIST': Level.RIGHT, 'GF_MAX_VER_DIST': Level.WRONG,
    }


def test_the_state_is_told_with_the_autopilots_words() -> None:
    assert [f.level for f in state_findings(STATUS, [])] == [Level.RIGHT, Level.RIGHT]
    assert state_findings(STATUS._replace(armed=True), [])[1].what == 'it is armed'
    waiting = state_findings(STATUS._replace(ready=False, waiting_for='EKF position'), ['PreArm: Compass'])
    assert waiting[1].what == 'it is not ready to arm; it waits for: EKF position'
    assert waiting[2].what == 'it says: PreArm: Compass'


@pytest.mark.parametrize(('dialect', 'autopilot'), [(ArduCopter, 'ardupilot'), (Px4, 'px4')])
def test_parameters_are_read_from_both_dialects_and_asked_for_again(dialect: type, autopilot: str) -> None:
    companion = Companion(dialect=dialect)
    readings = Readings((*PARAMETERS[autopilot], 'NO_SUCH_NAME'), bytewise=autopilot == 'px4')
    lost = True
    for turn in range(40):
        for message in readings.step((1, 1), turn * 0.2):
            for reply in companion.say(message):
                reply.pack(mav.dialect.MAVLink(None, 1, 1))
                if not lost:
                    readings.observe(mav.dialect.MAVLink(None).decode(bytearray(reply.get_msgbuf())))
        lost = turn < 3
    assert readings.done
    assert set(readings.values) == set(PARAMETERS[autopilot]) - {'ARMING_SKIPCHK'}  # ArduPilot 4.7's name.
    wanted = {'ardupilot': ('GUID_TIMEOUT', 3.0), 'px4': ('GF_ACTION', 2.0)}[autopilot]
    assert readings.values[wanted[0]] == wanted[1]


def test_what_not_every_version_has_is_soon_no_longer_waited_for() -> None:
    readings = Readings(('ONE', 'NEWER'), bytewise=False, optional=frozenset({'NEWER'}))
    readings.observe(mav.dialect.MAVLink_param_value_message(b'ONE', 1.0, 9, 1, 0))
    asked = [len(readings.step((1, 1), turn * 0.5)) for turn in range(8)]
    assert asked == [1, 1, 1, 0, 0, 0, 0, 0]
    assert readings.done


@contextlib.contextmanager
def on_the_air(dialect: type, port: int, key: bytes | None = None) -> Iterator[None]:
    """A simulated autopilot behind UDP in a thread, ten times faster than real."""
    autopilot = dialect(SimulatorConfig(ready_after_s=2.0), np.random.default_rng(0))
    link, end = SimulatedLink(f'udpout:127.0.0.1:{port}', 1, 1, key), threading.Event()

    def run() -> None:
        while not end.wait(0.0025):
            link.send([reply for message in link.read() for reply in autopilot.receive(message)])
            link.send(autopilot.step())

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join(5)
        link.close()
    assert not autopilot.vehicle.armed


@pytest.mark.parametrize(('dialect', 'lines'), [
    (ArduCopter, ('right   ardupilot multicopter is heard', 'right   it is ready to arm', 'WRONG   FENCE_ENABLE = 0')),
    (Px4, ('right   px4 multicopter is heard', 'right   it is ready to arm', '-> set COM_OBL_RC_ACT to 5 (hold) or 4 (land)')),
])
def test_the_command_finds_what_is_wrong_and_arms_nothing(dialect: type, lines: tuple[str, ...], capsys: Capture) -> None:
    port = reserve.free_udp_port()
    with on_the_air(dialect, port):
        assert fly_check.run([f'udpin:127.0.0.1:{port}', '--wait', '20']) == 1
    said = capsys.readouterr().out
    assert all(line in said for line in lines)


def test_with_a_key_it_hears_only_who_has_it_and_without_one_it_says_who_signs(tmp_path: Path, capsys: Capture) -> None:
    key, port = bytes(range(32)), reserve.free_udp_port()
    (tmp_path / 'key').write_text(key.hex())
    (tmp_path / 'key').chmod(0o600)
    command = [f'udpin:127.0.0.1:{port}', '--signing-key', str(tmp_path / 'key'), '--wait']
    with on_the_air(Px4, port):
        assert fly_check.run([*command, '1']) == 2
        assert 'a frame is not signed, but a key is set; give --signing-key' in capsys.readouterr().err
    with on_the_air(Px4, port, key):
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
    assert said.startswith(f'error: no autopilot is heard within 1 s on {url}: ')
    assert words in said


@pytest.mark.parametrize(('given', 'words'), [
    (['nonsense'], "url is 'nonsense'"), (['udpin:127.0.0.1:1', '--grid', '/no/grid.yaml'], '/no/grid.yaml'),
])
def test_wrong_usage_is_one_sentence(given: list[str], words: str, capsys: Capture) -> None:
    assert fly_check.run(given) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count('\n') == 1
