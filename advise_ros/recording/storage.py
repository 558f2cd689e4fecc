"""Bags on the disk, by anyone's hand and in any state, as blocks of messages.

The first bytes of each file say how it is stored: MCAP, sqlite3, ROS 1 or one of these compressed with zstd; metadata.yaml
only says which files there are and how many messages. What is cut off or damaged is stepped over and noted.
"""

from __future__ import annotations

import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import yaml
import zstandard
from mcap.records import Channel as ChannelRecord
from mcap.records import Header, Message, Metadata, Schema

from advise_ros.core.errors import LogError
from advise_ros.recording.bagrecords import Record
from advise_ros.recording.blocks import PREFIX, Block, Channel, Row, from_chunk, from_rows, gather, record_offsets
from advise_ros.recording.filekind import METADATA_FILE, REMEDIES, FileKind, bag_files, kind_of, what_it_is
from advise_ros.recording.mcapfile import MAX_CHUNK_BYTES, NotWholeError, WholeChunk, parse
from advise_ros.recording.progress import ProgressCallback
from advise_ros.recording.recover import Salvage
from advise_ros.recording.ros1 import ros1_blocks
from advise_ros.recording.sqlitefile import SqliteFile, open_sqlite

# Start of the library name in the files of writer.py.
LIBRARY = 'advise_ros'
# Messages that come singly are put together to blocks of this many.
BATCH = 4096
# By libyaml where PyYAML has it: bags with many topics have much metadata, and Python takes twenty times as long.
LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
OPCODES = {3: Schema, 4: ChannelRecord}
# The first bytes of zstd, as a little-endian number.
ZSTD_MARK = 0xFD2FB528
REST_WAS_READ = '; what is whole was read'
NOT_THERE = 'there is no such file; name a bag directory or an .mcap file'


class Source(Protocol):
    """A bag that is read once, from its beginning to its end.

    Attributes:
        topics: topic -> type of every channel met so far.
        records: metadata records met so far.
        notes: what could not be read and what contradicts itself, one sentence each; whole after the last block.
        numbered: the messages of each topic are numbered from 0 on, in the order in which they came: our logger's way.
        whole: nothing is lost so far, and the bag is what its metadata.yaml says.
    """

    topics: dict[str, str]
    records: list[Record]
    notes: list[str]
    numbered: bool
    whole: bool

    def blocks(self, progress: ProgressCallback | None = None) -> Iterator[Block]:
        """All messages; `progress` is called with what is done and what there is in all.

        Raises:
            LogError: the bag cannot be read.
        """


def open_source(path: str | Path) -> BagSource:
    """The bag at a path: a directory of rosbag2, or a file with messages.

    Raises:
        LogError: there is no bag, or it has neither metadata.yaml nor files with messages.
    """
    bag = Path(path)
    if not bag.exists():
        raise LogError(f'{path}: {NOT_THERE}')
    if not bag.is_dir():
        kind = kind_of(bag)
        if kind in (FileKind.TLOG, FileKind.ULOG, FileKind.DATAFLASH, FileKind.DATAFLASH_TEXT):
            raise LogError(f'{path} is {kind.value} and no bag; discretise reads it')
        if kind in REMEDIES:
            raise LogError(what_it_is(path, kind))
        return BagSource(bag, [bag])
    inside = bag_files(bag)
    if not (bag / METADATA_FILE).is_file():
        if not inside:
            raise LogError(f'{path} is not a bag: it has no {METADATA_FILE} and no .mcap or .db3 file; name a bag directory')
        return BagSource(bag, inside, [f'{METADATA_FILE} is missing; {_listed(inside)} was read'])
    try:
        return _described(bag, inside)
    except (yaml.YAMLError, KeyError, TypeError, ValueError, OSError):
        if not inside:
            raise LogError(f'{path}: its {METADATA_FILE} is not one of rosbag2; was it edited or cut off?') from None
        return BagSource(bag, inside, [f'{METADATA_FILE} is not one of rosbag2; {_listed(inside)} was read'])


def _listed(files: list[Path]) -> str:
    return ', '.join(file.name for file in files)


def _described(bag: Path, inside: list[Path]) -> BagSource:
    """The bag that metadata.yaml describes."""
    text = (bag / METADATA_FILE).read_text(encoding='utf-8')
    values = yaml.load(text, Loader=LOADER)['rosbag2_bagfile_information']  # noqa: S506  a safe loader
    named = [_as_it_is(bag / Path(str(name)).name) for name in values['relative_file_paths']]
    files = [file for file in named if file.is_file()]
    notes = [f'{file.name} is missing; copy the whole directory' for file in named if not file.is_file()]
    for file in inside:
        if file in files:
            continue
        if file.name.split('.', 1)[0].rsplit('_', 1)[0] == bag.name:  # The recording ended before metadata.yaml named it.
            files.append(file)
        else:
            notes.append(f'{file.name} is not in {METADATA_FILE} and was left out')
    if not files:
        raise LogError(f'{bag}: its file {_listed(named) or "of messages"} is missing; copy the whole directory')
    return BagSource(bag, files, notes, int(values['message_count']))


