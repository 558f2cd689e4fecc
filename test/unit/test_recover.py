"""Unfinished and damaged files: what is whole comes out, what was lost is told, the original stays."""

from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from mcap.records import Message

from advise_ros.recording.definitions import definition
from advise_ros.recording.recover import Salvage, is_whole
from advise_ros.recording.writer import COMPRESSIONS, BagWriter
from advise_ros.ros.cdr import to_cdr

POSE = 'geometry_msgs/msg/PoseStamped'
N_MESSAGES, CHUNK_BYTES = 400, 2_000


def write(directory: Path, compression: str = 'zstd') -> Path:
    """Poses numbered by their log times, in chunks of about fifteen; returns the file."""
    writer = BagWriter(directory, compression, CHUNK_BYTES)
    channel = writer.add_topic('/pose', definition(POSE))
    message = PoseStamped()
    message.header.frame_id = 'map'
    for number in range(N_MESSAGES):
        message.pose.position.x = number * 0.1
        writer.write(channel, number, number, to_cdr(message))
    writer.close()
    return directory / f'{directory.name}_0.mcap'


def numbers(salvage: Salvage) -> list[int]:
    return [record.log_time for record in salvage.records() if isinstance(record, Message)]


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_a_whole_file_gives_all_and_nothing_is_told(tmp_path: Path, compression: str) -> None:
    with Salvage(write(tmp_path / 'bag', compression)) as salvage:
        assert numbers(salvage) == list(range(N_MESSAGES))
        assert salvage.whole and not salvage.told()


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
            assert salvage.told().startswith('the recording was not finished') and not is_whole(file)
        kept.append(len(found))
    assert kept == sorted(kept) and kept[-1] == N_MESSAGES


@pytest.mark.parametrize('content', [b'', b'\x89MCAP0\r\n', b'no bag\n' * 1000, bytes(5000)])
def test_what_is_no_such_file_gives_nothing(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / 'x.mcap'
    file.write_bytes(content)
    with Salvage(file) as salvage:
        assert not list(salvage.records())
        assert not salvage.whole and salvage.told()
