"""Messages -> bytes, as one MAVLink system; signed if there is a key."""

from __future__ import annotations

from advise_ros.mavlink.messages import Message, dialect
from advise_ros.mavlink.signing import SigningClock


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
