"""The simulator's one MAVLink port, never blocking: UDP out, UDP in or TCP in."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Iterable
from typing import Any, Protocol

from advise_ros.core.errors import InputError
from advise_ros.mavlink.framing import Framer
from advise_ros.mavlink.signing import Encoder, SigningClock, Verifier

Message = Any
Address = tuple[str, int]
FORMS = 'udpout:HOST:PORT, udpin:HOST:PORT or tcpin:HOST:PORT'
READ_BYTES = 65536
# A client that does not read costs whole frames from here on, never half of one.
MAX_UNSENT_BYTES = 65536


class Port(Protocol):
    """Moves bytes without ever blocking; a missing peer is no error."""

    def read(self) -> list[Message]:
        """The messages that have arrived."""

    def write(self, frames: list[bytes]) -> None:
        """Send whole frames, or drop them when there is no peer."""

    def close(self) -> None:
        """Give the port back."""


class SimulatorLink:
    """Packs messages as one system and moves them over a port; with a key, signed ones only."""

    def __init__(
        self, endpoint: str, system_id: int, component_id: int, key: bytes | None = None, parameter: str = 'endpoint',
    ) -> None:
        clock = SigningClock()
        self._port = open_port(endpoint, None if key is None else Verifier(key, clock), parameter)
        self._encoder = Encoder(system_id, component_id, key, clock)

    def read(self) -> list[Message]:
        """The messages that have arrived; garbage is skipped."""
        return self._port.read()

    def send(self, messages: Iterable[Message]) -> None:
        """Send messages in order."""
        frames = [self._encoder.frame(message) for message in messages]
        if frames:
            self._port.write(frames)

    def pass_on(self, message: Message) -> None:
        """Send what another peer sent, as it was."""
        self._port.write([bytes(message.get_msgbuf())])

    def close(self) -> None:
        """Give the port back."""
        self._port.close()


def open_port(endpoint: str, verifier: Verifier | None = None, parameter: str = 'endpoint') -> Port:
    """The port of an `endpoint` parameter, whose name is `parameter`.

    Raises:
        InputError: malformed, unknown host, or the port is in use.
    """
    kind, _, rest = endpoint.partition(':')
    makers: dict[str, Any] = {'udpout': UdpSender, 'udpin': UdpListener, 'tcpin': TcpListener}
    host, _, number = rest.rpartition(':')
    if kind not in makers or not host or not (number.isascii() and number.isdigit() and 0 < int(number) < 65536):
        raise InputError(f"parameter '{parameter}' is '{endpoint}'; it must be {FORMS}, with a port from 1 to 65535")
    try:
        port: Port = makers[kind]((socket.gethostbyname(host), int(number)), verifier)
    except OSError as problem:
        raise InputError(
            f"port {number} of parameter '{parameter}' ('{endpoint}') cannot be opened: {os.strerror(problem.errno).lower()}; "
            f"stop the program that uses it or set another '{parameter}'"
            if problem.errno and problem.errno > 0 and not isinstance(problem, socket.gaierror)
            else f"host '{host}' of parameter '{parameter}' ('{endpoint}') is unknown; set another '{parameter}'"
        ) from problem
    return port


class UdpSender:
    """Sends to a fixed address, like SITL to a companion, and receives what comes back."""

    def __init__(self, address: Address, verifier: Verifier | None = None) -> None:
        self._peer: Address | None = address
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._framer = Framer(verifier)

    def read(self) -> list[Message]:
        messages: list[Message] = []
        while True:
            try:
                data, sender = self._socket.recvfrom(READ_BYTES)
            except OSError:  # nothing more to read
                return messages
            received = self._framer.datagram(data)
            if received:
                self._hear(sender)
            messages.extend(received)

    def _hear(self, sender: Address) -> None:
        """The peer is fixed."""

    def write(self, frames: list[bytes]) -> None:
        if self._peer is None:
            return
        for frame in frames:
            with contextlib.suppress(OSError):
                self._socket.sendto(frame, self._peer)

    def close(self) -> None:
        self._socket.close()


class UdpListener(UdpSender):
    """Listens; answers go to the sender of the last valid frame."""

    def __init__(self, address: Address, verifier: Verifier | None = None) -> None:
        super().__init__(address, verifier)
        self._peer = None
        try:
            self._socket.bind(address)
        except OSError:
            self._socket.close()
            raise

    def _hear(self, sender: Address) -> None:
        self._peer = sender


class TcpListener:
    """Listens for one client; as with SITL, a second one may connect but gets nothing until the first has gone."""

    def __init__(self, address: Address, verifier: Verifier | None = None) -> None:
        self._listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._listener.bind(address)
            self._listener.listen(4)
        except OSError:
            self._listener.close()
            raise
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self._framer = Framer(verifier)
        self._unsent = bytearray()

    def read(self) -> list[Message]:
        if self._client is None:
            self._accept()
        messages: list[Message] = []
        while self._client is not None:
            try:
                data = self._client.recv(READ_BYTES)
            except BlockingIOError:
                break
            except OSError:
                data = b''
            if not data:
                self._drop()
                break
            messages.extend(self._framer.stream(data))
        return messages

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            self._client, _ = self._listener.accept()
            self._client.setblocking(False)
            self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def _drop(self) -> None:
        if self._client is not None:
            self._client.close()
        self._framer.reset()
        self._client, self._unsent = None, bytearray()

    def write(self, frames: list[bytes]) -> None:
        if self._client is None:
            return
        for frame in frames:
            if len(self._unsent) < MAX_UNSENT_BYTES:
                self._unsent += frame
        try:
            del self._unsent[:self._client.send(self._unsent)]
        except BlockingIOError:
            pass
        except OSError:
            self._drop()

    def close(self) -> None:
        self._drop()
        self._listener.close()
