"""Sockets and serial ports behind one interface, from a pymavlink connection string.

pymavlink's own connections are not used: they spin when a TCP peer dies and do not say which address sent what.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import socket
import struct
import termios
import threading
from typing import Any, Protocol

import serial

from advise_ros.core.errors import InputError

WAIT_S = 0.5  # How long a read blocks; closing a link takes as long.
READ_BYTES = 65536
# What a slow peer has not taken is dropped from here on (15 setpoints): later it would come as a burst of stale commands.
MOST_UNSENT_BYTES = 1024
FORMS = 'udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:HOST:PORT or a serial device such as /dev/ttyACM0'

Address = tuple[str, int]


class Transport(Protocol):
    """One way to move bytes. Only `open` may raise InputError; the rest raise OSError when the link breaks."""

    datagrams: bool

    def open(self) -> None:
        """Claim the port; a connection is made later, by `receive`."""

    def receive(self) -> tuple[bytes, Address | None]:
        """Next bytes and their sender; empty after WAIT_S without any."""

    def send(self, data: bytes, to: Address | None) -> None:
        """Send without blocking; raises OSError when there is no peer."""

    def drop(self) -> None:
        """Forget a broken connection; the next `receive` makes a new one."""

    def close(self) -> None:
        """Give everything back."""


def make_transport(url: str, baud: int) -> Transport:
    """The transport of a connection string.

    Raises:
        InputError: the string has none of the known forms.
    """
    kind, _, rest = url.partition(':')
    makers: dict[str, Any] = {
        'udpin': UdpIn, 'udp': UdpIn, 'udpout': UdpOut, 'tcp': TcpOut, 'tcpin': TcpIn,
    }
    if kind in makers:
        return makers[kind](url, _address(url, rest))  # type: ignore[no-any-return]
    if url.startswith('/') or url.upper().startswith('COM'):
        return Serial(url, baud)
    raise InputError(f"url is '{url}'; it must be {FORMS}")


def _address(url: str, rest: str) -> Address:
    host, _, port = rest.rpartition(':')
    if not host or not port.isascii() or not port.isdigit() or not 0 < int(port) < 65536:
        raise InputError(f"url is '{url}'; it must be {FORMS}, with a port from 1 to 65535")
    return host, int(port)


def _bound(url: str, kind: socket.SocketKind, address: Address) -> socket.socket:
    bound = socket.socket(socket.AF_INET, kind)
    try:
        if kind == socket.SOCK_STREAM:
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(address)
    except OSError as problem:
        bound.close()
        raise InputError(f"cannot listen on '{url}': {why(problem)}; {_remedy(problem)}") from problem
    bound.settimeout(WAIT_S)
    return bound


def _remedy(problem: OSError) -> str:
    if isinstance(problem, socket.gaierror) or problem.errno == errno.EADDRNOTAVAIL:
        return 'name an address of this machine, or 0.0.0.0 for all of them'
    if problem.errno == errno.EACCES:
        return 'take a port from 1024 on'
    return 'stop the other program or take another port'


def why(problem: Exception) -> str:
    """A problem of the system in words, without its number."""
    number = getattr(problem, 'errno', None)
    if isinstance(number, int) and number > 0:
        return os.strerror(number).lower()
    said: str = getattr(problem, 'strerror', None) or str(problem) or type(problem).__name__
    return said[:1].lower() + said[1:]


class UdpIn:
    """Listens; answers go to the address that the caller names."""

    datagrams = True

    def __init__(self, url: str, address: Address) -> None:
        self._url, self._address = url, address
        self._socket: socket.socket | None = None

    def open(self) -> None:
        self._socket = _bound(self._url, socket.SOCK_DGRAM, self._address)

    def receive(self) -> tuple[bytes, Address | None]:
        bound = self._socket
        if bound is None:
            raise OSError('closed')
        try:
            return bound.recvfrom(READ_BYTES)
        except (TimeoutError, ConnectionError):  # A refused datagram comes back as an error of the next read.
            return b'', None

    def send(self, data: bytes, to: Address | None) -> None:
        if self._socket is None or to is None:
            raise OSError('nobody has sent anything yet')
        self._socket.sendto(data, socket.MSG_DONTWAIT, to)

    def drop(self) -> None:
        """There is no connection to forget."""

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None


class UdpOut(UdpIn):
    """Sends to a fixed address and receives what comes back."""

    def open(self) -> None:
        try:
            self._address = (socket.gethostbyname(self._address[0]), self._address[1])
        except OSError as problem:
            raise InputError(f"url is '{self._url}', but its host is unknown: {why(problem)}") from problem
        self._socket = _bound(self._url, socket.SOCK_DGRAM, ('', 0))

    def send(self, data: bytes, to: Address | None) -> None:
        super().send(data, self._address)


def _prompt(connected: socket.socket) -> socket.socket:
    """A TCP connection that sends at once and notices within seconds that its peer has vanished."""
    connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connected.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (('TCP_KEEPIDLE', 2), ('TCP_KEEPINTVL', 1), ('TCP_KEEPCNT', 3), ('TCP_USER_TIMEOUT', 5000)):
        if hasattr(socket, name):
            connected.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
    return connected


def _unsent_bytes(connected: socket.socket) -> int:
    """What the peer has not taken yet."""
    return int(struct.unpack('i', fcntl.ioctl(connected, termios.TIOCOUTQ, bytes(4)))[0])


class TcpOut:
    """Connects, and again when the peer has gone."""

    datagrams = False

    def __init__(self, url: str, address: Address) -> None:
        self._url, self._address = url, address
        self._socket: socket.socket | None = None
        self._closed, self._lock = False, threading.Lock()

    def open(self) -> None:
        """Nothing to claim; the first `receive` connects."""
        self._closed = False

    def _connect(self) -> socket.socket | None:
        return _prompt(socket.create_connection(self._address, timeout=WAIT_S))

    def receive(self) -> tuple[bytes, Address | None]:
        stream = self._socket
        if stream is None:
            self._keep(self._connect())
            return b'', None
        try:
            data = stream.recv(READ_BYTES)
        except TimeoutError:
            return b'', None
        if not data:
            raise OSError('the peer closed the connection')
        return data, None

    def _keep(self, connected: socket.socket | None) -> None:
        """Take a connection, unless another thread closed the transport while it was made."""
        with self._lock:
            if not self._closed:
                self._socket = connected
                return
        if connected is not None:
            connected.close()
        raise OSError('closed')

    def send(self, data: bytes, to: Address | None) -> None:
        if self._socket is None:
            raise OSError('not connected')
        if _unsent_bytes(self._socket) > MOST_UNSENT_BYTES:
            raise OSError('the peer does not read')
        if self._socket.send(data, socket.MSG_DONTWAIT) != len(data):
            self.drop()  # Half a frame is out: nothing behind it would be understood.
            raise OSError('the peer does not read')

    def drop(self) -> None:
        stream, self._socket = self._socket, None
        if stream is not None:
            with contextlib.suppress(OSError):
                stream.shutdown(socket.SHUT_RDWR)
            stream.close()

    def close(self) -> None:
        with self._lock:
            self._closed = True
        self.drop()


class TcpIn(TcpOut):
    """Listens for one client at a time; the next one is taken when it has gone."""

    def __init__(self, url: str, address: Address) -> None:
        super().__init__(url, address)
        self._listener: socket.socket | None = None

    def open(self) -> None:
        super().open()
        self._listener = _bound(self._url, socket.SOCK_STREAM, self._address)
        self._listener.listen(1)

    def _connect(self) -> socket.socket | None:
        listener = self._listener
        if listener is None:
            raise OSError('closed')
        try:
            client, _ = listener.accept()
        except TimeoutError:
            return None
        client.settimeout(WAIT_S)
        return _prompt(client)

    def close(self) -> None:
        super().close()
        if self._listener is not None:
            self._listener.close()
            self._listener = None


class Serial:
    """A serial device; opened again after it was unplugged."""

    datagrams = False

    def __init__(self, device: str, baud: int) -> None:
        self._device, self._baud = device, baud
        self._port: serial.Serial | None = None
        self._closed, self._lock = False, threading.Lock()

    def open(self) -> None:
        self._closed = False
        try:
            self._port = self._opened()
        except (OSError, ValueError) as problem:
            raise InputError(
                f"cannot open the serial device '{self._device}' at {self._baud} baud: {why(problem)}; "
                'plug it in, or give the right device as url and the right baud'
            ) from problem

    def _opened(self) -> serial.Serial:
        return serial.Serial(self._device, self._baud, timeout=WAIT_S, write_timeout=0, exclusive=True)

    def receive(self) -> tuple[bytes, Address | None]:
        port = self._port or self._opened_again()
        first = port.read(1)
        return first + port.read(port.in_waiting), None

    def _opened_again(self) -> serial.Serial:
        """The device, unless another thread closed the transport while it was opened."""
        port = self._opened()
        with self._lock:
            if not self._closed:
                self._port = port
                return port
        port.close()
        raise OSError('closed')

    def send(self, data: bytes, to: Address | None) -> None:
        if self._port is None:
            raise OSError('the device is gone')
        if self._port.out_waiting > MOST_UNSENT_BYTES:
            raise OSError('the line is too slow')
        self._port.write(data)

    def drop(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            port.close()

    def close(self) -> None:
        with self._lock:
            self._closed = True
        self.drop()
