"""Bags by our writer open in everybody's tools, with types, profiles and counts as rosbag2 expects them."""

import json
import resource
from pathlib import Path

import pytest
from geometry_msgs.msg import PoseStamped
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.typesys import Stores, get_typestore
from ruamel.yaml import YAML

from advise_msgs.msg import LearnerStatus
from advise_ros.core.errors import InputError, LogError
from advise_ros.recording import platform
from advise_ros.recording.bagrecords import RECORDS_QOS, RECORDS_TOPIC, Record, all_records
from advise_ros.recording.definitions import definition
from advise_ros.recording.mcapwriter import COMPRESSIONS
from advise_ros.recording.messages import Bag, Codec
from advise_ros.recording.recover import Salvage
from advise_ros.recording.writer import BagWriter
from advise_ros.ros.cdr import to_cdr

INFINITE = QosTime(9223372036, 854775807)
LATCHED = Qos(
    QosHistory.KEEP_LAST, 7, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, INFINITE, INFINITE,
    QosLiveliness.AUTOMATIC, INFINITE, False,
)
POSE, STATUS = 'geometry_msgs/msg/PoseStamped', 'advise_msgs/msg/LearnerStatus'


def pose(x: float) -> bytes:
    message = PoseStamped()
    message.header.frame_id = 'map'
    message.pose.position.x = x
    return to_cdr(message)


def status_bytes(text: str) -> bytes:
    """As it travels: what rclpy serialises outside of a publisher has up to 8 bytes too many."""
    codec = Codec()
    codec.learn(STATUS, 'ros2msg', definition(STATUS).text)
    return codec.canonical(codec.decode(to_cdr(LearnerStatus(message=text)), STATUS), STATUS)


def write(directory: Path, compression: str = 'zstd') -> Path:
    """Twenty poses and one latched status, in chunks of less than a kilobyte."""
    writer = BagWriter(directory, compression, chunk_bytes=500)
    writer.add_record('parameters /advise', {'seed': '3'})
    poses = writer.add_topic('/pose', definition(POSE))
    status = writer.add_topic('/advise/status', definition(STATUS), [LATCHED])
    for index in range(20):
        writer.write(poses, 1_000 + index, 5_000 + index, pose(float(index)))
    writer.write(status, 1_007, 5_020, status_bytes('asking'))
    writer.close()
    return directory


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_rosbags_reads_it(tmp_path: Path, compression: str) -> None:
    with AnyReader([write(tmp_path / 'bag', compression)]) as reader:
        rows = [(c.topic, stamp, reader.deserialize(raw, c.msgtype)) for c, stamp, raw in reader.messages()]
        status = next(c for c in reader.connections if c.topic == '/advise/status')
    assert [value.pose.position.x for topic, _, value in rows if topic == '/pose'] == [float(i) for i in range(20)]
    assert [value.message for topic, _, value in rows if topic == '/advise/status'] == ['asking']
    assert [stamp for topic, stamp, _ in rows if topic != RECORDS_TOPIC] == sorted([*range(1_000, 1_020), 1_007])
    assert status.ext.offered_qos_profiles == [LATCHED]
    assert status.msgcount == 1


def test_mcap_and_its_ros2_support_read_it(tmp_path: Path) -> None:
    with (write(tmp_path / 'bag') / 'bag_0.mcap').open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        rows = [(m.log_time, m.publish_time, m.sequence, value) for _, c, m, value in reader.iter_decoded_messages(['/pose'])]
        records = {record.name: record.metadata for record in reader.iter_metadata()}
        summary = reader.get_summary()
    assert [(log, publish, sequence) for log, publish, sequence, _ in rows] == [(1_000 + i, 5_000 + i, i) for i in range(20)]
    assert [value.pose.position.x for *_, value in rows] == [float(i) for i in range(20)]
    assert records['parameters /advise'] == {'seed': '3'}
    assert summary is not None and summary.statistics is not None and summary.statistics.message_count == 22
    channel = next(c for c in summary.channels.values() if c.topic == '/advise/status')
    assert channel.metadata['topic_type_hash'] == definition(STATUS).type_hash
    assert YAML(typ='safe').load(channel.metadata['offered_qos_profiles'])[0]['durability'] == 'transient_local'


