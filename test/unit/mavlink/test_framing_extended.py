"""Messages that a newer autopilot has extended are read as far as they are known: MAVLink 2 appends fields."""

from __future__ import annotations

import pytest

from advise_ros.mavlink.framing import HEADER_V2, Framer
from advise_ros.mavlink.messages import dialect


def extended(message: object, more: bytes) -> bytes:
    """The frame of a message with fields after those that our dialect knows, its checksum right."""
    frame = bytearray(message.pack(dialect.MAVLink(None, 1, 1)))  # type: ignore[attr-defined]
    kind = dialect.mavlink_map[message.get_msgId()]  # type: ignore[attr-defined]
    payload = bytes(frame[HEADER_V2:-2]).ljust(kind.unpacker.size, b'\0') + more
    frame = bytearray(frame[:HEADER_V2]) + payload
    frame[1] = len(payload)
    checksum = dialect.x25crc(bytes(frame[1:]))
    checksum.accumulate(bytes([kind.crc_extra]))
    return bytes(frame) + checksum.crc.to_bytes(2, 'little')


@pytest.mark.parametrize('datagram', [True, False])
def test_px4s_answer_to_timesync_is_read_without_its_later_fields(datagram: bool) -> None:
    """PX4 answers with the asker's ids behind the two times; the dialect here knows the times alone."""
    frame = extended(dialect.MAVLink_timesync_message(5_000_000_000, 7), bytes([1, 191]))
    framer = Framer()
    (message,) = framer.datagram(frame) if datagram else framer.stream(frame)
    assert (message.get_type(), message.tc1, message.ts1) == ('TIMESYNC', 5_000_000_000, 7)
    assert framer.bad_bytes == 0


def test_an_extended_message_does_not_hide_the_next() -> None:
    frame = extended(dialect.MAVLink_timesync_message(5, 7), bytes(range(1, 40)))
    after = bytes(dialect.MAVLink_extended_sys_state_message(0, 1).pack(dialect.MAVLink(None, 1, 1)))
    framer = Framer()
    assert [message.get_type() for message in framer.stream(b'\xfd\x00' + frame + after)] == ['TIMESYNC', 'EXTENDED_SYS_STATE']
    assert framer.bad_bytes == 2
