"""Stretches of a bag as arrays: where each message lies in the bytes, without touching them one by one."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

MESSAGE = 5
PREFIX = struct.Struct('<BQ')
# Record prefix, channel id, sequence, log time, publish time: what lies before a message's bytes.
CHANNEL_AT, SEQUENCE_AT, LOG_AT, PUBLISH_AT, DATA_AT = 9, 11, 15, 23, 31
# After this many records of one size in a row, the next ones are guessed to be of that size too.
RUN = 8
FIRST_GUESS = 64

Integers = npt.NDArray[np.int64]


class Channel(NamedTuple):
    """A topic of a bag with the definition of its type ('ros2msg' or 'ros2idl'; '' where the bag has none)."""

    topic: str
    type_name: str
    encoding: str
    definition: str


class Block(NamedTuple):
    """Messages that lie in one piece of memory, in the order of the file.

    Attributes:
        data: the bytes.
        channels: by the ids in `channel_ids`.
        channel_ids, sequences, log_ns, publish_ns: (n,).
        starts, ends: (n,) where the CDR bytes of each message begin and end in `data`.
    """

    data: bytes
    channels: Mapping[int, Channel]
    channel_ids: Integers
    sequences: Integers
    log_ns: Integers
    publish_ns: Integers
    starts: Integers
    ends: Integers

    def where(self, channel_id: int) -> Integers:
        """Indices of one channel's messages."""
        return np.flatnonzero(self.channel_ids == channel_id)


def gather(data: bytes, kind: str, at: Integers) -> npt.NDArray[Any]:
    """Values of a numpy type at byte offsets, aligned or not; every offset must lie inside.

    Args:
        data: bytes.
        kind: numpy type, e.g. '<f8'.
        at: (n,) offsets; all of the value must lie inside.
    """
    size = np.dtype(kind).itemsize
    if not at.size:
        return np.empty(0, dtype=kind)
    return np.ndarray((len(data) - size + 1,), kind, data, strides=(1,))[at]


def record_offsets(data: bytes) -> tuple[Integers, list[int]]:
    """Where the message records in the bytes of a chunk begin, and where the others do.

    Raises:
        ValueError: a record reaches past the end.
    """
    runs: list[Integers] = []
    messages: list[int] = []
    others: list[int] = []
    at, length, run = 0, -1, 0
    while at < len(data):
        before = length
        opcode, length = _prefix(data, at)
        if opcode != MESSAGE:
            others.append(at)
            at, run = at + PREFIX.size + length, 0
            continue
        messages.append(at)
        at += PREFIX.size + length
        run = run + 1 if length == before else 0
        if run >= RUN:
            found = _same(data, at, length)
            runs += [np.array(messages, dtype=np.int64), found]
            messages, at, run = [], at + len(found) * (PREFIX.size + length), 0
    if at > len(data):
        raise ValueError('half a record at the end')
    return np.concatenate([*runs, np.array(messages, dtype=np.int64)]), others


def _prefix(data: bytes, at: int) -> tuple[int, int]:
    if at + PREFIX.size > len(data):
        raise ValueError('half a record at the end')
    return PREFIX.unpack_from(data, at)  # type: ignore[return-value]


def _same(data: bytes, at: int, length: int) -> Integers:
    """Offsets of the message records of this length that follow each other from `at` on."""
    size = PREFIX.size + length
    left, guess, known = (len(data) - at) // size, FIRST_GUESS, 0
    while known < left:
        upto = min(left, known + guess)
        offsets = at + size * np.arange(known, upto, dtype=np.int64)
        wrong = (gather(data, 'u1', offsets) != MESSAGE) | (gather(data, '<u8', offsets + 1) != length)
        if wrong.any():
            known += int(np.argmax(wrong))
            break
        known, guess = upto, guess * 4
    return at + size * np.arange(known, dtype=np.int64)


def from_chunk(data: bytes, channels: Mapping[int, Channel], offsets: Integers) -> Block:
    """The block of message records at these offsets.

    Args:
        data: a chunk's records.
        channels: by their ids.
        offsets: (n,) of its message records.

    Raises:
        ValueError: a record is too short to be a message.
    """
    lengths = gather(data, '<u8', offsets + 1).astype(np.int64)
    if (lengths < DATA_AT - PREFIX.size).any():
        raise ValueError('half a message')
    return Block(
        data, channels,
        gather(data, '<u2', offsets + CHANNEL_AT).astype(np.int64),
        gather(data, '<u4', offsets + SEQUENCE_AT).astype(np.int64),
        gather(data, '<i8', offsets + LOG_AT),
        gather(data, '<i8', offsets + PUBLISH_AT),
        offsets + DATA_AT,
        offsets + PREFIX.size + lengths,
    )


Row = tuple[int, int, int, int, bytes]


def from_rows(rows: Sequence[Row], channels: Mapping[int, Channel]) -> Block:
    """The block of messages that came one by one: channel id, sequence, log time, publish time, bytes."""
    numbers = np.array([row[:4] for row in rows], dtype=np.int64).reshape(-1, 4)
    ends = np.cumsum([len(row[4]) for row in rows], dtype=np.int64)
    starts = ends - np.fromiter((len(row[4]) for row in rows), dtype=np.int64)
    ids, sequences, log_ns, publish_ns = numbers.T
    return Block(b''.join(row[4] for row in rows), channels, ids, sequences, log_ns, publish_ns, starts, ends)