def test_our_reader_keeps_the_order_of_the_file(tmp_path: Path) -> None:
    bag = Bag(write(tmp_path / 'bag'), [POSE, STATUS])
    assert [message.topic for message in bag.messages] == ['/pose'] * 20 + ['/advise/status']
    assert (bag.first_ns, bag.last_ns, bag.count, bag.gaps) == (1_000, 1_019, 22, [])
    assert bag.decode(bag.on('/advise/status')[0]).message == 'asking'
    assert [record.name for record in bag.records] == ['parameters /advise', 'rosbag2']


def test_metadata_is_there_from_the_first_moment_and_right_at_the_end(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / 'bag')
    first = information(tmp_path / 'bag')
    assert (first['message_count'], first['topics_with_message_count']) == (0, [])
    channel = writer.add_topic('/pose', definition(POSE), [LATCHED])
    for stamp_ns in (9_000, 7_000, 12_000):
        writer.write(channel, stamp_ns, stamp_ns, pose(1.0))
    writer.close()
    last = information(tmp_path / 'bag')
    assert last['message_count'] == 3
    assert last['starting_time'] == {'nanoseconds_since_epoch': 7_000}
    assert last['duration'] == {'nanoseconds': 5_000}
    assert last['relative_file_paths'] == ['bag_0.mcap']
    topic = last['topics_with_message_count'][0]
    assert topic['message_count'] == 3
    assert topic['topic_metadata']['type_description_hash'] == definition(POSE).type_hash
    assert topic['topic_metadata']['offered_qos_profiles'][0]['depth'] == 7
    assert not list((tmp_path / 'bag').glob('*.tmp'))


def information(bag: Path) -> dict:
    return YAML(typ='safe').load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']


def test_what_was_flushed_is_in_the_file_before_the_end(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / 'bag')
    channel = writer.add_topic('/pose', definition(POSE))
    writer.write(channel, 1, 1, pose(1.0))
    file = tmp_path / 'bag' / 'bag_0.mcap'
    before = file.stat().st_size
    writer.flush()
    assert file.stat().st_size > before + 100
    with Salvage(file) as salvage:
        assert sum(isinstance(record, Message) for record in salvage.records()) == 1
        assert not salvage.finished
    writer.close()
    assert Bag(tmp_path / 'bag', [POSE]).count == 1


def test_a_split_bag_is_one_bag(tmp_path: Path) -> None:
    """Files that stand on their own, numbered through, each in metadata.yaml with its own times."""
    writer = BagWriter(tmp_path / 'bag')
    channel = writer.add_topic('/pose', definition(POSE), [LATCHED])
    for number in range(10):
        if number in (4, 8):
            writer.split()
        writer.write(channel, number, number, pose(float(number)))
    writer.close()
    told = information(tmp_path / 'bag')
    assert told['relative_file_paths'] == ['bag_0.mcap', 'bag_1.mcap', 'bag_2.mcap']
    files = [(file['message_count'], file['starting_time']['nanoseconds_since_epoch']) for file in told['files']]
    assert files == [(4, 0), (4, 4), (2, 8)]
    assert told['message_count'] == told['topics_with_message_count'][0]['message_count'] == 10
    assert Bag(tmp_path / 'bag', [POSE]).gaps == []
    with AnyReader([tmp_path / 'bag']) as reader:
        assert [reader.deserialize(raw, c.msgtype).pose.position.x for c, _, raw in reader.messages()] == list(range(10))
    with (tmp_path / 'bag' / 'bag_2.mcap').open('rb') as stream:
        assert [message.log_time for _, _, message in make_reader(stream, validate_crcs=True).iter_messages()] == [8, 9]


def test_an_existing_directory_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / 'bag').mkdir()
    with pytest.raises(InputError, match='exists already; name a new directory'):
        BagWriter(tmp_path / 'bag')
    assert not list((tmp_path / 'bag').iterdir())


def test_a_directory_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    with pytest.raises(InputError, match='cannot be made'):
        BagWriter(tmp_path / 'file' / 'bag')


