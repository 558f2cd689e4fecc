"""The table of formats in docs/recordings.md: every recording in it is made here and read."""

from __future__ import annotations

import contextlib
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.typesys import Stores, get_typestore
from zstandard import compress

from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.errors import LogError
from advise_ros.recording.sources import read_recording
from support.flown import GRID, flight, round_trip
from support.logs import dataflash, tlog, ulog
from support.paths import ROOT
from support.ros_bags import STORE, bag, entries_of, own_bag

FLOWN = flight(GRID, round_trip())
GARBAGE = bytes(range(1, 200)) * 3


def ros1(path: Path) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    with Ros1Writer(path) as writer:
        connections = {}
        for topic, message, stamp_ns in sorted(entries_of(FLOWN._replace(events=())), key=lambda entry: entry[2]):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], stamp_ns, STORE.cdr_to_ros1(STORE.serialize_cdr(message, kind), kind))
    return path


def written(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


MAKERS: dict[str, Callable[[Path], Path]] = {
    'rosbag2, MCAP': lambda path: own_bag(path, sorted(entries_of(FLOWN), key=lambda entry: entry[2])),
    'rosbag2, sqlite3': lambda path: bag(path, entries_of(FLOWN), StoragePlugin.SQLITE3),
    'ROS 1 (.bag)': lambda path: ros1(path.with_suffix('.bag')),
    'MAVLink telemetry (.tlog)': lambda path: written(path, tlog(FLOWN)),
    'ArduPilot (.BIN)': lambda path: written(path, dataflash(FLOWN)),
    'PX4 (.ulg)': lambda path: written(path, ulog(FLOWN)),
}


def messages(path: Path) -> Path:
    """The file with the messages: a bag's only one."""
    return next(file for file in path.iterdir() if file.suffix in ('.mcap', '.db3')) if path.is_dir() else path


def cut(path: Path) -> None:
    file = messages(path)
    file.write_bytes(file.read_bytes()[: file.stat().st_size * 3 // 4])


def damage(path: Path) -> None:
    file = messages(path)
    data = bytearray(file.read_bytes())
    middle = len(data) * 3 // 4 // 4096 * 4096
    data[middle : middle + 400] = bytes(reversed(range(200))) * 2
    file.write_bytes(data)


def lengthen(path: Path) -> None:
    file = messages(path)
    file.write_bytes(file.read_bytes() + GARBAGE)


def undescribe(path: Path) -> None:
    (path / 'metadata.yaml').unlink()


def pack(path: Path) -> None:
    file = messages(path)
    data = file.read_bytes()
    if path.is_dir():
        file.unlink()
        file.with_name(f'{file.name}.zstd').write_bytes(compress(data))
    else:
        file.write_bytes(compress(data))


def empty(path: Path) -> None:
    messages(path).write_bytes(b'')


ODDITIES: dict[str, Callable[[Path], None]] = {
    'whole': lambda path: None, 'cut off': cut, 'damaged': damage, 'bytes added': lengthen,
    'without metadata.yaml': undescribe, 'packed by zstd': pack, 'empty': empty,
}


def outcome(path: Path) -> str:
    """What the table says of a recording."""
    recordings: list[Recording] = []
    with contextlib.suppress(LogError):
        recordings.append(read_recording(path))
    if not recordings:
        with pytest.raises(LogError, match=re.escape(str(path))):
            read_recording(path)
        return 'refused'
    (found,) = recordings
    counts = [(len(one.poses.stamps_ns), len(one.commands.stamps_ns)) for one in (found, FLOWN)]
    whole = counts[0] == counts[1]
    assert whole or found.notes, f'{path}: something is lost without a word'
    return ('noted' if found.notes else 'all') if whole else 'part'


def row(directory: Path, name: str) -> list[str]:
    cells = []
    for number, (oddity, make_odd) in enumerate(ODDITIES.items()):
        path = MAKERS[name](directory / f'recording{number}')
        if oddity == 'without metadata.yaml' and not path.is_dir():
            cells.append('-')
            continue
        make_odd(path)
        cells.append(outcome(path))
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    return cells


@pytest.mark.parametrize('name', MAKERS)
def test_the_table_says_what_becomes_of_each(tmp_path: Path, name: str) -> None:
    text = (ROOT / 'docs' / 'recordings.md').read_text()
    assert f'| format | {" | ".join(ODDITIES)} |' in text
    line = f'| {name} | {" | ".join(row(tmp_path, name))} |'
    assert line in text, f'docs/recordings.md: this row is right:\n{line}'
