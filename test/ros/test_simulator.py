"""The simulator as a real process behind a real socket, flown by a bare pymavlink client."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from rosgraph_msgs.msg import Clock

from support import reserve

ACCEPTED, DENIED, FAILED = 0, 2, 4
LOCAL_POSITION, SYS_STATUS, EKF = 32, 1, 193
READY_BIT = 0x10000000
LIMIT_S = 60.0  # of wall time: only so that a hang ends
# Slow enough for a busy machine, fast enough for a test.
SPEEDUP = 15.0


class Client:
    """A companion of few words on pymavlink's own connection."""

    def __init__(self, url: str) -> None:
        self._wire = mavutil.mavlink_connection(url, source_system=1, source_component=191, dialect='ardupilotmega')
        self.texts: list[str] = []
        self.position: Any = None

    def close(self) -> None:
        self._wire.close()

    def until(self, wanted: Callable[[Any], Any], kinds: tuple[str, ...], each: Callable[[], None] = lambda: None) -> Any:
        """The first message of these kinds that is wanted."""
        deadline = time.monotonic() + LIMIT_S
        while time.monotonic() < deadline:
            message = self._wire.recv_match(blocking=True, timeout=0.5)
            if message is None:
                continue
            if message.get_type() == 'STATUSTEXT':
                self.texts.append(message.text)
            if message.get_type() == 'LOCAL_POSITION_NED':
                self.position = message
                each()
            if message.get_type() in kinds and wanted(message):
                return message
        raise AssertionError(f'no wanted {kinds} within {LIMIT_S} s; it said {self.texts}')

    def heartbeat(self, wanted: Callable[[Any], Any] = lambda beat: True) -> Any:
        return self.until(wanted, ('HEARTBEAT',))

    def command(self, number: int, *params: float) -> int:
        self._wire.mav.command_long_send(1, 1, number, 0, *params, *[0.0] * (7 - len(params)))
        return int(self.until(lambda ack: ack.command == number, ('COMMAND_ACK',)).result)

    def send(self, message: Any) -> None:
        self._wire.mav.send(message)

    def raw(self, data: bytes) -> None:
        self._wire.write(data)

    def fly(self, north_m_s: float, east_m_s: float, seconds: float) -> tuple[Any, Any]:
        """Stream a velocity until it is flown and for so much simulated time more; returns both positions."""
        setpoint = mavlink.MAVLink_set_position_target_local_ned_message(
            0, 1, 1, 1, 0x05C7, 0, 0, 0, north_m_s, east_m_s, 0, 0, 0, 0, 0, 0,
        )

        def stream(wanted: Callable[[Any], bool]) -> Any:
            return self.until(wanted, ('LOCAL_POSITION_NED',), each=lambda: self.send(setpoint))

        begun = stream(lambda p: math.hypot(p.vx - north_m_s, p.vy - east_m_s) < 0.1)
        return begun, stream(lambda p: p.time_boot_ms >= begun.time_boot_ms + seconds * 1000)


@pytest.fixture(params=['udpout', 'udpin', 'tcpin'])
def endpoints(request: pytest.FixtureRequest) -> tuple[str, str]:
    """The simulator's endpoint and the client's url that fits."""
    port = reserve.free_tcp_port() if request.param == 'tcpin' else reserve.free_udp_port()
    peer = {'udpout': 'udpin', 'udpin': 'udpout', 'tcpin': 'tcp'}[request.param]
    return f'{request.param}:127.0.0.1:{port}', f'{peer}:127.0.0.1:{port}'


@pytest.fixture
def udp() -> tuple[str, str]:
    port = reserve.free_udp_port()
    return f'udpout:127.0.0.1:{port}', f'udpin:127.0.0.1:{port}'


@pytest.fixture
def client(udp: tuple[str, str]) -> Iterator[Client]:
    companion = Client(udp[1])
    yield companion
    companion.close()


def connect(url: str) -> Client:
    """A client, once the simulator's port is open; a udpout client speaks first, as it must."""
    deadline = time.monotonic() + LIMIT_S
    while time.monotonic() < deadline:
        try:
            companion = Client(url)
        except ConnectionError:
            time.sleep(0.1)  # the port is not open yet
            continue
        return companion
    raise AssertionError(f'nothing listens on {url}')


def greet(companion: Client) -> None:
    """Speak until a heartbeat comes."""
    deadline = time.monotonic() + LIMIT_S
    while time.monotonic() < deadline:
        companion.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
        beat = companion._wire.recv_match(type='HEARTBEAT', blocking=True, timeout=0.2)
        if beat is not None:
            assert (beat.autopilot, beat.type, beat.get_srcSystem(), beat.get_srcComponent()) == (3, 2, 1, 1)
            return
    raise AssertionError('no heartbeat')


