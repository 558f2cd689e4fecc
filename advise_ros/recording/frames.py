"""Where MAVLink frames lie in bytes, with a time stamp before each (telemetry logs) or without (raw logs).

Frames: https://mavlink.io/en/guide/serialization.html.
"""

from __future__ import annotations

import re
from itertools import islice

from advise_ros.mavlink.messages import MAVError, dialect

STAMP_BYTES = 8
START_V1, START_V2 = 0xFE, 0xFD
HEADER_V1, HEADER_V2 = 6, 10
CHECKSUM, SIGNATURE, SIGNED = 2, 13, 0x01
# Microseconds since 1970 at the year 2100: a later stamp is not one.
LAST_STAMP_US = 4_102_444_800_000_000
# A stamp before that year and the mark of a frame. Found by the regular expression's machine, in one pass over any bytes.
STAMPED = re.compile(rb'(?=\0[\0-\x0e].{6}(?:\xfe|\xfd.[\0\x01]))', re.DOTALL)
UNSTAMPED = re.compile(rb'(?=\xfe|\xfd.[\0\x01])', re.DOTALL)
# So many frames that follow each other without a gap are no accident.
CHAIN = 3
# Places in the head of a file that are looked at.
MOST_TRIED = 2000


def stamp_us(data: bytes, at: int) -> int:
    """The time stamp at an offset, in microseconds."""
    return int.from_bytes(data[at : at + STAMP_BYTES], 'big')


def stamped_length(data: bytes, at: int) -> int:
    """Bytes of stamp and frame if they seem to begin here, else 0."""
    if stamp_us(data, at) > LAST_STAMP_US:
        return 0
    length = frame_length(data, at + STAMP_BYTES)
    return STAMP_BYTES + length if length else 0


def frame_length(data: bytes, start: int) -> int:
    """Bytes of the frame that seems to begin here, else 0."""
    if start + HEADER_V1 > len(data):
        return 0
    payload = data[start + 1]
    if data[start] == START_V1:
        return HEADER_V1 + payload + CHECKSUM
    if data[start] == START_V2 and not data[start + 2] & ~SIGNED:
        return HEADER_V2 + payload + CHECKSUM + (SIGNATURE if data[start + 2] & SIGNED else 0)
    return 0


def next_stamped(data: bytes, at: int) -> int:
    """Offset of the next place where stamp and frame may begin, -1 for none."""
    found = STAMPED.search(data, at)
    return found.start() if found else -1


def has_stamped(head: bytes) -> bool:
    """Sound frames with stamps follow each other somewhere in these bytes, or fill them."""
    return any(_chain(head, match.start(), STAMP_BYTES) for match in islice(STAMPED.finditer(head), MOST_TRIED))


def has_unstamped(head: bytes) -> bool:
    """As has_stamped, without stamps."""
    return any(_chain(head, match.start(), 0) for match in islice(UNSTAMPED.finditer(head), MOST_TRIED))


def _chain(head: bytes, at: int, before: int) -> bool:
    codec, sound = dialect.MAVLink(None), 0
    for _ in range(CHAIN):
        length = frame_length(head, at + before)
        frame = head[at + before : at + before + length]
        if not length or len(frame) < length:
            return False
        if message_id(frame, 0) in dialect.mavlink_map:
            try:
                codec.decode(bytearray(frame))
            except MAVError:
                return False
            sound += 1
        at += before + length
        if at == len(head):
            break
    return sound > 0


def message_id(data: bytes, start: int) -> int:
    """Number of the message in the frame that begins here."""
    return data[start + 5] if data[start] == START_V1 else int.from_bytes(data[start + 7 : start + 10], 'little')
