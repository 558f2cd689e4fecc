"""Unfinished and damaged files: what is whole comes out, what was lost is told, the original stays."""

from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from mcap.reader import make_reader
from mcap.records import Channel, Message
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

from advise_ros.commands.recover import run
from advise_ros.core.errors import InputError, LogError
from advise_ros.recording.bagrecords import RECORDS_TOPIC
from advise_ros.recording.definitions import definition
from advise_ros.recording.mcapfile import McapFile, WholeChunk
from advise_ros.recording.mcapwriter import COMPRESSIONS
from advise_ros.recording.recover import Salvage, is_whole
from advise_ros.recording.repair import recover
from advise_ros.recording.writer import BagWriter
from advise_ros.ros.cdr import to_cdr

INFINITE = QosTime(9223372036, 854775807)
LATCHED = Qos(
    QosHistory.KEEP_LAST, 7, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, INFINITE, INFINITE,
    QosLiveliness.AUTOMATIC, INFINITE, False,
)
POSE = 'geometry_msgs/msg/PoseStamped'
N_MESSAGES, CHUNK_BYTES = 400, 2_000


def write(directory: Path, compression: str = 'zstd') -> Path:
    """Poses numbered by their log times, in chunks of about fifteen; returns the file."""
    writer = BagWriter(directory, compression, CHUNK_BYTES)
    writer.add_record('platform', {'numpy': '2'})
    channel = writer.add_topic('/pose', definition(POSE), [LATCHED])
    message = PoseStamped()
    message.header.frame_id = 'map'
    for number in range(N_MESSAGES):
        message.pose.position.x = number * 0.1
        writer.write(channel, number, number, to_cdr(message))
    writer.close()
    return directory / f'{directory.name}_0.mcap'


def poses(salvage: Salvage) -> list[Message]:
    """Without the message of the bag's record."""
    channels, found = set(), []
    for record in salvage.records():
        if isinstance(record, Channel) and record.topic == '/pose':
            channels.add(record.id)
        elif isinstance(record, Message) and record.channel_id in channels:
            found.append(record)
    return found


def numbers(salvage: Salvage) -> list[int]:
    return [record.log_time for record in poses(salvage)]


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_a_whole_file_gives_all_and_nothing_is_told(tmp_path: Path, compression: str) -> None:
    with Salvage(write(tmp_path / 'bag', compression)) as salvage:
        assert numbers(salvage) == list(range(N_MESSAGES))
        assert salvage.whole and not salvage.losses()


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_a_cut_file_gives_every_chunk_before_the_cut(tmp_path: Path, compression: str) -> None:
    file = write(tmp_path / 'bag', compression)
    data = file.read_bytes()
    kept = []
    for size in np.linspace(0, len(data) - 1, 60).astype(int):
        file.write_bytes(data[:size])
        with Salvage(file) as salvage:
            found = numbers(salvage)
            assert found == list(range(len(found)))
            assert salvage.losses().startswith('the recording was not finished') and not is_whole(file)
        kept.append(len(found))
    assert kept == sorted(kept) and kept[-1] == N_MESSAGES


