"""Bags on the disk, by anyone's hand and in any state, as blocks of messages.

MCAP files are read as far as they are whole: what is cut off or damaged is stepped over and noted. sqlite3 and what
rosbag2 compressed as a whole go through rosbags.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import yaml
from mcap.records import Channel as ChannelRecord
from mcap.records import Header, Message, Metadata, Schema
from rosbags.highlevel import AnyReader
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.typesys import Stores, get_typestore

from advise_ros.core.errors import LogError
from advise_ros.recording.blocks import PREFIX, Block, Channel, Row, from_chunk, from_rows, record_offsets
from advise_ros.recording.mcapfile import NotWholeError, WholeChunk, parse
from advise_ros.recording.recover import Salvage

METADATA_FILE = 'metadata.yaml'
# Start of the library name in the files of writer.py.
LIBRARY = 'advise_ros'
# Messages that come singly are put together to blocks of this many.
BATCH = 4096
# By libyaml where PyYAML has it: bags with many topics have much metadata, and Python takes twenty times as long.
LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
OPCODES = {3: Schema, 4: ChannelRecord}
ENCODINGS = {MessageDefinitionFormat.MSG: 'ros2msg', MessageDefinitionFormat.IDL: 'ros2idl'}
REST_WAS_READ = '; what is whole was read'
NOT_THERE = 'there is no such file; name a bag directory or an .mcap file'

ProgressCallback = Callable[[int, int], None]


class Record(NamedTuple):
    """An MCAP metadata record."""

    name: str
    values: dict[str, str]


class Source(Protocol):
    """A bag that is read once, from its beginning to its end.

    Attributes:
        topics: topic -> type of every channel met so far.
        records: metadata records met so far.
        notes: what could not be read and what contradicts itself, one sentence each; whole after the last block.
        numbered: the messages of each topic are numbered from 0 on, in the order in which they came: our logger's way.
    """

    topics: dict[str, str]
    records: list[Record]
    notes: list[str]
    numbered: bool

    def blocks(self, progress: ProgressCallback | None = None) -> Iterator[Block]:
        """All messages; `progress` is called with what is done and what there is in all.

        Raises:
            LogError: the bag cannot be read.
        """


def open_source(path: str | Path) -> Source:
    """The bag at a path: a rosbag2 directory or an .mcap file.

    Raises:
        LogError: there is no bag, or it has neither metadata.yaml nor .mcap files.
    """
    bag = Path(path)
    if not bag.exists():
        raise LogError(f'{path}: {NOT_THERE}')
    if bag.suffix == '.tlog':
        raise LogError(f'{path} is a telemetry log and no bag; discretise reads it')
    if not bag.is_dir():
        return McapSource(bag, [bag])
    inside = sorted(bag.glob('*.mcap'), key=file_order)
    if not (bag / METADATA_FILE).is_file():
        if not inside:
            raise LogError(f'{path} is not a bag: it has no {METADATA_FILE} and no .mcap file; name a bag directory')
        return McapSource(bag, inside, [f'{METADATA_FILE} is missing; {_listed(inside)} was read'])
    try:
        return _described(bag, inside)
    except (yaml.YAMLError, KeyError, TypeError, ValueError, OSError):
        if not inside:
            raise LogError(f'{path}: its {METADATA_FILE} is not one of rosbag2; was it edited or cut off?') from None
        return McapSource(bag, inside, [f'{METADATA_FILE} is not one of rosbag2; {_listed(inside)} was read'])


def file_order(file: Path) -> tuple[int, str]:
    """Sorts a bag's files, which are numbered: name_0.mcap, name_1.mcap."""
    tail = file.stem.rsplit('_', 1)[-1]
    return int(tail) if tail.isdecimal() else -1, file.name


def _listed(files: list[Path]) -> str:
    return ', '.join(file.name for file in files)


def _described(bag: Path, inside: list[Path]) -> Source:
    """The bag that metadata.yaml describes."""
    text = (bag / METADATA_FILE).read_text(encoding='utf-8')
    values = yaml.load(text, Loader=LOADER)['rosbag2_bagfile_information']  # noqa: S506  a safe loader
    if str(values['storage_identifier']) != 'mcap' or values.get('compression_mode'):
        return RosbagsSource(bag)
    named = [bag / Path(str(name)).name for name in values['relative_file_paths']]
    files = [file for file in named if file.is_file()]
    notes = [f'{file.name} is missing; copy the whole directory' for file in named if not file.is_file()]
    for file in inside:
        if file in files:
            continue
        if file.stem.rsplit('_', 1)[0] == bag.name:  # The recording ended before metadata.yaml named it.
            files.append(file)
        else:
            notes.append(f'{file.name} is not in {METADATA_FILE} and was left out')
    if not files:
        raise LogError(f'{bag}: its file {_listed(named) or "of messages"} is missing; copy the whole directory')
    return McapSource(bag, files, notes, int(values['message_count']))