def _as_it_is(file: Path) -> Path:
    """The file, or itself unpacked or packed, where somebody did that and left metadata.yaml alone."""
    other = file.with_suffix('') if file.suffix == '.zstd' else file.with_name(f'{file.name}.zstd')
    return other if other.is_file() and not file.is_file() else file


class BagSource:
    """One or more files that follow each other; see Source.

    Attributes:
        path: of the bag.
        files: in their order.
        packed: some messages were compressed one by one.
    """

    def __init__(self, path: Path, files: list[Path], notes: list[str] | None = None, n_expected: int | None = None) -> None:
        """`n_expected`: how many messages metadata.yaml says there are."""
        self.topics: dict[str, str] = {}
        self.records: list[Record] = []
        self.notes = list(notes or ())
        self.numbered = False
        self.path, self.files = path, files
        self._n_expected = n_expected
        self._other_encodings: dict[str, str] = {}
        self._lost = self.packed = False
        self.whole, self._count = not self.notes, 0

    def blocks(self, progress: ProgressCallback | None = None) -> Iterator[Block]:
        for file in self.files:
            try:
                with unpacked(file) as (there, problem):
                    if problem:
                        self.lost(file, problem)
                    for block in self._of_file(file, there, progress):
                        self._count += len(block.starts)
                        plain = uncompressed(block)
                        self.packed = self.packed or plain is not block
                        yield plain
            except LogError:
                self.whole = False
                raise
            except OSError as problem:
                self.whole = False
                raise LogError(f'{file} cannot be read ({problem.strerror or problem})') from None
        others = ', '.join(f'{topic} is {encoding}' for topic, encoding in sorted(self._other_encodings.items()))
        if others and not self.topics:
            raise LogError(f'{self.path}: {others}, not cdr; record with ROS 2, or name another recording')
        if others:
            self.notes.append(f'{others}, not cdr, and was not read')
        if not self._count and not self.records:
            why = '; '.join(self.notes).replace(REST_WAS_READ, '') or 'no messages'
            raise LogError(f'{self.path} holds nothing whole ({why}); name another recording')
        if self._n_expected is not None and self._n_expected != self._count and not self._lost:
            self.whole = False
            self.notes.append(f'{METADATA_FILE} counts {self._n_expected} messages, its files hold {self._count}')

    def _of_file(self, file: Path, there: Path, progress: ProgressCallback | None) -> Iterator[Block]:
        """The blocks of a file, which after unpacking lies somewhere else."""
        kind = kind_of(there)
        if kind is FileKind.SQLITE:
            return self._sqlite(file, there, progress)
        if kind is FileKind.ROS1:
            return ros1_blocks(there, self.topics, lambda problem: self.lost(file, problem), progress)
        if kind is FileKind.EMPTY or kind is FileKind.MCAP or kind not in REMEDIES:
            return self._mcap(file, there, progress)
        self.lost(file, f'it is {kind.value}')
        return iter(())

    def lost(self, file: Path, what: str) -> None:
        """Note that a file is not whole."""
        self.whole, self._lost = False, True
        self.notes.append(f'{file.name}: {what}{REST_WAS_READ}')

    def not_cdr(self, topic: str, encoding: str) -> None:
        """Note that messages of a topic are no ROS 2 messages."""
        self._other_encodings[topic] = encoding or 'of no encoding'

    # -- sqlite3 ---------------------------------------------------------------------------------
    def _sqlite(self, file: Path, there: Path, progress: ProgressCallback | None) -> Iterator[Block]:
        try:
            with open_sqlite(there) as opened:
                channels = self._stored_topics(opened)
                total, done = opened.count, 0
                for rows in opened.rows():
                    known = [row for row in rows if row[0] in channels]
                    done += len(rows)
                    if known:
                        yield from_rows(known, channels)
                    if progress is not None:
                        progress(done, max(total, done))
                for loss in opened.losses:
                    self.lost(file, loss)
        except sqlite3.DatabaseError as problem:
            self.lost(file, str(problem))

    def _stored_topics(self, opened: SqliteFile) -> dict[int, Channel]:
        for topic in opened.topics:
            self.topics[topic.channel.topic] = topic.channel.type_name
            if topic.serialization != 'cdr':
                self.not_cdr(topic.channel.topic, topic.serialization)
        return {topic.number: topic.channel for topic in opened.topics if topic.serialization == 'cdr'}

    # -- MCAP ------------------------------------------------------------------------------------
    def _mcap(self, file: Path, there: Path, progress: ProgressCallback | None) -> Iterator[Block]:
        with Salvage(there) as salvage:
            yield from self._records(salvage, progress)
            if salvage.losses():
                self.lost(file, salvage.losses())

    def _records(self, salvage: Salvage, progress: ProgressCallback | None) -> Iterator[Block]:
        channels = _Channels(self)
        for definition in salvage.file.summary() or ():
            channels.define(definition, checked=True)
        rows: list[Row] = []
        for piece in salvage.file.walk():
            if rows and (len(rows) == BATCH or not isinstance(piece, Message)):
                yield self._known(from_rows(rows, channels.known), salvage, channels)
                rows = []
            if isinstance(piece, Message):
                rows.append((piece.channel_id, piece.sequence, piece.log_time, piece.publish_time, piece.data))
            elif isinstance(piece, WholeChunk):
                try:
                    yield self._known(_block(piece, channels), salvage, channels)
                except (ValueError, NotWholeError) as problem:
                    salvage.file.damage(piece.offset, piece.n_bytes, f'a chunk is damaged: {problem}')
                if progress is not None:
                    progress(piece.offset + piece.n_bytes, salvage.file.size)
            else:
                self._take(piece, channels)
        if rows:
            yield self._known(from_rows(rows, channels.known), salvage, channels)

    def _take(self, piece: Any, channels: _Channels) -> None:
        if isinstance(piece, (Schema, ChannelRecord)):
            channels.define(piece, checked=False)
        elif isinstance(piece, Metadata):
            self.records.append(Record(piece.name, dict(piece.metadata)))
        elif isinstance(piece, Header):
            if piece.profile not in ('ros2', ''):
                raise LogError(f'{self.path} is not a ROS 2 recording (MCAP profile {piece.profile!r})')
            self.numbered = self.numbered or piece.library.startswith(LIBRARY)

    def _known(self, block: Block, salvage: Salvage, channels: _Channels) -> Block:
        """Messages without a channel definition belong to no channel and are reported at the end."""
        for channel_id in {*block.channel_ids.tolist()} - block.channels.keys() - channels.others:
            salvage.orphans[channel_id] += len(block.where(channel_id))
        return block