@pytest.mark.parametrize('content', [b'', b'\x89MCAP0\r\n', b'no bag\n' * 1000, bytes(5000)])
def test_what_is_no_such_file_gives_nothing(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / 'x.mcap'
    file.write_bytes(content)
    with Salvage(file) as salvage:
        assert not list(salvage.records())
        assert not salvage.whole and salvage.losses()


def flipped(data: bytes, bit: int) -> bytes:
    changed = bytearray(data)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_a_flipped_bit_costs_one_chunk_at_most_and_never_gives_a_wrong_message(tmp_path: Path, compression: str) -> None:
    """Anywhere in the file; what comes out is what went in, and what is missing lies side by side."""
    file = write(tmp_path / 'bag', compression)
    data = file.read_bytes()
    with Salvage(file) as salvage:
        whole = poses(salvage)
    rng = np.random.default_rng(1)
    for bit in rng.integers(0, 8 * len(data), 100):
        file.write_bytes(flipped(data, int(bit)))
        with Salvage(file) as salvage:
            found = poses(salvage)
            assert all(message == whole[message.log_time] for message in found)
            missing = sorted(set(range(N_MESSAGES)) - {message.log_time for message in found})
            assert len(missing) <= CHUNK_BYTES // 100
            assert missing == list(range(missing[0], missing[-1] + 1)) if missing else True
            assert not missing or salvage.losses()


def test_a_chunk_that_takes_the_definitions_with_it_costs_no_other_chunk(tmp_path: Path) -> None:
    """In a file that was not finished: no summary repeats them."""
    file = write(tmp_path / 'bag')
    with McapFile(file) as mcap:
        first = next(piece for piece in mcap.walk() if isinstance(piece, WholeChunk))
    data = flipped(file.read_bytes(), 8 * (first.offset + first.n_bytes - 5))
    file.write_bytes(data[: len(data) // 2])
    with Salvage(file) as salvage:
        found = numbers(salvage)
        assert 'damaged' in salvage.losses()
    assert found and found == list(range(found[0], found[-1] + 1)) and found[0] < 30


# -- a whole bag of it -----------------------------------------------------------------------------
def test_a_recovered_bag_is_whole_for_everybody(tmp_path: Path) -> None:
    file = write(tmp_path / 'bag')
    original = file.read_bytes()
    file.write_bytes(original[: len(original) * 2 // 3])
    found = recover(tmp_path / 'bag')
    assert found.target == tmp_path / 'bag_recovered' and len(found.losses) == 1
    assert 'not finished' in found.losses[0] and 'bag_0.mcap' in found.losses[0]
    assert file.read_bytes() == original[: len(original) * 2 // 3]
    with AnyReader([tmp_path / 'bag_recovered']) as reader:
        topic = next(one for one in reader.connections if one.topic == '/pose')
        rows = [(stamp, reader.deserialize(raw, c.msgtype).pose.position.x) for c, stamp, raw in reader.messages([topic])]
        assert topic.digest == definition(POSE).type_hash
        assert topic.ext.offered_qos_profiles == [LATCHED]
        assert [one.topic for one in reader.connections if one is not topic] == [RECORDS_TOPIC]
    n_poses = found.n_messages - 1
    assert rows == [(number, number * 0.1) for number in range(n_poses)] and n_poses > N_MESSAGES // 2
    with (tmp_path / 'bag_recovered' / 'bag_recovered_0.mcap').open('rb') as stream:
        mcap = make_reader(stream, validate_crcs=True)
        assert [message.sequence for _, _, message in mcap.iter_messages(['/pose'])] == list(range(n_poses))
        assert [record.name for record in mcap.iter_metadata()] == ['platform']
    assert recover(tmp_path / 'bag_recovered').target is None


def test_a_whole_bag_is_left_alone_and_one_without_metadata_gets_them(tmp_path: Path) -> None:
    write(tmp_path / 'bag')
    assert recover(tmp_path / 'bag').target is None
    (tmp_path / 'bag' / 'metadata.yaml').unlink()
    found = recover(tmp_path / 'bag')
    assert (found.n_messages, found.losses) == (N_MESSAGES + 1, ('metadata.yaml is missing; bag_0.mcap was read',))
    with AnyReader([found.target]) as reader:
        assert reader.message_count == N_MESSAGES + 1


def test_a_bare_file_becomes_a_bare_file(tmp_path: Path) -> None:
    file = write(tmp_path / 'bag').rename(tmp_path / 'cut.mcap')
    file.write_bytes(file.read_bytes()[:-100])
    found = recover(file)
    assert found.target == tmp_path / 'cut_recovered.mcap' and found.n_messages == N_MESSAGES + 1 and is_whole(found.target)


def test_nothing_is_overwritten_and_nothing_is_left_behind(tmp_path: Path) -> None:
    file = write(tmp_path / 'bag')
    file.write_bytes(file.read_bytes()[:-100])
    (tmp_path / 'bag_recovered').mkdir()
    with pytest.raises(InputError, match='exists already'):
        recover(tmp_path / 'bag')
    (tmp_path / 'file').write_text('')
    with pytest.raises(InputError, match='cannot be made'):
        recover(tmp_path / 'bag', tmp_path / 'file' / 'other')
    file.write_bytes(b'')
    with pytest.raises(LogError, match='holds nothing whole'):
        recover(tmp_path / 'bag', tmp_path / 'other')
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bag', 'bag_recovered', 'file']


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = write(tmp_path / 'bag')
    assert run([str(tmp_path / 'bag')]) == 0 and 'is whole' in capsys.readouterr().out
    file.write_bytes(file.read_bytes()[:-2000])
    assert run([str(tmp_path / 'bag')]) == 0
    assert 'messages are in' in capsys.readouterr().out.splitlines()[-1]
    assert run([str(tmp_path / 'bag')]) == 2 and 'exists already' in capsys.readouterr().err
    file.write_bytes(b'not a bag')
    assert run([str(file)]) == 1 and 'holds nothing whole' in capsys.readouterr().err
    assert run([str(tmp_path / 'nowhere')]) == 2 and 'no such file' in capsys.readouterr().err
