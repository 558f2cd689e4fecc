"""The simulator's port on real sockets: three forms, one client, garbage, and what can be wrong with an endpoint."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.core.errors import InputError
from advise_ros.mavlink.framing import Framer
from advise_ros.sim.link import SimulatorLink
from support import reserve

HEARTBEAT = mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 3, 3)
ASK = mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)


def frame(message: Any) -> bytes:
    return bytes(message.pack(mavlink.MAVLink(None, srcSystem=1, srcComponent=191)))


def eventually(attempt: Callable[[], Any]) -> Any:
    """First true result; the sockets are local, so the limit only stops a hang."""
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        result = attempt()
        if result:
            return result
    raise AssertionError('nothing came within 10 s')


@contextlib.contextmanager
def link(endpoint: str) -> Iterator[SimulatorLink]:
    opened = SimulatorLink(endpoint, 1, 1)
    try:
        yield opened
    finally:
        opened.close()


@contextlib.contextmanager
def client(kind: socket.SocketKind, port: int | None = None) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, kind) as sock:
        sock.settimeout(10)
        if port is not None:
            sock.connect(('127.0.0.1', port))
        yield sock


def heard(sock: socket.socket) -> list[Any]:
    return Framer().datagram(sock.recv(4096))


def test_udpout_sends_to_its_peer_and_hears_it_back():
    with client(socket.SOCK_DGRAM) as peer:
        peer.bind(('127.0.0.1', 0))
        with link(f'udpout:127.0.0.1:{peer.getsockname()[1]}') as vehicle:
            vehicle.send([HEARTBEAT])
            data, sender = peer.recvfrom(4096)
            (message,) = Framer().datagram(data)
            assert (message.autopilot, message.get_srcSystem(), message.get_srcComponent()) == (3, 1, 1)
            assert data[0] == 0xFD  # MAVLink 2
            peer.sendto(frame(ASK), sender)
            assert eventually(vehicle.read)[0].command == 400


def test_udpout_does_not_mind_that_nobody_listens():
    with link(f'udpout:127.0.0.1:{reserve.free_udp_port()}') as vehicle:
        for _ in range(20):
            vehicle.send([HEARTBEAT])
            assert vehicle.read() == []


def test_udpin_answers_whoever_sent_the_last_frame_but_not_garbage():
    port = reserve.free_udp_port()
    good_and_bad = client(socket.SOCK_DGRAM, port), client(socket.SOCK_DGRAM, port)
    with link(f'udpin:127.0.0.1:{port}') as vehicle, good_and_bad[0] as good, good_and_bad[1] as bad:
        vehicle.send([HEARTBEAT])  # nobody there yet: dropped
        good.send(frame(ASK))
        eventually(vehicle.read)
        bad.send(b'GET / HTTP/1.1\r\n\r\n')
        bad.send(b'\xfd' + bytes(range(60)))
        good.send(frame(ASK))
        assert len(eventually(vehicle.read)) == 1
        vehicle.send([HEARTBEAT])
        assert heard(good)[0].get_type() == 'HEARTBEAT'


def test_tcpin_serves_one_client_and_the_next_when_it_has_gone():
    port = reserve.free_tcp_port()
    with link(f'tcpin:127.0.0.1:{port}') as vehicle, client(socket.SOCK_STREAM, port) as first:
        first.sendall(frame(ASK))
        assert eventually(vehicle.read)[0].command == 400
        with client(socket.SOCK_STREAM, port) as second:
            second.sendall(frame(ASK))
            second.setblocking(False)
            for _ in range(5):
                vehicle.send([HEARTBEAT])
                assert vehicle.read() == []
                assert heard(first)[0].get_type() == 'HEARTBEAT'
            with pytest.raises(BlockingIOError):
                second.recv(1)
            first.close()
            assert eventually(vehicle.read)[0].command == 400
            vehicle.send([HEARTBEAT])
            second.settimeout(10)
            assert heard(second)[0].get_type() == 'HEARTBEAT'


def test_tcp_frames_may_come_in_pieces_and_between_garbage():
    port = reserve.free_tcp_port()
    with link(f'tcpin:127.0.0.1:{port}') as vehicle, client(socket.SOCK_STREAM, port) as peer:
        wire = b'\x00garbage\xff' + frame(ASK) + b'more' + frame(ASK)
        messages: list[Any] = []
        for byte in wire:
            peer.sendall(bytes([byte]))
            messages += vehicle.read()
        eventually(lambda: messages.extend(vehicle.read()) or len(messages) == 2)
        assert [message.command for message in messages] == [400, 400]


def test_a_tcp_client_that_does_not_read_costs_whole_frames_only():
    port = reserve.free_tcp_port()
    with link(f'tcpin:127.0.0.1:{port}') as vehicle, client(socket.SOCK_STREAM, port) as lazy:
        lazy.sendall(frame(ASK))
        eventually(vehicle.read)
        for _ in range(200):  # 8 MB, more than the kernel keeps
            vehicle.send([HEARTBEAT] * 2000)
        framer, messages = Framer(), []
        lazy.settimeout(0.2)
        with contextlib.suppress(TimeoutError):
            while True:
                messages += framer.stream(lazy.recv(65536))
                vehicle.send([HEARTBEAT])
                if len(messages) > 100_000:
                    break
        assert len(messages) > 1000
        assert framer.bad_bytes == 0


@pytest.mark.parametrize('endpoint', [
    '', 'udpout', 'udpout:', 'udpout:14550', 'udpout:127.0.0.1', 'udpout:127.0.0.1:', 'udpout:127.0.0.1:x', 'udpin:127.0.0.1:0',
    'tcpin:127.0.0.1:65536', 'tcp:127.0.0.1:5760', 'serial:/dev/ttyUSB0', 'udpin:127.0.0.1:-5', 'udpin:127.0.0.1:²',
])
def test_malformed_endpoints_are_refused_with_the_forms(endpoint):
    with pytest.raises(InputError, match=r"'endpoint'.*udpout:HOST:PORT, udpin:HOST:PORT or tcpin:HOST:PORT"):
        SimulatorLink(endpoint, 1, 1)


def test_an_unknown_host_is_named():
    with pytest.raises(InputError, match=r"host 'no\.such\.host\.invalid' of parameter 'endpoint'"):
        SimulatorLink('udpout:no.such.host.invalid:14550', 1, 1)


@pytest.mark.parametrize('kind', ['udpin', 'tcpin'])
def test_a_port_in_use_is_named_with_the_parameter(kind):
    port = reserve.free_udp_port() if kind == 'udpin' else reserve.free_tcp_port()
    with link(f'{kind}:127.0.0.1:{port}'), pytest.raises(InputError, match=rf"port {port} of parameter 'endpoint'.*in use"):
        SimulatorLink(f'{kind}:127.0.0.1:{port}', 1, 1)
