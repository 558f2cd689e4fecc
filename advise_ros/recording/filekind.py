"""What a file is, by its first bytes: people rename recordings, and the endings of their names say little."""

from __future__ import annotations

import re
from enum import Enum
from pathlib import Path

from advise_ros.core.errors import LogError
from advise_ros.recording.frames import has_stamped, has_unstamped

# A radio link may begin a telemetry log with noise; by here its frames have begun.
HEAD_BYTES = 65_536


class FileKind(Enum):
    """A kind of file, as people call it."""

    MCAP = 'an MCAP file'
    SQLITE = 'a bag file stored as sqlite3'
    ZSTD = 'a file compressed with zstd'
    ROS1 = 'a ROS 1 bag'
    TLOG = 'a MAVLink telemetry log'
    ULOG = 'a PX4 log (ULog)'
    DATAFLASH = 'an ArduPilot log (dataflash)'
    DATAFLASH_TEXT = 'an ArduPilot log (dataflash) as text'
    RAW_MAVLINK = 'MAVLink frames without time stamps (a raw log)'
    OLD_ROS1 = 'a ROS 1 bag of a format before 2.0'
    LFS_POINTER = 'a Git LFS pointer'
    ARCHIVE = 'a compressed file or archive'
    APPLE_DOUBLE = 'a side file of macOS'
    EMPTY = 'empty'
    OTHER = 'no recording'


MAGIC = (
    (b'\x89MCAP0\r\n', FileKind.MCAP),
    (b'SQLite format 3\0', FileKind.SQLITE),
    (b'\x28\xb5\x2f\xfd', FileKind.ZSTD),
    (b'#ROSBAG V2', FileKind.ROS1),
    (b'#ROSBAG V', FileKind.OLD_ROS1),
    (b'#ROSRECORD V', FileKind.OLD_ROS1),
    (b'ULog\x01\x12\x35', FileKind.ULOG),
    (b'\xa3\x95', FileKind.DATAFLASH),
    (b'FMT, 128, 89', FileKind.DATAFLASH_TEXT),
    (b'version https://git-lfs', FileKind.LFS_POINTER),
    (b'\0\x05\x16\x07', FileKind.APPLE_DOUBLE),
    (b'\x1f\x8b', FileKind.ARCHIVE),
    (b'PK\x03\x04', FileKind.ARCHIVE),
    (b'BZh', FileKind.ARCHIVE),
    (b'\xfd7zXZ\0', FileKind.ARCHIVE),
    (b'7z\xbc\xaf', FileKind.ARCHIVE),
)
# Files of bags.
BAG_KINDS = (FileKind.MCAP, FileKind.SQLITE, FileKind.ZSTD, FileKind.ROS1)
BAG_FILE = re.compile(r'\.(mcap|db3)(\.zstd)?$', re.IGNORECASE)
METADATA_FILE = 'metadata.yaml'
# Of a file whose beginning is damaged.
ENDINGS = {
    '.mcap': FileKind.MCAP, '.db3': FileKind.SQLITE, '.tlog': FileKind.TLOG, '.ulg': FileKind.ULOG,
    '.bin': FileKind.DATAFLASH, '.bag': FileKind.ROS1, '.zstd': FileKind.ZSTD,
}
REMEDIES = {
    FileKind.RAW_MAVLINK: 'nothing says when they came; name the .tlog beside it, or record with mavproxy or a ground station',
    FileKind.OLD_ROS1: "ROS 1's own rosbag fix makes a newer one of it",
    FileKind.LFS_POINTER: 'the recording itself is not here; fetch it with git lfs pull',
    FileKind.ARCHIVE: 'unpack it first',
    FileKind.APPLE_DOUBLE: 'name the file without ._ in front',
    FileKind.EMPTY: 'nothing was recorded, or the copy failed; name another',
    FileKind.OTHER: 'name a bag, an .mcap, .db3 or .bag file, a .tlog, a .ulg or a .BIN',
}


def kind_of(path: str | Path) -> FileKind:
    """The kind of a file.

    Raises:
        LogError: it cannot be read.
    """
    file = Path(path)
    try:
        with file.open('rb') as opened:
            head = opened.read(HEAD_BYTES)
    except FileNotFoundError:
        raise LogError(f'{path}: there is no such file; name a .tlog, a bag directory or an .mcap file') from None
    except OSError as problem:
        raise LogError(f'{path} cannot be read ({problem.strerror}); name another recording') from None
    if not head:
        return FileKind.EMPTY
    known = next((kind for magic, kind in MAGIC if head.startswith(magic)), None)
    if known is not None:
        return known
    if has_stamped(head):
        return FileKind.TLOG
    if has_unstamped(head):
        return FileKind.RAW_MAVLINK
    return ENDINGS.get(file.suffix.lower(), FileKind.OTHER)


def is_bag(directory: Path) -> bool:
    """It has a metadata.yaml, or lost it but has files that are named as those of a bag."""
    if (directory / METADATA_FILE).is_file():
        return True
    names = (file.name.split('.', 1)[0] for file in bag_files(directory))
    return any(directory.name in (name, name.rsplit('_', 1)[0]) for name in names)


def bag_files(directory: Path) -> list[Path]:
    """The files with messages in a directory, in the order of their numbers: name_0.mcap, name_1.mcap."""
    files = (file for file in directory.iterdir() if not file.name.startswith('.') and file.is_file())
    return sorted((file for file in files if BAG_FILE.search(file.name)), key=_number)


def _number(file: Path) -> tuple[int, str]:
    tail = BAG_FILE.sub('', file.name).rsplit('_', 1)[-1]
    return int(tail) if tail.isdecimal() else -1, file.name


def what_it_is(path: str | Path, kind: FileKind) -> str:
    """One sentence on a file that cannot be read as a recording."""
    return f'{path} is {kind.value}: {REMEDIES[kind]}'
