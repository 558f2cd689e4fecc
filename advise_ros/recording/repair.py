"""A whole bag made of what is whole in an unfinished or damaged one."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from mcap.records import Attachment, Channel, Message, Metadata, Schema

from advise_ros.core.errors import InputError, LogError
from advise_ros.recording import blocks, metadata
from advise_ros.recording.definitions import known_definition
from advise_ros.recording.filekind import FileKind, kind_of
from advise_ros.recording.mcapwriter import McapWriter
from advise_ros.recording.recover import Record, Salvage
from advise_ros.recording.storage import REST_WAS_READ, BagSource, open_source

# The record in which rosbag2 repeats metadata.yaml; it would not fit the new bag.
ROSBAG2_RECORD = 'rosbag2'


class Recovered(NamedTuple):
    """What became of a bag.

    Attributes:
        target: the whole bag or file that was written; None when nothing was wrong.
        n_messages: that it holds; 0 when nothing was wrong.
        losses: one sentence for each thing that was wrong.
    """

    target: Path | None
    n_messages: int
    losses: tuple[str, ...]


def default_target(bag: Path) -> Path:
    """Beside the original: session1 -> session1_recovered, cut.mcap -> cut_recovered.mcap, old.db3 -> old_recovered.mcap."""
    return bag.with_name(f'{bag.name}_recovered' if bag.is_dir() else f'{bag.name.split(".", 1)[0]}_recovered.mcap')


def recover(bag: str | Path, target: str | Path | None = None) -> Recovered:
    """Write what is whole of a bag into a new one, unless nothing is wrong with it. The original is not touched.

    Messages keep their order and times; what is written is MCAP, whatever the bag was stored as. Whole is what `discretise`
    and `replay` read without a word: one rule for both.

    Args:
        bag: a bag directory, with metadata.yaml or without, or a file of one, stored as MCAP or sqlite3.
        target: must not exist; by default `default_target` of the bag.

    Raises:
        LogError: there is no bag, or nothing in it is whole.
        InputError: the target exists or cannot be written.
    """
    path = Path(bag)
    source = open_source(path)
    try:
        for _ in source.blocks():
            pass
    except LogError:  # Nothing is in it: neither is anything lost of a bag that was ended properly.
        if not source.whole:
            raise
    if source.whole:
        return Recovered(None, 0, ())
    out = Path(target) if target is not None else default_target(path.absolute())
    with _in_the_making(out) as part:
        return _written(path, source, out, part)


@contextmanager
def _in_the_making(out: Path) -> Iterator[Path]:
    """A directory beside the target: what bears the target's name is complete."""
    part = out.with_name(out.name + '.part')
    try:
        if out.exists():
            raise InputError(f'{out} exists already; move it away or name another target (--out)')
        part.mkdir(parents=True)
    except FileExistsError:
        raise InputError(f'{part} exists already; if no other recovery is running, remove it') from None
    except OSError as problem:
        raise InputError(f'{out} cannot be made ({problem.strerror}); name another target (--out)') from None
    try:
        yield part
    except OSError as problem:
        raise InputError(f'{out} cannot be written ({problem.strerror}); name another target (--out)') from None
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _written(path: Path, source: BagSource, out: Path, part: Path) -> Recovered:
    files = source.files
    names = [f'{out.name}_{number}.mcap' for number in range(len(files))] if path.is_dir() else [out.name]
    copies = [_copied(file, part / name, source) for file, name in zip(files, names, strict=True)]
    n_messages = sum(copy.writer.span.count for copy in copies)
    if path.is_dir():
        spans = [(copy.writer.path.name, copy.writer.span) for copy in copies]
        metadata.write(part, metadata.information(spans, _topics(copies)))
        part.rename(out)
    else:
        (part / out.name).rename(out)
    return Recovered(out, n_messages, tuple(note.replace(REST_WAS_READ, '') for note in source.notes))


