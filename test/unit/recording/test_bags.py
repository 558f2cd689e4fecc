"""Bags of several hands."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin

from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of
from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.errors import LogError
from advise_ros.recording.bags import read_bag
from advise_ros.recording.definitions import definition
from advise_ros.recording.sources import read_recording
from advise_ros.recording.topics import BagTopics
from advise_ros.recording.writer import BagWriter
from support.flown import GRID, flight, round_trip
from support.ros_bags import STORE, bag, command, entries_of, odometry, own_bag, policy, pose

FLOWN = flight(GRID, round_trip())


def same(found: Recording, expected: Recording = FLOWN) -> bool:
    pairs = zip((*found.poses, *found.commands), (*expected.poses, *expected.commands), strict=True)
    return all((one == other).all() for one, other in pairs) and found.events == expected.events


@pytest.mark.parametrize('plugin', list(StoragePlugin))
@pytest.mark.parametrize('prefix', ['', '/drone1'])
def test_a_bag_gives_what_was_flown(tmp_path: Path, plugin: StoragePlugin, prefix: str) -> None:
    path = bag(tmp_path / 'bag', entries_of(FLOWN, prefix), plugin)
    found = read_recording(path)
    topics = f'positions {prefix}/pose, commands {prefix}/cmd_vel, state {prefix}/vehicle_status'
    assert same(found) and found.source == f'{path} ({topics})' and not found.notes
    (demonstration,) = demonstrations_of(GRID, found, DiscretiseSettings()).demonstrations
    assert len(demonstration.states) == len(round_trip()) - 1


def test_a_bare_mcap_file_is_read(tmp_path: Path) -> None:
    bag(tmp_path / 'bag', entries_of(FLOWN))
    (file,) = (tmp_path / 'bag').glob('*.mcap')
    assert same(read_recording(shutil.copy(file, tmp_path / 'bare.mcap')))


def test_odometry_is_taken_when_there_is_no_pose(tmp_path: Path) -> None:
    entries = [('/x/odom', odometry(int(s), p), int(s)) for s, p in zip(*FLOWN.poses, strict=True)]
    found = read_bag(bag(tmp_path / 'bag', entries))
    assert (found.poses.positions_enu_m == FLOWN.poses.positions_enu_m).all() and found.events == ()


def test_one_of_several_vehicles_has_to_be_named(tmp_path: Path) -> None:
    other = flight(GRID, round_trip()[:4])
    path = bag(tmp_path / 'bag', [*entries_of(FLOWN, '/a'), *entries_of(other, '/b')])
    with pytest.raises(LogError, match='positions on /a/pose, /b/pose; name one'):
        read_bag(path)
    assert same(read_bag(path, BagTopics(pose=('/a/pose',))))
    assert same(read_bag(path, BagTopics(pose=('/b/pose',))), other)


def test_a_policy_begins_and_ends_to_fly(tmp_path: Path) -> None:
    phases = [(10, 1), (20, 2), (30, 3), (40, 2)]
    entries = [('/policy/status', policy(s, phase), s) for s, phase in phases]
    found = read_bag(bag(tmp_path / 'bag', [*entries_of(FLOWN), *entries]))
    assert [tuple(event) for event in found.policy] == [(10, True), (30, False), (40, True)]


def test_positions_in_another_frame_are_refused(tmp_path: Path) -> None:
    path = bag(tmp_path / 'bag', entries_of(FLOWN, frame_id='odom'))
    with pytest.raises(LogError, match="the positions on /pose are in frame 'odom', not 'map'"):
        read_bag(path)


def test_commands_in_another_frame_are_not_used(tmp_path: Path) -> None:
    entries = [*entries_of(FLOWN), ('/cmd_vel', command(1, (1, 0, 0), 'base_link'), 1)]
    found = read_bag(bag(tmp_path / 'bag', entries))
    assert same(found) and found.notes == ("1 commands in frame 'base_link' are not in 'map' and were not used",)


def test_a_bag_without_positions_lists_what_it_has(tmp_path: Path) -> None:
    path = bag(tmp_path / 'bag', [('/cmd_vel', command(5, (1, 0, 0)), 5)])
    with pytest.raises(LogError, match=r'it has /cmd_vel \(geometry_msgs/msg/TwistStamped\)'):
        read_bag(path)


def test_of_a_bag_that_was_cut_off_what_is_whole_is_read_and_the_rest_told(tmp_path: Path) -> None:
    path = own_bag(tmp_path / 'bag', sorted(entries_of(FLOWN), key=lambda entry: entry[2]))
    (file,) = path.glob('*.mcap')
    data = file.read_bytes()
    found = []
    for length in (len(data) // 3, len(data) // 2, len(data) - 1):
        file.write_bytes(data[:length])
        for name in (path, file):
            recording = read_recording(name)
            assert 'the recording was not finished' in recording.notes[0], recording.notes
        count = len(recording.poses.stamps_ns)
        assert (recording.poses.positions_enu_m == FLOWN.poses.positions_enu_m[:count]).all()
        found.append(count)
    assert 0 < found[0] < found[1] < found[2] == len(FLOWN.poses.stamps_ns)


def test_a_bag_with_nothing_whole_in_it_is_refused_in_one_sentence(tmp_path: Path) -> None:
    path = bag(tmp_path / 'bag', entries_of(FLOWN))
    (file,) = path.glob('*.mcap')
    data = file.read_bytes()
    for length in (0, 5, 30):
        file.write_bytes(data[:length])
        with pytest.raises(LogError, match=r'holds nothing whole|has no positions') as caught:
            read_recording(path)
        assert '\n' not in str(caught.value)


def test_what_is_no_bag(tmp_path: Path) -> None:
    with pytest.raises(LogError, match='there is no such file'):
        read_recording(tmp_path / 'none.mcap')
    with pytest.raises(LogError, match=r'no metadata\.yaml and no \.mcap or \.db3 file; name a bag directory'):
        read_recording(tmp_path)
    (tmp_path / 'a.mcap').write_bytes(b'x')
    with pytest.raises(LogError, match=r'holds nothing whole \(metadata\.yaml is missing; a\.mcap was read; '):
        read_recording(tmp_path)


# -- by other hands --------------------------------------------------------------------------------
def test_positions_of_mavros_and_of_ardupilots_dds_are_found(tmp_path: Path) -> None:
    stamped = list(zip(*FLOWN.poses, strict=True))
    mavros = [('/mavros/local_position/pose', pose(int(s), p), int(s)) for s, p in stamped]
    other = [('/mavros/vision_pose/pose', pose(int(s), (0, 0, 0)), int(s)) for s, _ in stamped]
    assert (read_bag(bag(tmp_path / 'mavros', [*mavros, *other])).poses[1] == FLOWN.poses[1]).all()
    for prefix in ('ap', 'ap/v1'):
        dds = [(f'/{prefix}/pose/filtered', pose(int(s), p, 'base_link'), int(s)) for s, p in stamped]
        assert (read_bag(bag(tmp_path / prefix, dds)).poses[1] == FLOWN.poses[1]).all()


def test_names_of_frames_may_differ_in_length_within_a_topic(tmp_path: Path) -> None:
    """Each moves the numbers behind it; all are compared."""
    frames = ('map', 'base_link', 'map', 'a', '')
    entries = [('/cmd_vel', command(i + 1, (i, 1, 2), frames[i % 5]), i + 1) for i in range(50)]
    found = read_bag(bag(tmp_path / 'bag', [*entries_of(FLOWN), *entries]))
    assert sorted(found.notes) == [
        *(f"10 commands in frame '{frame}' are not in 'map' and were not used" for frame in ('a', 'base_link')),
        'commands on /cmd_vel name no frame; they were taken as velocities to the east and north',
    ]
    assert found.commands.velocities_enu_m_s[:30, 0].tolist() == [i for i in range(50) if frames[i % 5] in ('map', '')]


def test_a_bag_of_another_writer_is_read_in_the_order_of_its_log_times(tmp_path: Path) -> None:
    entries = sorted(entries_of(FLOWN), key=lambda entry: entry[2])
    path = bag(tmp_path / 'whole', entries)
    (file,) = path.glob('*.mcap')
    shuffled = own_bag(tmp_path / 'shuffled', [*entries[200:], *entries[:200]])
    (ours,) = shuffled.glob('*.mcap')
    assert (np.diff(read_bag(ours).poses.stamps_ns) < 0).any()  # Our logger keeps the order of arrival.
    ours.write_bytes(ours.read_bytes().replace(b'advise_ros', b'someone_xy', 1))
    assert same(read_bag(ours), read_bag(file))


def test_messages_that_do_not_fit_their_type_are_left_out_and_told(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / 'bag')
    channel = writer.add_topic('/pose', definition('geometry_msgs/msg/PoseStamped'))
    good = bytes(STORE.serialize_cdr(pose(5, (1, 2, 3)), 'geometry_msgs/msg/PoseStamped'))
    for data in (good, b'', good[:30], b'\0\0' + good[2:], good[:12] + b'\xff' * 4 + good[16:]):
        writer.write(channel, 5, 5, data)
    writer.close()
    found = read_bag(tmp_path / 'bag')
    assert found.poses.positions_enu_m.tolist() == [[1, 2, 3]] and found.poses.stamps_ns.tolist() == [5]
    assert found.notes == ('4 messages on /pose do not fit their type and were not used',)


def test_a_type_that_only_bears_a_known_name_is_refused(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / 'bag')
    known = definition('geometry_msgs/msg/PoseStamped')
    channel = writer.add_topic('/pose', known._replace(text=known.text.replace('float64 x', 'float32 x')))
    writer.write(channel, 5, 5, bytes(200))
    writer.close()
    with pytest.raises(LogError, match='topic /pose: its definition of geometry_msgs/msg/Point is not that of ROS 2'):
        read_bag(tmp_path / 'bag')


# -- metadata --------------------------------------------------------------------------------------
def test_without_metadata_the_files_themselves_are_read(tmp_path: Path) -> None:
    path = bag(tmp_path / 'bag', entries_of(FLOWN))
    (path / 'metadata.yaml').unlink()
    found = read_bag(path)
    assert same(found) and found.notes == ('metadata.yaml is missing; bag.mcap was read',)
    (path / 'metadata.yaml').write_text('rosbag2_bagfile_information: {version: 9}')
    assert read_bag(path).notes == ('metadata.yaml is not one of rosbag2; bag.mcap was read',)


def test_metadata_that_lies_is_told(tmp_path: Path) -> None:
    path = bag(tmp_path / 'bag', entries_of(FLOWN))
    file, count = path / 'metadata.yaml', len(entries_of(FLOWN))
    file.write_text(file.read_text().replace(f'message_count: {count}\n', 'message_count: 7\n'))
    assert read_bag(path).notes == (f'metadata.yaml counts 7 messages, its files hold {count}',)
    file.write_text(file.read_text().replace('bag.mcap', '../../elsewhere.mcap'))
    (path / 'bag.mcap').unlink()
    with pytest.raises(LogError, match=r'its file elsewhere\.mcap is missing'):
        read_bag(path)


def test_a_file_of_another_bag_is_left_out(tmp_path: Path) -> None:
    path, other = (bag(tmp_path / name, entries_of(FLOWN)) for name in ('bag', 'other'))
    shutil.copy(other / 'other.mcap', path / 'other.mcap')
    found = read_bag(path)
    assert same(found) and found.notes == ('other.mcap is not in metadata.yaml and was left out',)
