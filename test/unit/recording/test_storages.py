"""Bags however they are stored: sqlite3 and MCAP, whole, unfinished, damaged or packed, and those of ROS 1."""

import re
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import yaml
import zstandard
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from rosbags.typesys import Stores, get_typestore

from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.errors import LogError
from advise_ros.recording.bags import read_bag
from advise_ros.recording.repair import recover
from advise_ros.recording.sources import read_recording
from support.flown import GRID, flight, round_trip
from support.ros_bags import STORE, bag, entries_of

FLOWN = flight(GRID, round_trip())


def same(found: Recording) -> bool:
    pairs = zip((*found.poses, *found.commands), (*FLOWN.poses, *FLOWN.commands), strict=True)
    return all((one == other).all() for one, other in pairs) and found.events == FLOWN.events


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    return bag(tmp_path / 'bag', entries_of(FLOWN), StoragePlugin.SQLITE3)


def the_only(directory: Path, pattern: str) -> Path:
    (file,) = directory.glob(pattern)
    return file


def test_a_sqlite3_bag_is_read_without_metadata_or_as_a_file(stored: Path) -> None:
    (stored / 'metadata.yaml').unlink()
    assert same(read_bag(stored)) and same(read_bag(the_only(stored, '*.db3')))
    found = recover(stored)
    assert found.target is not None and same(read_bag(found.target)) and recover(found.target).target is None


def test_the_write_ahead_log_of_a_recorder_that_died_is_read_and_left_alone(stored: Path, tmp_path: Path) -> None:
    file = the_only(stored, '*.db3')
    with closing(sqlite3.connect(file)) as database:
        database.execute('PRAGMA journal_mode = WAL')
        database.execute('PRAGMA wal_autocheckpoint = 0')
        database.execute('CREATE TABLE kept AS SELECT * FROM messages')
        database.execute('DELETE FROM messages')
        database.commit()
        database.execute('PRAGMA wal_checkpoint(TRUNCATE)')
        database.execute('INSERT INTO messages SELECT * FROM kept')
        database.commit()
        dead = tmp_path / 'dead'
        shutil.copytree(stored, dead)
    before = {one.name: one.read_bytes() for one in dead.iterdir()}
    assert same(read_bag(dead)) and recover(dead).target is None
    assert {one.name: one.read_bytes() for one in dead.iterdir()} == before
    the_only(dead, '*-wal').unlink()
    with pytest.raises(LogError, match='holds nothing whole'):
        read_bag(dead)


@pytest.mark.parametrize('share', [0.6, 0.8, 0.95])
def test_of_a_sqlite3_bag_that_is_cut_off_the_front_is_read(stored: Path, share: float) -> None:
    file = the_only(stored, '*.db3')
    data = file.read_bytes()
    file.write_bytes(data[: int(share * len(data))])
    found = read_bag(stored)
    count = len(found.poses.stamps_ns)
    assert 0.1 * share < count / len(FLOWN.poses.stamps_ns) < 1 and 'malformed' in found.notes[0]
    assert (found.poses.positions_enu_m == FLOWN.poses.positions_enu_m[:count]).all()
    mended = recover(stored)
    assert mended.target is not None and 'malformed' in mended.losses[0]
    assert (read_bag(mended.target).poses.stamps_ns == found.poses.stamps_ns).all()


def test_damage_within_a_sqlite3_bag_costs_what_is_damaged(stored: Path) -> None:
    file = the_only(stored, '*.db3')
    data = bytearray(file.read_bytes())
    middle = len(data) // 2 // 4096 * 4096
    data[middle : middle + 4096] = b'\xff' * 4096
    file.write_bytes(data)
    found = read_bag(stored)
    assert 0.8 < len(found.poses.stamps_ns) / len(FLOWN.poses.stamps_ns) < 1 and 'malformed' in found.notes[0]


