"""Links over real sockets: UDP and TCP both ways, lost peers, ports in use."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from advise_ros.core.errors import InputError
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.link import Link, Received
from advise_ros.mavlink.transport import Serial, TcpOut
from support import reserve

PATIENCE_S = 20.0


@pytest.fixture
def opened() -> Iterator[Callable[..., Link]]:
    """Opens links and closes them at the end."""
    with ExitStack() as stack:
        def make(url: str, **options: object) -> Link:
            link = Link(url, **options)  # type: ignore[arg-type]
            stack.callback(link.close)
            link.start()
            return link

        yield make


def hear(link: Link, prompt: Callable[[], object]) -> Received:
    """The first message that arrives while `prompt` is repeated."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        prompt()
        time.sleep(0.02)
        arrived = link.poll()
        if arrived:
            return arrived[0]
    raise AssertionError(f'nothing was heard; problem: {link.problem!r}')


def wait_until(condition: Callable[[], bool], what: str) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s, what
        time.sleep(0.01)


def talk(one: Link, other: Link) -> None:
    """Both hear each other, the first one speaks first."""
    received = hear(other, lambda: one.send(mav.heartbeat()))
    assert received.message.get_srcSystem() == 21
    other.answer_to(received.source)
    assert hear(one, lambda: other.send(mav.heartbeat())).message.get_srcSystem() == 42


@pytest.mark.parametrize(('speaker', 'listener', 'port_of'), [
    ('udpout', 'udpin', reserve.free_udp_port), ('tcp', 'tcpin', reserve.free_tcp_port),
])
def test_both_directions(opened: Callable[..., Link], speaker: str, listener: str, port_of: Callable[[], int]) -> None:
    port = port_of()
    two = opened(f'{listener}:127.0.0.1:{port}', system_id=42)
    one = opened(f'{speaker}:127.0.0.1:{port}', system_id=21)
    talk(one, two)


def test_a_tcp_link_survives_its_peer(opened: Callable[..., Link]) -> None:
    port = reserve.free_tcp_port()
    first = opened(f'tcpin:127.0.0.1:{port}', system_id=42)
    client = opened(f'tcp:127.0.0.1:{port}', system_id=21)
    talk(client, first)
    first.close()
    wait_until(lambda: bool(client.problem), 'the loss is told')
    assert f'tcp:127.0.0.1:{port}' in client.problem
    assert not client.send(mav.heartbeat())
    talk(client, opened(f'tcpin:127.0.0.1:{port}', system_id=42))
    assert client.problem == ''


def test_a_dead_tcp_peer_costs_no_processor_time(opened: Callable[..., Link]) -> None:
    link = opened(f'tcp:127.0.0.1:{reserve.free_tcp_port()}')
    wait_until(lambda: 'refused' in link.problem, 'the refusal is told')
    used_s = sum(os.times()[:2])
    for _ in range(50):
        time.sleep(0.01)
    assert sum(os.times()[:2]) - used_s < 0.25


def test_the_next_tcp_client_is_taken_when_the_first_has_gone(opened: Callable[..., Link]) -> None:
    port = reserve.free_tcp_port()
    server = opened(f'tcpin:127.0.0.1:{port}', system_id=42)
    for _ in range(2):
        client = opened(f'tcp:127.0.0.1:{port}', system_id=21)
        talk(client, server)
        client.close()


def test_messages_that_matter_wake_the_owner(opened: Callable[..., Link]) -> None:
    port = reserve.free_udp_port()
    woken: list[bool] = []
    link = opened(f'udpin:127.0.0.1:{port}', wake=lambda: woken.append(True))
    speaker = opened(f'udpout:127.0.0.1:{port}')
    hear(link, lambda: speaker.send(mav.heartbeat()))
    assert woken


def test_garbage_is_counted_and_harms_nothing(opened: Callable[..., Link]) -> None:
    port = reserve.free_udp_port()
    link = opened(f'udpin:127.0.0.1:{port}')
    speaker = opened(f'udpout:127.0.0.1:{port}', system_id=21)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as loose:
        garbage = b'\xfd\xffno mavlink at all'
        loose.sendto(garbage, ('127.0.0.1', port))
        assert hear(link, lambda: speaker.send(mav.heartbeat())).message.get_srcSystem() == 21
        wait_until(lambda: link.bad_bytes == len(garbage), 'the garbage is counted')


def test_answering_before_anybody_spoke_is_counted(opened: Callable[..., Link]) -> None:
    link = opened(f'udpin:127.0.0.1:{reserve.free_udp_port()}')
    assert not link.send(mav.heartbeat())
    assert link.unsent == 1


@pytest.mark.parametrize(('kind', 'port_of'), [('udpin', reserve.free_udp_port), ('tcpin', reserve.free_tcp_port)])
def test_a_port_in_use_is_one_sentence(opened: Callable[..., Link], kind: str, port_of: Callable[[], int]) -> None:
    url = f'{kind}:127.0.0.1:{port_of()}'
    opened(url)
    with pytest.raises(InputError, match=f"^cannot listen on '{url}': address already in use; stop the other program"):
        Link(url)


