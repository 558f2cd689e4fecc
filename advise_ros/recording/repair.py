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
from advise_ros.recording import metadata
from advise_ros.recording.mcapwriter import McapWriter
from advise_ros.recording.recover import Record, Salvage
from advise_ros.recording.storage import file_order

# The record in which rosbag2 repeats metadata.yaml; it would not fit the new bag.
ROSBAG2_RECORD = 'rosbag2'


class Recovered(NamedTuple):
    """What became of a bag.

    Attributes:
        target: the whole bag or file that was written; None when nothing was wrong.
        n_messages: that it holds; 0 when nothing was wrong.
        losses: one sentence for each file that something was lost of, after the file's name.
    """

    target: Path | None
    n_messages: int
    losses: tuple[str, ...]


def default_target(bag: Path) -> Path:
    """Beside the original: session1 -> session1_recovered, cut.mcap -> cut_recovered.mcap."""
    return bag.with_name(f'{bag.name}_recovered' if bag.is_dir() else f'{bag.stem}_recovered{bag.suffix}')


def recover(bag: str | Path, target: str | Path | None = None) -> Recovered:
    """Write what is whole of a bag into a new one, unless nothing is wrong with it. The original is not touched.

    Messages keep their order, times and numbers.

    Args:
        bag: a bag directory, with metadata.yaml or without, or an .mcap file.
        target: must not exist; by default `default_target` of the bag.

    Raises:
        LogError: there is no bag, it is not stored as MCAP, or nothing in it is whole.
        InputError: the target exists or cannot be written.
    """
    source = Path(bag)
    files = mcap_files(source)
    has_metadata = not source.is_dir() or (source / metadata.FILE_NAME).is_file()
    try:
        if has_metadata and all(_is_sound(file) for file in files):
            return Recovered(None, 0, ())
    except OSError as problem:
        raise LogError(f'{source} cannot be read ({problem.strerror})') from None
    out = Path(target) if target is not None else default_target(source.absolute())
    with _in_the_making(out) as part:
        return _written(source, files, out, part)


def mcap_files(bag: Path) -> list[Path]:
    """The .mcap files of a bag in their order, whatever its metadata.yaml says.

    Raises:
        LogError: there are none.
    """
    if not bag.exists():
        raise LogError(f'{bag}: there is no such file; name a bag directory or an .mcap file')
    if not bag.is_dir():
        return [bag]
    found = sorted(bag.glob('*.mcap'), key=file_order)
    if found:
        return found
    if any(bag.glob('*.db3')):
        raise LogError(f"{bag} is stored as sqlite3, not as mcap; sqlite3's own command .recover is for such files")
    raise LogError(f'{bag} holds no .mcap file; name a bag directory or an .mcap file')


def _is_sound(file: Path) -> bool:
    with Salvage(file) as salvage:
        for _ in salvage.records():
            pass
        return salvage.whole


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


def _written(source: Path, files: list[Path], out: Path, part: Path) -> Recovered:
    names = [f'{out.name}_{number}.mcap' for number in range(len(files))] if source.is_dir() else [out.name]
    copies = [copied(file, part / name) for file, name in zip(files, names, strict=True)]
    losses = tuple(f'{file.name}: {copy.losses}' for file, copy in zip(files, copies, strict=True) if copy.losses)
    n_messages = sum(copy.writer.span.count for copy in copies)
    if not n_messages and not any(copy.n_records for copy in copies):
        raise LogError(f'{source}: nothing in it is whole ({"; ".join(losses)})')
    if source.is_dir():
        spans = [(copy.writer.path.name, copy.writer.span) for copy in copies]
        metadata.write(part, metadata.information(spans, _topics(copies)))
        part.rename(out)
    else:
        (part / out.name).rename(out)
    return Recovered(out, n_messages, losses)


@dataclass
class Copy:
    """A file being written with the records of another."""

    writer: McapWriter
    losses: str = ''
    n_records: int = 0
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
            self.n_records += 1
            self.writer.add_record(record.name, record.metadata)
        elif isinstance(record, Attachment):
            self.n_records += 1
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


def copied(source: Path, target: Path) -> Copy:
    """Write what is whole of one file into another.

    Raises:
        OSError: the source cannot be read or the target not be written.
    """
    with Salvage(source) as salvage:
        copy = Copy(McapWriter(target))
        try:
            for record in salvage.records():
                copy.take(record)
        except BaseException:
            copy.writer.abandon()
            raise
        copy.writer.finish()
        copy.losses = salvage.losses()
        return copy


def _topics(copies: list[Copy]) -> list[metadata.Topic]:
    """Of all files together."""
    found: dict[str, metadata.Topic] = {}
    for copy in copies:
        for topic in copy.topics():
            before = found.get(topic.name)
            n_messages = topic.n_messages + (before.n_messages if before else 0)
            found[topic.name] = (before or topic)._replace(n_messages=n_messages)
    return list(found.values())
