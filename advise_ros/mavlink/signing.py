"""MAVLink 2 signing: who may speak on a link.

https://mavlink.io/en/guide/message_signing.html: a signed frame ends with a link id, a time in units of 10 us
since 2015, and six bytes of SHA-256 over the key and the frame.

The hash is checked before anything is remembered: a forged frame with a time in the far future locks
nobody out. A link that is new is judged by our own clock, never by the time that another link brought, so a
sender whose clock is ahead does not lock out those with the true time. What we send is never older than the
newest time that was received with a right signature: a receiver may have taken that one for its own.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import stat
import time
from pathlib import Path

from advise_ros.core.errors import InputError
from advise_ros.mavlink.messages import Message, dialect

KEY_BYTES = 32
SIGNATURE_BYTES, HASH_BYTES = 13, 6
EPOCH_S = 1_420_070_400  # 2015-01-01
UNITS_A_SECOND = 100_000
LATEST = 2**48 - 1
# A frame of a new link may be this old; older ones are replays.
NEW_LINK_AGE = 60 * UNITS_A_SECOND
# Times further ahead than this are not taken over: there would be none left to count on.
FURTHEST_AHEAD = 10 * 365 * 86_400 * UNITS_A_SECOND
# A key's owner may use many links; more than these are forgotten, oldest first.
LINKS = 64
MAKE_KEY = "make one by: (umask 077; head -c 32 /dev/urandom | od -An -tx1 | tr -d ' \\n' > FILE)"


def load_key(path: str) -> bytes:
    """The key in a file: 64 hexadecimal digits, or 32 bytes as they are.

    Raises:
        InputError: it cannot be read, is no key, or others than its owner may read or write it.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOCTTY)
        with os.fdopen(descriptor, 'rb') as file:
            found, data = os.fstat(file.fileno()), file.read(200)
    except OSError as problem:
        raise InputError(f"signing key '{path}' cannot be read: {(problem.strerror or '').lower()}; {MAKE_KEY}") from problem
    if not stat.S_ISREG(found.st_mode) or found.st_uid not in (0, os.geteuid()) or found.st_mode & 0o077:
        raise InputError(f"signing key '{path}' is open to others than its owner ({stat.filemode(found.st_mode)}); chmod 600 it")
    return _key_of(path, data)


def _key_of(path: str, data: bytes) -> bytes:
    if len(data) == KEY_BYTES:
        return data
    try:
        key = bytes.fromhex(data.decode('ascii').strip())
    except ValueError:
        key = b''
    if len(key) != KEY_BYTES:
        raise InputError(f"signing key '{path}' is neither 64 hexadecimal digits nor 32 bytes; {MAKE_KEY}")
    return key


def optional_key(path: str) -> bytes | None:
    """The key of a parameter: none if it is empty.

    Raises:
        InputError: see `load_key`.
    """
    return load_key(str(Path(path).expanduser())) if path else None


class SigningClock:
    """Signing time: the wall clock at the start, then steady; never behind what was received.

    Args:
        now_units: signing time now; by default the wall clock's.
    """

    def __init__(self, now_units: int | None = None) -> None:
        wall = int((time.time() - EPOCH_S) * UNITS_A_SECOND) if now_units is None else now_units
        self._base = max(0, wall) - self._steady()
        self._ahead = 0

    @staticmethod
    def _steady() -> int:
        return time.monotonic_ns() // 10_000

    @property
    def own(self) -> int:
        """Our own time."""
        return self._base + self._steady()

    def adopt(self, seen: int) -> None:
        """Take note of a time that came with a right signature."""
        if seen <= self.own + FURTHEST_AHEAD:
            self._ahead = max(self._ahead, seen)

    def stamp(self) -> int:
        """A time to send, later than all before."""
        self._ahead = min(max(self.own, self._ahead + 1), LATEST)
        return self._ahead


class Verifier:
    """Says whether a frame comes from a holder of the key and is no replay.

    Attributes:
        refused: how many were refused.
        refusal: why the last one was.
    """

    def __init__(self, key: bytes, clock: SigningClock) -> None:
        self._key, self._clock = key, clock
        self._newest: dict[tuple[int, int, int], int] = {}
        self.refused = 0
        self.refusal = ''

    def accepts(self, frame: bytes, source: tuple[int, int]) -> bool:
        """Judge a whole signed frame of a (system, component)."""
        why = self._doubt(frame, source)
        if why:
            self.refuse(why)
        return not why

    def refuse(self, why: str) -> None:
        """Count a refusal."""
        self.refused += 1
        self.refusal = why

    def _doubt(self, frame: bytes, source: tuple[int, int]) -> str:
        digest = hashlib.sha256(self._key + frame[:-HASH_BYTES]).digest()[:HASH_BYTES]
        if not hmac.compare_digest(digest, frame[-HASH_BYTES:]):
            return 'a frame is signed with another key'
        stream = (*source, frame[-SIGNATURE_BYTES])
        at = int.from_bytes(frame[-SIGNATURE_BYTES + 1:-HASH_BYTES], 'little')
        newest = self._newest.get(stream)
        age = self._clock.own - at
        if newest is None and age > NEW_LINK_AGE:
            return f"a signed frame is {age / UNITS_A_SECOND:.0f} s old: a replay, or its sender's clock is behind"
        if newest is not None and at <= newest:
            return 'a signed frame came twice or out of order'
        self._remember(stream, at)
        return ''

    def _remember(self, stream: tuple[int, int, int], at: int) -> None:
        self._newest.pop(stream, None)
        self._newest[stream] = at
        if len(self._newest) > LINKS:
            del self._newest[next(iter(self._newest))]
        self._clock.adopt(at)


class Encoder:
    """Numbers, packs and signs what one component sends."""

    def __init__(self, system_id: int, component_id: int, key: bytes | None = None, clock: SigningClock | None = None) -> None:
        self._codec = dialect.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        self._clock = clock
        if key is not None and clock is not None:
            self._codec.signing.secret_key = key
            self._codec.signing.sign_outgoing = True

    def frame(self, message: Message) -> bytes:
        """The next frame."""
        if self._codec.signing.sign_outgoing and self._clock is not None:
            self._codec.signing.timestamp = self._clock.stamp()
        frame = bytes(message.pack(self._codec))
        self._codec.seq = (self._codec.seq + 1) % 256
        return frame