def test_the_whole_sequence_over_every_kind_of_link(graph, endpoints):
    endpoint, url = endpoints
    graph.start('simulator', params={'endpoint': endpoint, 'speedup': SPEEDUP, 'ready_after_s': 5.0, 'setpoint_lead_s': 0.5})
    companion = connect(url)
    greet(companion)
    for message_id in (LOCAL_POSITION, SYS_STATUS, EKF):
        assert companion.command(511, message_id, 100_000) == ACCEPTED
    companion.until(lambda s: s.onboard_control_sensors_health & READY_BIT, ('SYS_STATUS',))
    assert companion.command(176, 1, 4) == ACCEPTED
    companion.heartbeat(lambda beat: beat.custom_mode == 4)
    assert companion.command(400, 1) == ACCEPTED
    assert companion.command(22, 0, 0, 0, 0, 0, 0, 5) == ACCEPTED
    companion.until(lambda p: p.z < -4.9, ('LOCAL_POSITION_NED',))
    for north, east in ((1.2, 0.0), (0.0, 1.2), (-1.2, 0.0), (0.0, -1.2)):
        before, after = companion.fly(north, east, 2.0)
        assert (after.x - before.x) * north + (after.y - before.y) * east > 1.0
    # The setpoints stop: three seconds later it brakes, and stays in GUIDED.
    last = companion.position
    still = companion.until(lambda p: math.hypot(p.vx, p.vy) < 0.1, ('LOCAL_POSITION_NED',))
    assert still.time_boot_ms - last.time_boot_ms > 3500
    beat = companion.heartbeat()
    assert (beat.custom_mode, bool(beat.base_mode & 128)) == (4, True)
    assert companion.command(176, 1, 9) == ACCEPTED
    companion.heartbeat(lambda beat: not beat.base_mode & 128)
    assert companion.until(lambda _: True, ('LOCAL_POSITION_NED',)).z == pytest.approx(0.0, abs=0.02)
    companion.close()


def test_refusals_before_readiness_come_with_words_and_a_wrong_system_gets_nothing(graph, udp, client):
    graph.start('simulator', params={'endpoint': udp[0], 'ready_after_s': 600.0, 'system_id': 1})
    client.heartbeat()
    client.send(mavlink.MAVLink_command_long_message(9, 1, 22, 0, *[0.0] * 7))  # for system 9
    assert client.command(400, 1) == FAILED  # the first ACK is not for the 22 sent before it
    assert client.texts[-1].startswith('Arm: ')
    assert not client.heartbeat().base_mode & 128


def test_garbage_and_nan_on_the_wire_do_not_disturb_it(graph, udp, client):
    graph.start('simulator', params={'endpoint': udp[0], 'speedup': SPEEDUP, 'ready_after_s': 0.0})
    client.heartbeat()
    nan = math.nan
    for junk in (b'', b'\xfd', b'\xfd\xff\x00\x00\x00\x01\x01\xff\xff\xff' * 9, bytes(range(256)), b'\xfe' * 300):
        client.raw(junk)
    assert client.command(176, *[nan] * 7) == DENIED
    client.send(mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 99, 0, *[nan] * 11))
    assert client.command(176, 1, 4) == ACCEPTED
    client.heartbeat(lambda beat: beat.custom_mode == 4)


def test_clock_is_the_time_of_the_messages(graph, udp, client):
    graph.start('simulator', params={'endpoint': udp[0], 'speedup': 5.0, 'ready_after_s': 0.0, 'clock_rate_hz': 1000.0})
    graph.wait_for('/clock', Clock)
    client.heartbeat()
    assert client.command(511, LOCAL_POSITION, 25_000) == ACCEPTED
    stamps: list[int] = []
    client.until(lambda p: stamps.append(p.time_boot_ms) or len(stamps) == 80, ('LOCAL_POSITION_NED',))
    graph.wait_for('/clock', Clock, lambda clock: milliseconds(clock) >= stamps[-1])
    times = [milliseconds(clock) for clock in graph.listen('/clock', Clock)]
    assert set(np.diff(stamps)) <= set(range(23, 28))
    assert times == sorted(set(times))
    assert all(time_ms % 25 == 0 for time_ms in times)
    assert len(set(times) & {round(stamp / 25) * 25 for stamp in stamps}) > 5


def milliseconds(clock: Clock) -> int:
    return int(clock.clock.sec) * 1000 + clock.clock.nanosec // 1_000_000


def test_a_speedup_out_of_reach_is_reported_with_what_is_reached(graph, udp):
    graph.start('simulator', params={'endpoint': udp[0], 'speedup': 1000.0, 'step_s': 0.001, 'publish_clock': False})
    array = graph.wait_for('/diagnostics', DiagnosticArray, lambda a: a.status[0].level == DiagnosticStatus.WARN)
    assert 'cannot keep up' in array.status[0].message
    values = {value.key: value.value for value in array.status[0].values}
    assert 0.0 < float(values['speedup achieved']) < 1000.0


@pytest.mark.parametrize(('params', 'words'), [
    ({'endpoint': 'udp:somewhere'}, "'endpoint' is 'udp:somewhere'"),
    ({'speedup': -1.0}, "'speedup' is -1.0"),
    ({'speedupp': 2.0}, "did you mean 'speedup'?"),
])
def test_wrong_parameters_end_it_with_one_sentence(graph, params, words):
    process = graph.run('simulator', params=params)
    assert process.popen.returncode == 2
    (line,) = process.err
    assert words in line


def test_a_port_in_use_ends_it_with_one_sentence(graph):
    port = reserve.free_udp_port()
    first = graph.start('simulator', params={'endpoint': f'udpin:127.0.0.1:{port}'})
    graph.wait_for('/diagnostics', DiagnosticArray)
    process = graph.run('simulator', params={'endpoint': f'udpin:127.0.0.1:{port}'})
    assert process.popen.returncode == 2
    (line,) = process.err
    assert f"port {port} of parameter 'endpoint'" in line
    assert first.running
