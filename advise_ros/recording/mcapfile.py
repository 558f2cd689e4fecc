"""The records of an MCAP file, whole or not: what is damaged or cut off is stepped over and reported.

Only chunks carry a checksum of their own. After a record that cannot be one, the walk goes on at the next
chunk, index, metadata or end that fits its own length to the byte (and, for a chunk, its checksum).
See the MCAP specification, https://mcap.dev/spec.
"""

from __future__ import annotations

import mmap
import re
import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, TypeAlias

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, DataEnd, Footer, Header, Message, Metadata, Schema

MAGIC = b'\x89MCAP0\r\n'
# Opcode and length before each record.
PREFIX = struct.Struct('<BQ')
# Start, end, uncompressed size, its CRC, length of the compression's name.
CHUNK_HEAD = struct.Struct('<QQQII')
MESSAGE_HEAD = struct.Struct('<HIQQ')
FOOTER_SIZE = PREFIX.size + 20
# No writer makes larger chunks; a damaged size must not ask for all memory.
MAX_CHUNK_BYTES = 2**30
PARSED = {
    Opcode.HEADER: Header, Opcode.SCHEMA: Schema, Opcode.CHANNEL: Channel, Opcode.ATTACHMENT: Attachment,
    Opcode.METADATA: Metadata, Opcode.DATA_END: DataEnd, Opcode.FOOTER: Footer,
}  # fmt: skip
# Where a walk may go on after damage: never at messages and definitions, for they may lie in a damaged chunk.
LANDMARKS = frozenset((Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.METADATA, Opcode.DATA_END))
LANDMARK = re.compile(b'(?=[%s].{5}\0{3})' % re.escape(bytes(LANDMARKS)), re.DOTALL)


class Damage(NamedTuple):
    """Bytes of a file that no record could be made of."""

    offset: int
    n_bytes: int
    reason: str


class WholeChunk(NamedTuple):
    """A chunk whose checksum is right.

    Attributes:
        offset: of the chunk's record in the file.
        n_bytes: length of that record.
        data: the records in it, uncompressed: schemas, channels and messages.
    """

    offset: int
    n_bytes: int
    data: bytes


Piece: TypeAlias = Header | Schema | Channel | Message | Metadata | Attachment | WholeChunk


class NotWholeError(Exception):
    """A record's bytes do not make that record; the reason is for people."""


class McapFile:
    """An MCAP file, opened to be walked through. A context manager; memory is bounded by the largest chunk.

    Attributes:
        size: of the file when it was opened, in bytes.
        damages: what the walk has stepped over so far.
        ended: the walk came to the end of the data, as a finished file has it.
    """

    def __init__(self, path: str | Path) -> None:
        """Raises OSError when the file cannot be opened."""
        with Path(path).open('rb') as file:
            self.size = file.seek(0, 2)
            # An empty file cannot be mapped.
            self._bytes: mmap.mmap | bytes = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) if self.size else b''
        self.damages: list[Damage] = []
        self.ended = False

    def __enter__(self) -> McapFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if isinstance(self._bytes, mmap.mmap):
            self._bytes.close()

    # -- from the front --------------------------------------------------------------------------
    def walk(self) -> Iterator[Piece]:
        """The whole records of the data section, in order; messages of chunks stay in their chunk."""
        self.damages.clear()
        self.ended = False
        offset = len(MAGIC)
        if self._bytes[:offset] != MAGIC:
            self.damage(0, min(offset, self.size), 'it does not begin as an MCAP file does')
        while offset < self.size and not self.ended:
            try:
                end, piece = self._record(offset)
            except NotWholeError as problem:
                end = self._landmark(offset + 1)
                self.damage(offset, end - offset, str(problem))
            else:
                if piece is not None:
                    yield piece
            offset = end

    def _record(self, offset: int) -> tuple[int, Piece | None]:
        """End of a record, and what it holds if that is of use."""
        opcode, end = self._extent(offset)
        start = offset + PREFIX.size
        if opcode == Opcode.CHUNK:
            return end, WholeChunk(offset, end - offset, self._chunk(start, end))
        if opcode == Opcode.MESSAGE_INDEX:
            if end - start < 6 or end - start - 6 != int.from_bytes(self._bytes[start + 2 : start + 6], 'little'):
                raise NotWholeError('an index is damaged')
            return end, None
        if opcode == Opcode.MESSAGE:
            return end, parse_message(self._bytes[start:end])
        kind = PARSED.get(Opcode(opcode))
        if kind is None:
            return end, None  # Indexes: reading the records makes them needless.
        found = parse(kind, self._bytes[start:end])
        self.ended = isinstance(found, DataEnd | Footer)
        return end, None if self.ended else found

    def _extent(self, offset: int) -> tuple[int, int]:
        """Opcode of the record at an offset, and where it ends."""
        if self.size - offset < PREFIX.size:
            raise NotWholeError('the file is cut off')
        opcode, length = PREFIX.unpack_from(self._bytes, offset)
        if not Opcode.HEADER <= opcode <= Opcode.DATA_END:
            raise NotWholeError('there is no record')
        if length > self.size - offset - PREFIX.size:
            raise NotWholeError('a record is cut off')
        return opcode, offset + PREFIX.size + length

    def _chunk(self, start: int, end: int) -> bytes:
        """The contents of a chunk whose body lies between two offsets."""
        if end - start < CHUNK_HEAD.size + 8:
            raise NotWholeError('a chunk is damaged')
        _, _, size, crc, name_length = CHUNK_HEAD.unpack_from(self._bytes, start)
        data_start = start + CHUNK_HEAD.size + name_length + 8
        if data_start > end or int.from_bytes(self._bytes[data_start - 8 : data_start], 'little') != end - data_start:
            raise NotWholeError('a chunk is damaged')
        compression = self._bytes[start + CHUNK_HEAD.size : data_start - 8]
        data = _uncompressed(compression, self._bytes[data_start:end], size)
        if len(data) != size or (crc and zlib.crc32(data) != crc):
            raise NotWholeError('a chunk is damaged: its checksum is wrong')
        return data

    def _landmark(self, offset: int) -> int:
        """Offset of the next record that can be trusted, else of the end of the file."""
        for match in LANDMARK.finditer(self._bytes, offset):
            try:
                self._record(match.start())
            except NotWholeError:
                continue
            self.ended = False
            return match.start()
        return self.size

    def damage(self, offset: int, n_bytes: int, reason: str) -> None:
        """Note what no use can be made of."""
        self.damages.append(Damage(offset, n_bytes, reason))

    # -- from the back ---------------------------------------------------------------------------
    def summary(self) -> list[Schema | Channel] | None:
        """The schemas and channels that a finished file repeats at its end; None without a whole summary."""
        foot = self.size - len(MAGIC) - FOOTER_SIZE
        try:
            if foot < len(MAGIC) or self._bytes[-len(MAGIC) :] != MAGIC or self._extent(foot)[0] != Opcode.FOOTER:
                return None
            footer = parse(Footer, self._bytes[foot + PREFIX.size : foot + FOOTER_SIZE])
            return self._summary(footer, foot)
        except NotWholeError:
            return None

    def _summary(self, footer: Footer, foot: int) -> list[Schema | Channel] | None:
        start = footer.summary_start or foot
        if start > foot or (footer.summary_crc and zlib.crc32(self._bytes[start : self.size - 12]) != footer.summary_crc):
            return None
        found: list[Schema | Channel] = []
        while start < foot:
            opcode, end = self._extent(start)
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                found.append(parse(PARSED[Opcode(opcode)], self._bytes[start + PREFIX.size : end]))
            start = end
        return found