@pytest.mark.parametrize('plugin', list(StoragePlugin))
@pytest.mark.parametrize('how', ['file', 'message', 'no metadata', 'unpacked', 'bare'])
def test_what_is_compressed_with_zstd_is_read(tmp_path: Path, plugin: StoragePlugin, how: str) -> None:
    mode = CompressionMode.MESSAGE if how == 'message' else CompressionMode.FILE
    path = bag(tmp_path / 'bag', entries_of(FLOWN), plugin, compression=mode)
    if how == 'no metadata':
        (path / 'metadata.yaml').unlink()
    elif how == 'unpacked':
        packed = the_only(path, '*.zstd')
        with packed.open('rb') as source, packed.with_suffix('').open('wb') as target:
            zstandard.ZstdDecompressor().copy_stream(source, target)
        packed.unlink()
    elif how == 'bare':
        path = shutil.copy(the_only(path, '*.zstd'), tmp_path / 'renamed')
    assert same(read_recording(path))
    assert (recover(path).target is None) == (how != 'no metadata')


@pytest.mark.parametrize('plugin', list(StoragePlugin))
def test_counts_are_compared_and_mended_whatever_the_storage(tmp_path: Path, plugin: StoragePlugin) -> None:
    path = bag(tmp_path / 'bag', entries_of(FLOWN), plugin)
    text = (path / 'metadata.yaml').read_text()
    (path / 'metadata.yaml').write_text(re.sub(r'^  message_count: .*', '  message_count: 7', text, flags=re.MULTILINE))
    assert 'metadata.yaml counts 7 messages' in read_bag(path).notes[0]
    mended = recover(path)
    assert mended.target is not None and 'counts 7' in mended.losses[0] and same(read_bag(mended.target))


@pytest.mark.parametrize('storage', ['', 'mcap', 'sqlite3', 'rosbag_v2'])
@pytest.mark.parametrize('plugin', list(StoragePlugin))
def test_what_people_edit_in_metadata_does_not_matter(tmp_path: Path, plugin: StoragePlugin, storage: str) -> None:
    path = bag(tmp_path / 'bag', entries_of(FLOWN), plugin)
    described = yaml.safe_load((path / 'metadata.yaml').read_text())
    information = described['rosbag2_bagfile_information']
    information['storage_identifier'] = storage
    information['topics_with_message_count'][0]['topic_metadata']['offered_qos_profiles'] = ''
    (path / 'metadata.yaml').write_text(yaml.safe_dump(described))
    assert same(read_bag(path)) and recover(path).target is None


def test_channels_that_are_not_cdr_are_named(tmp_path: Path) -> None:
    file = tmp_path / 'json.mcap'
    with file.open('wb') as stream:
        writer = McapWriter(stream)
        writer.start()
        schema = writer.register_schema('foxglove.PoseInFrame', 'jsonschema', b'{}')
        channel = writer.register_channel('/pose', 'json', schema)
        writer.add_message(channel, 1, b'{}', 1)
        writer.finish()
    with pytest.raises(LogError, match='/pose is json, not cdr'):
        read_recording(file)


def ros1_bag(path: Path) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    with Ros1Writer(path) as writer:
        connections: dict[str, Any] = {}
        for topic, message, stamp_ns in sorted(entries_of(FLOWN._replace(events=())), key=lambda entry: entry[2]):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            raw = STORE.cdr_to_ros1(STORE.serialize_cdr(message, kind), kind)
            writer.write(connections[topic], stamp_ns, raw)
    return path


def test_a_ros1_bag_is_read_as_the_same_flight(tmp_path: Path) -> None:
    path = ros1_bag(tmp_path / 'flight.bag')
    found = read_recording(path)
    assert (found.poses.positions_enu_m == FLOWN.poses.positions_enu_m).all()
    assert (found.commands.velocities_enu_m_s == FLOWN.commands.velocities_enu_m_s).all() and found.notes == ()
    assert recover(path).target is None
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(LogError, match='is a ROS 1 bag without a sound index'):
        read_recording(path)
