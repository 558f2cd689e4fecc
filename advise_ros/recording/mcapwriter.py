"""One .mcap file in the making."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import RecordBuilder
from mcap.records import Attachment, Channel, Schema
from mcap.writer import CompressionType, Writer

import advise_ros
from advise_ros.recording.metadata import Span

COMPRESSIONS = {'zstd': CompressionType.ZSTD, 'lz4': CompressionType.LZ4, 'none': CompressionType.NONE}
DEFAULT_CHUNK_BYTES = 768 * 1024


class McapWriter:
    """Writes a new file through mcap's writer, and each definition a second time outside of the chunks.

    A chunk that is damaged thus takes no other chunk's definitions with it, and a definition, which has no
    checksum outside of chunks, is there in one that has. Every call may raise OSError when the disk is full;
    what was flushed before stays readable.

    Attributes:
        span: log times of what was written.
        counts: channel id -> messages.
    """

    def __init__(self, path: Path, compression: str = 'zstd', chunk_bytes: int = DEFAULT_CHUNK_BYTES) -> None:
        """Raises OSError, as FileExistsError when the file is there already."""
        self.path = path
        self.span = Span()
        self.counts: Counter[int] = Counter()
        self._stream: BinaryIO = path.open('xb')
        self._mcap = Writer(self._stream, chunk_size=chunk_bytes, compression=COMPRESSIONS[compression])
        self._mcap.start(profile='ros2', library=f'advise_ros {advise_ros.__version__}')
        self.flush()

    @property
    def size(self) -> int:
        """Bytes in the file so far; the chunk in progress comes on top."""
        return self._stream.tell()

    @property
    def fileno(self) -> int:
        """What was flushed outlives the machine's power once this is synced."""
        return self._stream.fileno()

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Returns the schema's id."""
        schema_id = self._mcap.register_schema(name, encoding, data)
        self._append(Schema(id=schema_id, name=name, encoding=encoding, data=data))
        return schema_id

    def add_channel(self, topic: str, encoding: str, schema_id: int, metadata: Mapping[str, str]) -> int:
        """Returns the channel's id."""
        channel_id = self._mcap.register_channel(topic, encoding, schema_id, dict(metadata))
        self._append(Channel(
            id=channel_id, topic=topic, message_encoding=encoding, schema_id=schema_id, metadata=dict(metadata),
        ))
        return channel_id

    def write(self, channel_id: int, log_time_ns: int, publish_time_ns: int, data: bytes, sequence: int) -> None:
        """Append one message; the file keeps the order of the calls.

        Args:
            channel_id: of `add_channel`.
            log_time_ns: of the recording.
            publish_time_ns: of the publisher.
            data: CDR bytes.
            sequence: counts the messages of the channel.
        """
        self._mcap.add_message(channel_id, log_time_ns, data, publish_time_ns, sequence)
        self.counts[channel_id] += 1
        self.span.add(log_time_ns)

    def add_record(self, name: str, values: Mapping[str, str]) -> None:
        """Append an MCAP metadata record."""
        self._mcap.add_metadata(name, dict(values))

    def add_attachment(self, record: Attachment) -> None:
        """Append an attachment as it stands."""
        self._mcap.add_attachment(record.create_time, record.log_time, record.name, record.media_type, record.data)

    def flush(self) -> None:
        """Close the chunk in progress and hand it to the operating system: it outlives this process."""
        self._mcap.flush()  # type: ignore[no-untyped-call]

    def finish(self) -> None:
        """Write the index and close the file; it is closed whatever happens."""
        try:
            self._mcap.finish()  # type: ignore[no-untyped-call]
            self._stream.flush()
            os.fsync(self.fileno)
        finally:
            self.abandon()

    def abandon(self) -> None:
        """Close the file as it is; after a failed write its buffer holds what the disk refused."""
        try:
            self._stream.close()
        except OSError:
            self._stream = BytesIO()

    def _append(self, record: Schema | Channel) -> None:
        builder = RecordBuilder()
        record.write(builder)
        self._stream.write(builder.end())  # type: ignore[no-untyped-call]