class _Channels:
    """Definitions of one file, as they come."""

    def __init__(self, source: BagSource) -> None:
        self.known: dict[int, Channel] = {}
        self._schemas: dict[int, Schema] = {}
        self._checked: set[int] = set()
        self._source = source
        # Channels whose messages are not of ROS 2.
        self.others: set[int] = set()

    def define(self, record: Any, *, checked: bool) -> None:
        """What stands outside of chunks has no checksum: it only fills in for what was lost."""
        if isinstance(record, Schema):
            if checked or record.id not in self._schemas:
                self._schemas[record.id] = record
        elif isinstance(record, ChannelRecord) and (checked or record.id not in self.known):
            schema = self._schemas.get(record.schema_id)
            if record.message_encoding != 'cdr':
                self._source.not_cdr(record.topic, record.message_encoding)
                self.others.add(record.id)
                return
            if schema is None:
                return
            text = schema.data.decode('utf-8', 'replace')
            self.known[record.id] = Channel(record.topic, schema.name, schema.encoding, text)
            self._source.topics[record.topic] = schema.name


def _block(chunk: WholeChunk, channels: _Channels) -> Block:
    offsets, others = record_offsets(chunk.data)
    for at in others:
        opcode, length = PREFIX.unpack_from(chunk.data, at)
        if opcode in OPCODES:
            begin = at + PREFIX.size
            channels.define(parse(OPCODES[opcode], chunk.data[begin : begin + length]), checked=True)
    return from_chunk(chunk.data, channels.known, offsets)


@contextmanager
def unpacked(file: Path) -> Iterator[tuple[Path, str]]:
    """The file, or what a file compressed with zstd holds, as far as it can be unpacked; and what is wrong with that."""
    if kind_of(file) is not FileKind.ZSTD:
        yield file, ''
        return
    with tempfile.TemporaryDirectory(prefix='advise_ros_') as directory:
        target, problem = Path(directory) / file.name.removesuffix('.zstd').removesuffix('.zst'), ''
        with file.open('rb') as packed, target.open('wb') as out:
            try:
                zstandard.ZstdDecompressor().copy_stream(packed, out)
            except zstandard.ZstdError as error:
                problem = f'it cannot be unpacked to its end ({error})'
        yield target, problem


def uncompressed(block: Block) -> Block:
    """The block with the messages unpacked that rosbag2 compressed one by one: they begin as zstd does, and no CDR does."""
    packed = gather(block.data, '<u4', block.starts[block.ends - block.starts >= 4])
    if not (packed == ZSTD_MARK).any():
        return block
    unpacker = zstandard.ZstdDecompressor()
    rows: list[Row] = []
    columns = (block.channel_ids, block.sequences, block.log_ns, block.publish_ns, block.starts, block.ends)
    for channel_id, sequence, log_ns, publish_ns, start, end in zip(*(column.tolist() for column in columns), strict=True):
        data = block.data[start:end]
        if data[:4] == ZSTD_MARK.to_bytes(4, 'little'):
            try:
                data = unpacker.decompress(data, max_output_size=MAX_CHUNK_BYTES if zstandard.frame_content_size(data) < 0 else 0)
            except (zstandard.ZstdError, MemoryError):
                data = b''
        rows.append((channel_id, sequence, log_ns, publish_ns, data))
    return from_rows(rows, block.channels)