def records(chunk: WholeChunk) -> list[Schema | Channel | Message]:
    """What a chunk holds.

    Raises:
        NotWholeError: a chunk without a checksum holds something else.
    """
    found: list[Schema | Channel | Message] = []
    offset = 0
    while offset < len(chunk.data):
        if len(chunk.data) - offset < PREFIX.size:
            raise NotWholeError('a chunk holds half a record')
        opcode, length = PREFIX.unpack_from(chunk.data, offset)
        start, offset = offset + PREFIX.size, offset + PREFIX.size + length
        if offset > len(chunk.data):
            raise NotWholeError('a chunk holds half a record')
        body = chunk.data[start:offset]
        if opcode == Opcode.MESSAGE:
            found.append(parse_message(body))
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            found.append(parse(PARSED[Opcode(opcode)], body))
    return found


def parse_message(body: bytes) -> Message:
    """A message record.

    Raises:
        NotWholeError: the bytes are too few.
    """
    if len(body) < MESSAGE_HEAD.size:
        raise NotWholeError('a message is damaged')
    channel_id, sequence, log_time, publish_time = MESSAGE_HEAD.unpack_from(body)
    return Message(
        channel_id=channel_id, sequence=sequence, log_time=log_time, publish_time=publish_time, data=body[MESSAGE_HEAD.size :],
    )


def parse(kind: Any, body: bytes) -> Any:
    """A record of some class of mcap.records, that fills its bytes to the last.

    Raises:
        NotWholeError: it does not.
    """
    stream = ReadDataStream(BytesIO(body))
    try:
        found = kind.read(stream)
    except Exception:  # noqa: BLE001  mcap lets struct, unicode and its own errors through
        found = None
    if found is None or stream.count != len(body):
        raise NotWholeError(f'a record ({kind.__name__}) is damaged')
    return found


def _uncompressed(compression: bytes, data: bytes, size: int) -> bytes:
    if size > MAX_CHUNK_BYTES:
        raise NotWholeError('a chunk is damaged: its size is beyond all bounds')
    try:
        if compression == b'zstd':
            return _unzstd(data, size)
        if compression == b'lz4':
            return lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size)
    except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError) as problem:
        raise NotWholeError('a chunk is damaged: it cannot be uncompressed') from problem
    if compression:
        raise NotWholeError(f'a chunk is damaged or compressed in an unknown way, {compression[:16]!r}')
    return data


def _unzstd(data: bytes, size: int) -> bytes:
    declared = zstandard.frame_content_size(data)
    if declared not in (-1, size):
        raise NotWholeError('a chunk is damaged: its sizes disagree')
    return zstandard.decompress(data, size)