def test_a_full_disk_is_an_os_error_and_what_was_flushed_stays(tmp_path: Path) -> None:
    """A limit on the size of files stands for the disk."""
    writer = BagWriter(tmp_path / 'bag', 'none')
    channel = writer.add_topic('/pose', definition(POSE))
    writer.write(channel, 1, 1, pose(1.0))
    writer.flush()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, ((tmp_path / 'bag' / 'bag_0.mcap').stat().st_size + 10, hard))
    try:
        for index in range(100):
            writer.write(channel, index, index, pose(2.0))
        with pytest.raises(OSError, match='too large'):
            writer.flush()
        with pytest.raises(OSError, match='too large'):
            writer.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    with (tmp_path / 'bag' / 'bag_0.mcap').open('rb') as stream:
        records = StreamReader(stream).records
        assert next(record for record in records if isinstance(record, Message)).log_time == 1
    assert information(tmp_path / 'bag')['message_count'] == 0


# -- definitions -----------------------------------------------------------------------------------
@pytest.mark.parametrize('type_name', [POSE, 'nav_msgs/msg/Odometry', 'sensor_msgs/msg/BatteryState'])
def test_installed_and_shipped_definitions_are_of_one_type(type_name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    installed = definition(type_name)
    monkeypatch.setenv('AMENT_PREFIX_PATH', '')
    definition.cache_clear()
    try:
        shipped = definition(type_name)
    finally:
        definition.cache_clear()
    assert installed.type_hash == shipped.type_hash == get_typestore(Stores.ROS2_JAZZY).hash_rihs01(type_name)


def test_our_messages_bring_all_that_they_are_made_of() -> None:
    text = definition('advise_msgs/msg/Policy').text
    parts = [line.removeprefix('MSG: ') for line in text.splitlines() if line.startswith('MSG: ')]
    assert parts == [
        'std_msgs/Header', 'advise_msgs/GridMap', 'builtin_interfaces/Time', 'nav_msgs/MapMetaData', 'geometry_msgs/Pose',
        'geometry_msgs/Point', 'geometry_msgs/Quaternion',
    ]  # fmt: skip


def test_an_unknown_type_is_one_sentence() -> None:
    with pytest.raises(InputError, match="'foo_msgs/msg/Bar' is not installed"):
        definition('foo_msgs/msg/Bar')


def test_the_platform_names_what_decides_floats() -> None:
    described = platform.describe()
    assert set(described) >= {'advise_ros', 'python', 'machine', 'cpu', 'numpy', 'scipy', 'highspy', 'scikit-learn'}
    assert all(described[name] for name in ('advise_ros', 'python', 'machine', 'numpy'))


def test_a_record_is_there_as_a_latched_message_too_for_who_converts_the_bag(tmp_path: Path) -> None:
    with AnyReader([write(tmp_path / 'bag')]) as reader:
        (connection,) = [one for one in reader.connections if one.topic == RECORDS_TOPIC]
        (message,) = reader.messages([connection])
        assert connection.ext.offered_qos_profiles == [RECORDS_QOS]
        text = reader.deserialize(message[2], connection.msgtype).data
    assert json.loads(text) == {'name': 'parameters /advise', 'values': {'seed': '3'}}


def test_records_of_the_files_alone_and_of_messages_alone_are_the_same(tmp_path: Path) -> None:
    record = Record('parameters /advise', {'seed': '3'})
    text = json.dumps(record._asdict())
    assert all_records([record], [text]) == all_records([record], []) == all_records([], [text]) == [record]
    with pytest.raises(LogError, match='no record of a bag'):
        all_records([], ['{"name": 3}'])


def test_a_record_after_the_last_message_is_kept_and_one_without_any_message_begins_no_topic(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / 'late')
    writer.write(writer.add_topic('/pose', definition(POSE)), 5, 5, pose(1.0))
    writer.split()
    writer.add_record('parameters /policy', {'speed': '2'})
    writer.close()
    assert Bag(tmp_path / 'late', [POSE]).count == 2 and writer.counts == {'/pose': 1}
    writer = BagWriter(tmp_path / 'empty')
    writer.add_record('platform', {})
    writer.close()
    assert Bag(tmp_path / 'empty', [POSE]).topics == {}
