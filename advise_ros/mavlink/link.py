"""One MAVLink link: a reader thread fills a queue, the owner polls it and sends."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Protocol

from advise_ros.mavlink.framing import Framer
from advise_ros.mavlink.messages import ATTITUDE, EKF_STATUS_REPORT, ESTIMATOR_STATUS, GPS_RAW_INT, ODOMETRY, Message
from advise_ros.mavlink.signing import Encoder, SigningClock, Verifier
from advise_ros.mavlink.transport import Address, make_transport, why

QUEUE_MESSAGES = 20_000
RETRY_S = 1.0
SIGNED_WITHOUT_KEY = 'what it sends is signed, but no key is set here: it may ignore all that we send'
# These wait in the queue for the next message that matters: each wake of the owner costs processor time.
QUIET_IDS = frozenset({ATTITUDE, EKF_STATUS_REPORT, ESTIMATOR_STATUS, GPS_RAW_INT, ODOMETRY})


class Received(NamedTuple):
    """A decoded message, when it arrived (monotonic clock) and from where (datagrams only)."""

    message: Message
    at_s: float
    source: Address | None


class AutopilotLink(Protocol):
    """What a bridge needs of whatever leads to an autopilot.

    Attributes:
        unsent: messages that could not be sent.
    """

    unsent: int

    @property
    def problem(self) -> str:
        """Why nothing comes, or not what is needed; '' if all is well."""

    @property
    def doubt(self) -> str:
        """Why what is sent may be ignored; '' if there is no sign of it."""

    @property
    def bad_bytes(self) -> int:
        """Bytes received that were no message."""

    @property
    def refused_signatures(self) -> int:
        """Messages refused because of their signature."""

    def start(self) -> None:
        """Begin to receive."""

    def poll(self) -> list[Received]:
        """What arrived since the last call, oldest first."""

    def answer_to(self, source: Address | None) -> None:
        """Send to this address from now on, where there are several."""

    def send(self, message: Message) -> bool:
        """Send one message; False if that cannot be."""

    def close(self) -> None:
        """End it and give back what it claimed."""


class Link:
    """A MAVLink link over UDP, TCP or serial.

    Opening claims the port; `start` begins to read in a thread. `poll` and `send` belong to one thread, that
    of the owner, and never block.

    Args:
        url: connection string in pymavlink's form, e.g. udpin:127.0.0.1:14550.
        baud: of a serial device.
        system_id, component_id: our own, in the frames that we send.
        key: of MAVLink 2 signing: what we send is signed, what is not signed with it is refused.
        wake: called in the reader's thread when `poll` has something that matters.

    Raises:
        InputError: the string is malformed, the port is in use or the device is missing.
    """

    def __init__(
        self, url: str, *, baud: int = 115200, system_id: int = 1, component_id: int = 191,
        key: bytes | None = None, wake: Callable[[], None] = lambda: None,
    ) -> None:
        self.url = url
        self.problem = ''
        self.unsent = 0
        self._transport = make_transport(url, baud)
        clock = SigningClock()
        self._verifier = None if key is None else Verifier(key, clock)
        self._encoder = Encoder(system_id, component_id, key, clock)
        self._framer = Framer(self._verifier)
        self._queue: deque[Received] = deque(maxlen=QUEUE_MESSAGES)
        self._wake = wake
        self._peer: Address | None = None
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._transport.open()

    @property
    def bad_bytes(self) -> int:
        """Bytes received that were no MAVLink, or of unknown messages."""
        return self._framer.bad_bytes

    @property
    def refused_signatures(self) -> int:
        """Frames refused because of their signature."""
        return 0 if self._verifier is None else self._verifier.refused

    @property
    def doubt(self) -> str:
        """Why frames are refused here, or probably there; '' if there is no sign of it."""
        if self._verifier is not None:
            return self._verifier.refusal
        return SIGNED_WITHOUT_KEY if self._framer.unproven else ''

    def start(self) -> None:
        """Begin to read."""
        self._thread = threading.Thread(target=self._read, name='mavlink-reader', daemon=True)
        self._thread.start()

    def poll(self) -> list[Received]:
        """What arrived since the last call, oldest first."""
        return [self._queue.popleft() for _ in range(len(self._queue))]

    def answer_to(self, source: Address | None) -> None:
        """Send to this address from now on (datagrams; ignored otherwise)."""
        self._peer = source

    def send(self, message: Message) -> bool:
        """Send one message; False if there is no peer, which is counted in `unsent`."""
        try:
            self._transport.send(self._encoder.frame(message), self._peer)
        except OSError:
            self.unsent += 1
            return False
        return True

    def close(self) -> None:
        """Stop reading and give the port back."""
        self._closing.set()
        self._transport.close()
        if self._thread is not None:
            self._thread.join(timeout=2.0)

    def _read(self) -> None:
        while not self._closing.is_set():
            try:
                data, source = self._transport.receive()
                self.problem = ''
            except (OSError, TypeError) as problem:  # pyserial raises TypeError when closed in a read
                self._broken(problem)
                continue
            if data:
                self._take(data, source)

    def _take(self, data: bytes, source: Address | None) -> None:
        now_s = time.monotonic()
        messages = self._framer.datagram(data) if self._transport.datagrams else self._framer.stream(data)
        self._queue.extend(Received(message, now_s, source) for message in messages)
        if any(message.get_msgId() not in QUIET_IDS for message in messages):
            self._wake()

    def _broken(self, problem: Exception) -> None:
        """Say what is wrong and wait a little; a spin on a dead peer would eat a core."""
        if self._closing.is_set():
            return
        self._transport.drop()
        self._framer.reset()
        self.problem = f'{self.url}: {why(problem)}'
        self._wake()
        self._closing.wait(RETRY_S)