@pytest.mark.parametrize('url', [
    '', 'udpin', 'udpin:127.0.0.1', 'udpin:127.0.0.1:0', 'udpin:h:70000', 'ftp:127.0.0.1:1', 'tcp:h:x',
])
def test_a_malformed_url_is_named_with_the_forms_that_work(url: str) -> None:
    with pytest.raises(InputError, match=r"^url is '.*'; it must be udpin:HOST:PORT"):
        Link(url)


def test_a_missing_serial_device_is_named() -> None:
    with pytest.raises(InputError, match=r"^cannot open the serial device '/dev/no_such_device' at 57600 baud: no such file or"):
        Link('/dev/no_such_device', baud=57600)


@pytest.mark.parametrize('url', ['udpin:no.such.host.invalid:14550', 'tcpin:192.0.2.1:14550'])
def test_an_address_of_another_machine_cannot_be_listened_on(url: str) -> None:
    with pytest.raises(InputError, match=f"^cannot listen on '{url}': .*; name an address of this machine"):
        Link(url)


def test_signed_frames_without_a_key_are_taken_and_told_of(opened: Callable[..., Link]) -> None:
    port = reserve.free_udp_port()
    link = opened(f'udpin:127.0.0.1:{port}', system_id=42)
    speaker = opened(f'udpout:127.0.0.1:{port}', system_id=21, key=bytes(range(32)))
    assert link.doubt == ''
    assert hear(link, lambda: speaker.send(mav.heartbeat())).message.get_srcSystem() == 21
    assert link.doubt == 'what it sends is signed, but no key is set here: it may ignore all that we send'


def test_an_unknown_host_is_named() -> None:
    with pytest.raises(InputError, match='its host is unknown'):
        Link('udpout:no.such.host.invalid:14550')


def test_a_serial_line_carries_both_directions(opened: Callable[..., Link]) -> None:
    ours, theirs = os.openpty()
    try:
        link = opened(os.ttyname(theirs), system_id=21)
        frame = bytes(mav.heartbeat().pack(mav.dialect.MAVLink(None, 42, 1)))
        assert hear(link, lambda: os.write(ours, frame)).message.get_srcSystem() == 42
        assert link.send(mav.heartbeat())
        assert os.read(ours, 1) == b'\xfd'
    finally:
        link.close()
        os.close(ours)
        os.close(theirs)


def test_a_tcp_peer_that_does_not_read_gets_no_burst_of_stale_commands(opened: Callable[..., Link]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        listener.bind(('127.0.0.1', 0))
        listener.listen(1)
        link = opened(f'tcp:127.0.0.1:{listener.getsockname()[1]}')
        peer, _ = listener.accept()
        with peer:
            wait_until(lambda: link.send(mav.heartbeat()), 'the connection')
            wait_until(lambda: not all(link.send(mav.heartbeat()) for _ in range(100)), 'a full line')
            waiting = link.unsent
            assert not link.send(mav.heartbeat())
            assert link.unsent == waiting + 1
            peer.settimeout(1.0)
            wait_until(lambda: bool(peer.recv(65536)) and link.send(mav.heartbeat()), 'a line that flows again')


def test_a_signed_link_hears_its_own_kind_alone(opened: Callable[..., Link]) -> None:
    port, key = reserve.free_udp_port(), bytes(range(32))
    link = opened(f'udpin:127.0.0.1:{port}', system_id=42, key=key)
    stranger = opened(f'udpout:127.0.0.1:{port}', system_id=66)
    friend = opened(f'udpout:127.0.0.1:{port}', system_id=21, key=key)
    wait_until(lambda: stranger.send(mav.heartbeat()) and link.refused_signatures > 0, 'a refusal')
    assert link.doubt == 'a frame is not signed, but a key is set'
    assert hear(link, lambda: friend.send(mav.heartbeat())).message.get_srcSystem() == 21


def test_a_tcp_connection_made_while_the_link_is_closed_is_given_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """The owner closes in its thread while the reader connects in another."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as listener:
        listener.bind(('127.0.0.1', 0))
        listener.listen(1)
        transport = TcpOut('', listener.getsockname())
        made = socket.create_connection(listener.getsockname())

        def connect() -> socket.socket:
            transport.close()
            return made

        monkeypatch.setattr(transport, '_connect', connect)
        with pytest.raises(OSError, match='closed'):
            transport.receive()
        assert made.fileno() == -1
        with pytest.raises(OSError, match='not connected'):
            transport.send(b'x', None)


def test_a_serial_device_opened_while_the_link_is_closed_is_given_back(monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = os.openpty()
    try:
        transport = Serial(os.ttyname(theirs), 57600)
        made = transport._opened()

        def opened() -> object:
            transport.close()
            return made

        monkeypatch.setattr(transport, '_opened', opened)
        with pytest.raises(OSError, match='closed'):
            transport.receive()
        assert not made.is_open
    finally:
        os.close(ours)
        os.close(theirs)
