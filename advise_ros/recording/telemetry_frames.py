"""The frames of a telemetry log, and the messages in them that are wanted, read piece by piece.

Frames: https://mavlink.io/en/guide/serialization.html.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from advise_ros.core.errors import LogError
from advise_ros.mavlink.messages import (
    EXTENDED_SYS_STATE,
    HEARTBEAT,
    LOCAL_POSITION_NED,
    MAVError,
    Message,
    dialect,
)
from advise_ros.recording.frames import STAMP_BYTES, message_id, next_stamped, stamp_us, stamped_length
from advise_ros.recording.progress import ProgressCallback

SET_POSITION_TARGET_LOCAL_NED = int(dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED)
GLOBAL_POSITION_INT = int(dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT)
WANTED = frozenset((
    HEARTBEAT, LOCAL_POSITION_NED, GLOBAL_POSITION_INT, EXTENDED_SYS_STATE, SET_POSITION_TARGET_LOCAL_NED,
))
# Read so much at a time.
WINDOW = 4 * 1024 * 1024
# Stamp and frame are never longer.
LONGEST = 300


class Frame(NamedTuple):
    """A sound frame of the log: when it was logged, its bytes with the stamp, and its message if it is a wanted one."""

    stamp_ns: int
    data: bytes
    message: Message | None


@dataclass
class Scan:
    """What is in a log besides the messages asked for; `used` bytes of the newest window are done with."""

    frames: int = 0
    garbage_bytes: int = 0
    cut_bytes: int = 0
    used: int = 0


def frames_of_file(path: Path, scan: Scan, progress: ProgressCallback | None = None) -> Iterator[Frame]:
    """All sound frames of a log, in its order; `scan` is filled on the way.

    Raises:
        LogError: the file cannot be read, or is empty.
    """
    try:
        with path.open('rb') as file:
            size, done, data = path.stat().st_size, 0, b''
            if not size:
                raise LogError(f'{path} is empty; name a log with frames in it')
            while more := file.read(WINDOW):
                data += more
                yield from frames_of(data, scan, last=done + len(data) >= size)
                done, data = done + scan.used, data[scan.used :]
                if progress is not None:
                    progress(done, size)
    except FileNotFoundError:
        raise LogError(f'{path}: there is no such file; name a .tlog file') from None
    except OSError as problem:
        raise LogError(f'{path} cannot be read ({problem.strerror}); name a .tlog file') from None


def frames_of(data: bytes, scan: Scan, *, last: bool = True) -> Iterator[Frame]:
    """The sound frames in a window of a log; `last`: the log ends with it, else its end is left for the next one."""
    codec = dialect.MAVLink(None)
    at, end = 0, len(data) if last else len(data) - LONGEST
    while at < end:
        length = stamped_length(data, at)
        cut = at + length > len(data)
        good, message = _take(codec, data, at, length) if length and not cut else (False, None)
        if not good:
            at = _resume(data, at, scan, cut=cut, last=last)
            continue
        scan.frames += 1
        yield Frame(stamp_us(data, at) * 1000, data[at : at + length], message)
        at += length
    scan.used = min(at, len(data))


def _take(codec: Any, data: bytes, at: int, length: int) -> tuple[bool, Message | None]:
    """Whether the frame is sound, and its message if it is a wanted one.

    Decoding costs most of the time: a frame that is not needed is believed when another follows it at once.
    """
    after, number = at + length, message_id(data, at + STAMP_BYTES)
    if number not in WANTED and (after == len(data) or stamped_length(data, after)):
        return True, None
    if number not in dialect.mavlink_map:
        return False, None
    try:
        message = codec.decode(bytearray(data[at + STAMP_BYTES : after]))
    except MAVError:
        return False, None
    return True, message if number in WANTED else None


def _resume(data: bytes, at: int, scan: Scan, *, cut: bool, last: bool) -> int:
    """The next place where a frame may begin; the bytes up to there are of no use."""
    found = next_stamped(data, at + 1)
    after = found if found >= 0 else len(data) if last else max(at + 1, len(data) - LONGEST)
    if after == len(data) and cut:
        scan.cut_bytes = after - at
    else:
        scan.garbage_bytes += after - at
    return after
