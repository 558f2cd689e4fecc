"""Bytes -> MAVLink messages, resynchronising after garbage.

pymavlink's own parser trusts the length byte of whatever follows a start byte, so garbage or an unknown
message id swallows the good frames behind it. Here a frame counts only if its id is known and its checksum
is right; anything else advances by one byte.
"""

from __future__ import annotations

from advise_ros.mavlink.messages import MAVError, Message, dialect

START_V1, START_V2 = 0xFE, 0xFD
HEADER_V1, HEADER_V2 = 6, 10
CHECKSUM, SIGNATURE = 2, 13
SIGNED = 0x01
LONGEST_FRAME = HEADER_V2 + 255 + CHECKSUM + SIGNATURE


class Framer:
    """Cuts one stream (or one datagram at a time) into messages."""

    def __init__(self) -> None:
        self._codec = dialect.MAVLink(None)
        self._buffer = bytearray()
        self.bad_bytes = 0

    def datagram(self, data: bytes) -> list[Message]:
        """The messages of one datagram; frames never span two."""
        self._buffer = bytearray(data)
        return self._cut(more_may_come=False)

    def stream(self, data: bytes) -> list[Message]:
        """The messages completed by the next bytes of a stream."""
        self._buffer += data
        return self._cut(more_may_come=True)

    def _cut(self, *, more_may_come: bool) -> list[Message]:
        messages: list[Message] = []
        at = self._next_start(0)
        while at < len(self._buffer):
            length = self._frame_length(at)
            incomplete = length == 0 or at + length > len(self._buffer)
            if incomplete and more_may_come:
                break
            message = None if incomplete or length < 0 else self._decode(self._buffer[at:at + length])
            if message is None:
                self.bad_bytes += 1
                at = self._next_start(at + 1)
            else:
                messages.append(message)
                at = self._next_start(at + length)
        del self._buffer[:at]
        return messages

    def _next_start(self, at: int) -> int:
        found = [i for i in (self._buffer.find(START_V2, at), self._buffer.find(START_V1, at)) if i >= 0]
        start = min(found, default=len(self._buffer))
        self.bad_bytes += start - at
        return start

    def _frame_length(self, at: int) -> int:
        """Length of the frame that starts here: 0 if more bytes are needed to tell, -1 if there can be none."""
        rest = len(self._buffer) - at
        if rest < HEADER_V1:
            return 0
        payload = self._buffer[at + 1]
        if self._buffer[at] == START_V1:
            return HEADER_V1 + payload + CHECKSUM if self._buffer[at + 5] in dialect.mavlink_map else -1
        if rest < HEADER_V2:
            return 0
        flags = self._buffer[at + 2]
        message_id = int.from_bytes(self._buffer[at + 7:at + 10], 'little')
        if flags & ~SIGNED or message_id not in dialect.mavlink_map:
            return -1
        return HEADER_V2 + payload + CHECKSUM + (SIGNATURE if flags & SIGNED else 0)

    def _decode(self, frame: bytearray) -> Message | None:
        try:
            return self._codec.decode(frame)
        except MAVError:
            return None
