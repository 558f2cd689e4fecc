"""Files cut off and bytes flipped: what comes out of a recording then, against what went in."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.records import Channel, Message, Metadata
from rosbags.highlevel import AnyReader

from advise_ros.core.errors import LogError
from advise_ros.recording.definitions import definition
from advise_ros.recording.filekind import bag_files
from advise_ros.recording.mcapfile import McapFile, WholeChunk, records
from advise_ros.recording.recover import Salvage
from advise_ros.recording.repair import recover
from advise_ros.recording.writer import BagWriter
from support.promises.ledger import Row, row

POSE, STATUS = 'geometry_msgs/msg/PoseStamped', 'std_msgs/msg/String'
N_MESSAGES, FLUSH_EVERY = 3000, 100
HEAD = b'\0\1\0\0'


class Whole(NamedTuple):
    """A recording before anything happens to it.

    Attributes:
        data: the file.
        messages: (topic, log time, bytes) of each, in order.
        chunks: first byte, last byte + 1 and number of messages of each chunk.
        records: metadata records.
    """

    data: bytes
    messages: list[tuple[str, int, bytes]]
    chunks: list[tuple[int, int, int]]
    records: list[tuple[str, dict[str, str]]]


class Found(NamedTuple):
    """What came out of a damaged one."""

    messages: list[tuple[str, int, bytes]]
    records: list[tuple[str, dict[str, str]]]
    losses: str


def record(folder: Path, rng: np.random.Generator) -> Path:
    """A bag as the logger writes it: two topics, flushed now and then, parameters in between; returns its file."""
    writer = BagWriter(folder / 'bag')
    writer.add_record('platform', {'numpy': '2'})
    poses = writer.add_topic('/pose', definition(POSE))
    words = 0
    walk = np.cumsum(rng.normal(0.0, 0.02, (N_MESSAGES, 10)), axis=0)
    for number, values in enumerate(walk):
        if number == N_MESSAGES // 3:
            words = writer.add_topic('/words', definition(STATUS))
            writer.add_record('parameters /advise', {'seed': '3'})
        if words and number % 10 == 0:
            writer.write(words, number, number, HEAD + (8).to_bytes(4, 'little') + b'flying.\0')
        writer.write(poses, number, number, HEAD + number.to_bytes(8, 'little') + b'\4\0\0\0map\0' + values[:7].tobytes())
        if number % FLUSH_EVERY == FLUSH_EVERY - 1:
            writer.flush()
    writer.close()
    return folder / 'bag' / 'bag_0.mcap'


def whole(file: Path) -> Whole:
    """Everything of a file that nothing has happened to."""
    found = read(file)
    assert not found.losses, found.losses
    with McapFile(file) as mcap:
        chunks = [
            (piece.offset, piece.offset + piece.n_bytes, sum(isinstance(each, Message) for each in records(piece)))
            for piece in mcap.walk() if isinstance(piece, WholeChunk)
        ]
    return Whole(file.read_bytes(), found.messages, chunks, found.records)


def read(file: Path) -> Found:
    """What is whole of a file, in its order."""
    topics: dict[int, str] = {}
    messages, metadata = [], []
    with Salvage(file) as salvage:
        for each in salvage.records():
            if isinstance(each, Channel):
                topics[each.id] = each.topic
            elif isinstance(each, Message):
                messages.append((topics[each.channel_id], each.log_time, each.data))
            elif isinstance(each, Metadata):
                metadata.append((each.name, each.metadata))
        return Found(messages, metadata, salvage.losses())


# -- cut off ---------------------------------------------------------------------------------------
def truncations(folder: Path, rng: np.random.Generator, trials: int) -> list[Row]:
    """Cut at places all over the file; every chunk before the cut must come out, into a bag that others open."""
    file = record(folder, rng)
    before = whole(file)
    missing, broken = [], []
    for size in np.sort(rng.choice(len(before.data), trials, replace=False)):
        file.write_bytes(before.data[:size])
        due = sum(count for _, end, count in before.chunks if end <= size)
        found = read(file).messages
        missing.append(float(due - len(found)))
        if found != before.messages[: len(found)]:
            broken.append(f'cut at byte {size}: what came out is not what went in')
        broken += [f'cut at byte {size}: {sentence}' for sentence in _recovered(file, folder / f'out{size}', len(found))]
    names = ('recording', 'file cut off', 'messages of whole chunks lost')
    return [row(names, missing, 0.0, broken)]


def _recovered(file: Path, target: Path, n_messages: int) -> Iterator[str]:
    """What is wrong with the bag that `recover` makes of it."""
    original = file.read_bytes()
    try:
        recover(file.parent, target)
    except LogError as problem:
        if n_messages:
            yield str(problem)
        return
    if file.read_bytes() != original:
        yield 'the original was changed'
    if n_messages:
        with AnyReader([target]) as reader:
            count = sum(1 for _ in reader.messages())
        if count != n_messages or len(bag_files(target)) != 1:
            yield f'rosbags finds {count} of {n_messages} messages'


# -- flipped ---------------------------------------------------------------------------------------
def flips(folder: Path, rng: np.random.Generator, trials: int) -> list[Row]:
    """One bit of the file flipped: at most the messages of its chunk are lost, none is wrong, and it is told."""
    file = record(folder, rng)
    before = whole(file)
    known = set(before.messages)
    lost, wrong, untold = [], [], 0
    for bit in rng.integers(0, 8 * len(before.data), trials):
        data = bytearray(before.data)
        data[bit // 8] ^= 1 << (bit % 8)
        file.write_bytes(data)
        found = read(file)
        missing = len(before.messages) - len(found.messages)
        hit = next((count for begin, end, count in before.chunks if begin <= bit // 8 < end), 0)
        lost.append(float(missing > hit))
        wrong += [f'bit {bit}: a message that was never recorded' for message in found.messages if message not in known][:1]
        if missing and not found.losses:
            wrong.append(f'bit {bit}: {missing} messages are missing without a word')
        untold += found.records != before.records and not found.losses
    note = f'{untold} flips changed a metadata record (parameters, versions), which MCAP has no checksum for'
    return [row(('recording', 'one bit flipped', 'trials that cost more than its chunk'), lost, 0.0, wrong, note)]