@dataclass
class Copy:
    """A file being written with the records of another."""

    writer: McapWriter
    _schemas: dict[int, int] = field(default_factory=dict)
    _channels: dict[int, int] = field(default_factory=dict)
    # By the ids of the file being written.
    _types: dict[int, str] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)

    def take(self, record: Record) -> None:
        """Write a record; ids are given anew."""
        if isinstance(record, Message):
            channel_id = self._channels[record.channel_id]
            self.writer.write(channel_id, record.log_time, record.publish_time, record.data, record.sequence)
        elif isinstance(record, Schema):
            schema_id = self.writer.add_schema(record.name, record.encoding, record.data)
            self._schemas[record.id], self._types[schema_id] = schema_id, record.name
        elif isinstance(record, Channel):
            schema_id = self._schemas.get(record.schema_id, 0)
            channel_id = self.writer.add_channel(record.topic, record.message_encoding, schema_id, record.metadata)
            self._channels[record.id], self.channels[channel_id] = channel_id, record
        elif isinstance(record, Metadata) and record.name != ROSBAG2_RECORD:
            self.writer.add_record(record.name, record.metadata)
        elif isinstance(record, Attachment):
            self.writer.add_attachment(record)

    def topics(self) -> Iterator[metadata.Topic]:
        """One for each channel."""
        for channel_id, channel in self.channels.items():
            yield metadata.Topic(
                channel.topic, self._types.get(self._schemas.get(channel.schema_id, 0), ''),
                channel.metadata.get('topic_type_hash', ''),
                metadata.from_yaml(channel.metadata.get('offered_qos_profiles', '')),
                self.writer.counts[channel_id],
            )


def _copied(file: Path, target: Path, source: BagSource) -> Copy:
    """Write what is whole of one file into another.

    Raises:
        OSError: the source cannot be read or the target not be written.
    """
    copy = Copy(McapWriter(target))
    try:
        if kind_of(file) is FileKind.MCAP and not source.packed:
            with Salvage(file) as salvage:
                for record in salvage.records():
                    copy.take(record)
        else:
            for record in _records(BagSource(file, [file])):
                copy.take(record)
    except BaseException:
        copy.writer.abandon()
        raise
    copy.writer.finish()
    return copy


def _records(source: BagSource) -> Iterator[Record]:
    """The messages of a file that is stored in another way, as MCAP has them."""
    known: dict[tuple[str, str], int] = {}
    for block in source.blocks():
        numbers: dict[int, int] = {}
        for channel_id in dict.fromkeys(block.channel_ids.tolist()):
            channel = block.channels[channel_id]
            name = channel.topic, channel.type_name
            if name not in known:
                known[name] = len(known) + 1
                yield from _definitions(known[name], channel)
            numbers[channel_id] = known[name]
        columns = block.channel_ids, block.log_ns, block.publish_ns, block.starts, block.ends
        for channel_id, log_ns, publish_ns, start, end in zip(*(column.tolist() for column in columns), strict=True):
            yield Message(
                channel_id=numbers[channel_id], sequence=0, log_time=log_ns, publish_time=publish_ns, data=block.data[start:end],
            )


def _definitions(number: int, channel: blocks.Channel) -> Iterator[Record]:
    encoding, text = channel.encoding, channel.definition
    if not text:
        encoding, text = known_definition(channel.type_name)
    yield Schema(id=number, name=channel.type_name, encoding=encoding, data=text.encode())
    yield Channel(id=number, topic=channel.topic, message_encoding='cdr', metadata={}, schema_id=number)


def _topics(copies: list[Copy]) -> list[metadata.Topic]:
    """Of all files together."""
    found: dict[str, metadata.Topic] = {}
    for copy in copies:
        for topic in copy.topics():
            before = found.get(topic.name)
            n_messages = topic.n_messages + (before.n_messages if before else 0)
            found[topic.name] = (before or topic)._replace(n_messages=n_messages)
    return list(found.values())