class McapSource:
    """One or more .mcap files that follow each other."""

    def __init__(self, path: Path, files: list[Path], notes: list[str] | None = None, n_expected: int | None = None) -> None:
        """`n_expected`: how many messages metadata.yaml says there are."""
        self.topics: dict[str, str] = {}
        self.records: list[Record] = []
        self.notes = list(notes or ())
        self.numbered = False
        self._path, self._files, self._n_expected = path, files, n_expected
        self._finished, self._count = True, 0

    def blocks(self, progress: ProgressCallback | None = None) -> Iterator[Block]:
        for file in self._files:
            try:
                salvage = Salvage(file)
            except OSError as problem:
                raise LogError(f'{file} cannot be read ({problem.strerror})') from None
            with salvage:
                yield from self._of_file(salvage, progress)
                self._note_losses(file, salvage)
        if not self._count and not self.records:
            why = '; '.join(self.notes).replace(REST_WAS_READ, '') or 'no messages'
            raise LogError(f'{self._path} holds nothing whole ({why}); name another recording')
        if self._n_expected is not None and self._n_expected != self._count and self._finished:
            self.notes.append(f'{METADATA_FILE} counts {self._n_expected} messages, its files hold {self._count}')

    def _of_file(self, salvage: Salvage, progress: ProgressCallback | None) -> Iterator[Block]:
        channels = _Channels(self.topics)
        for definition in salvage.file.summary() or ():
            channels.define(definition, checked=True)
        rows: list[Row] = []
        for piece in salvage.file.walk():
            if rows and (len(rows) == BATCH or not isinstance(piece, Message)):
                yield self._known(from_rows(rows, channels.known), salvage)
                rows = []
            if isinstance(piece, Message):
                rows.append((piece.channel_id, piece.sequence, piece.log_time, piece.publish_time, piece.data))
            elif isinstance(piece, WholeChunk):
                try:
                    yield self._known(_block(piece, channels), salvage)
                except (ValueError, NotWholeError) as problem:
                    salvage.file.damage(piece.offset, piece.n_bytes, f'a chunk is damaged: {problem}')
                if progress is not None:
                    progress(piece.offset + piece.n_bytes, salvage.file.size)
            else:
                self._take(piece, channels)
        if rows:
            yield self._known(from_rows(rows, channels.known), salvage)

    def _take(self, piece: Any, channels: _Channels) -> None:
        if isinstance(piece, (Schema, ChannelRecord)):
            channels.define(piece, checked=False)
        elif isinstance(piece, Metadata):
            self.records.append(Record(piece.name, dict(piece.metadata)))
        elif isinstance(piece, Header):
            if piece.profile not in ('ros2', ''):
                raise LogError(f'{self._path} is not a ROS 2 recording (MCAP profile {piece.profile!r})')
            self.numbered = self.numbered or piece.library.startswith(LIBRARY)

    def _known(self, block: Block, salvage: Salvage) -> Block:
        """Count. Messages without a channel definition belong to no channel and are reported at the end."""
        self._count += len(block.starts)
        for channel_id in {*block.channel_ids.tolist()} - block.channels.keys():
            salvage.orphans[channel_id] += len(block.where(channel_id))
        return block

    def _note_losses(self, file: Path, salvage: Salvage) -> None:
        if salvage.losses():
            self._finished = False
            self.notes.append(f'{file.name}: {salvage.losses()}{REST_WAS_READ}')


class _Channels:
    """Definitions of one file, as they come."""

    def __init__(self, topics: dict[str, str]) -> None:
        self.known: dict[int, Channel] = {}
        self._schemas: dict[int, Schema] = {}
        self._checked: set[int] = set()
        self._topics = topics

    def define(self, record: Any, *, checked: bool) -> None:
        """What stands outside of chunks has no checksum: it only fills in for what was lost."""
        if isinstance(record, Schema):
            if checked or record.id not in self._schemas:
                self._schemas[record.id] = record
        elif isinstance(record, ChannelRecord) and (checked or record.id not in self.known):
            schema = self._schemas.get(record.schema_id)
            if schema is None or record.message_encoding != 'cdr':
                return
            text = schema.data.decode('utf-8', 'replace')
            self.known[record.id] = Channel(record.topic, schema.name, schema.encoding, text)
            self._topics[record.topic] = schema.name


def _block(chunk: WholeChunk, channels: _Channels) -> Block:
    offsets, others = record_offsets(chunk.data)
    for at in others:
        opcode, length = PREFIX.unpack_from(chunk.data, at)
        if opcode in OPCODES:
            begin = at + PREFIX.size
            channels.define(parse(OPCODES[opcode], chunk.data[begin : begin + length]), checked=True)
    return from_chunk(chunk.data, channels.known, offsets)


class RosbagsSource:
    """A bag that rosbags reads message by message."""

    def __init__(self, path: Path) -> None:
        self.topics: dict[str, str] = {}
        self.records: list[Record] = []
        self.notes: list[str] = []
        self.numbered = False
        self._path = path

    def blocks(self, progress: ProgressCallback | None = None) -> Iterator[Block]:
        try:
            with AnyReader([self._path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
                yield from self._read(reader, progress)
        except Exception as problem:  # rosbags lets many types through for damaged files
            reason = str(problem).splitlines()[0].rstrip('.') if str(problem) else type(problem).__name__
            raise LogError(f'{self._path} is not a whole bag ({reason}); copy it again, or name another') from problem

    def _read(self, reader: AnyReader, progress: ProgressCallback | None) -> Iterator[Block]:
        channels = {
            number: Channel(c.topic, c.msgtype, ENCODINGS.get(c.msgdef.format, ''), c.msgdef.data)
            for number, c in enumerate(reader.connections)
        }
        self.topics.update({channel.topic: channel.type_name for channel in channels.values()})
        numbers = {(c.owner, c.id): number for number, c in enumerate(reader.connections)}
        total, done = reader.message_count, 0
        rows: list[Row] = []
        for connection, log_ns, data in reader.messages():
            rows.append((numbers[connection.owner, connection.id], 0, log_ns, log_ns, data))
            if len(rows) == BATCH:
                yield from_rows(rows, channels)
                done, rows = done + BATCH, []
                if progress is not None:
                    progress(done, total)
        if rows:
            yield from_rows(rows, channels)
