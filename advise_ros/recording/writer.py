"""Bags in the rosbag2 layout: a directory with `metadata.yaml` and .mcap files, definitions embedded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rosbags.interfaces import Qos
from rosbags.rosbag2.metadata import dump_qos_v9

from advise_ros.core.errors import InputError
from advise_ros.recording import metadata
from advise_ros.recording.bagrecords import RECORDS_QOS, RECORDS_TOPIC, RECORDS_TYPE, record_to_cdr
from advise_ros.recording.definitions import Definition, definition
from advise_ros.recording.mcapwriter import DEFAULT_CHUNK_BYTES, McapWriter


@dataclass
class _Topic:
    name: str
    definition: Definition
    qos: list[Qos]
    count: int = 0
    # In the file being written; None before its first message there.
    channel_id: int | None = None


@dataclass
class BagWriter:
    """Writes serialised messages into a new bag; `metadata.yaml` is there from the first moment on.

    Every call may raise OSError when the disk is full; what was flushed before stays readable.

    Attributes:
        directory: the bag; it must not exist.
        compression: 'zstd', 'lz4' or 'none', for chunks.
        chunk_bytes: a chunk is closed when it is larger than this.

    Raises:
        InputError: the directory exists or cannot be made.
    """

    directory: Path
    compression: str = 'zstd'
    chunk_bytes: int = DEFAULT_CHUNK_BYTES
    _topics: list[_Topic] = field(default_factory=list, init=False, repr=False)
    _schemas: dict[str, int] = field(default_factory=dict, init=False, repr=False)
    _files: list[McapWriter] = field(default_factory=list, init=False, repr=False)
    # Records that are to be written as messages, too: with the time of the next message, since they have none of their own.
    _pending: list[bytes] = field(default_factory=list, init=False, repr=False)
    _records: int = field(default=0, init=False, repr=False)

    def __post_init__(self) -> None:
        _make(self.directory)
        self._open_file()

    @property
    def counts(self) -> dict[str, int]:
        """Topic -> messages written; without the records."""
        return {topic.name: topic.count for topic in self._topics if topic.name != RECORDS_TOPIC}

    @property
    def size(self) -> int:
        """Bytes in the file being written; the chunk in progress comes on top."""
        return self._files[-1].size

    @property
    def duration_ns(self) -> int:
        """Between the log times of the file being written."""
        return self._files[-1].span.duration_ns

    def add_topic(self, topic: str, definition: Definition, qos: Sequence[Qos] = ()) -> int:
        """Name a topic; returns its number for `write`, from 1 on. Call it once for each."""
        self._topics.append(_Topic(topic, definition, list(qos)))
        self._open_channel(self._topics[-1])
        return len(self._topics)

    def write(self, topic: int, log_time_ns: int, publish_time_ns: int, data: bytes) -> None:
        """Append one CDR message; the bag keeps the order of the calls.

        Args:
            topic: of `add_topic`.
            log_time_ns: of the recording.
            publish_time_ns: of the publisher.
            data: CDR bytes.
        """
        if self._pending:
            self._write_pending(log_time_ns)
        self._append(topic, log_time_ns, publish_time_ns, data)

    def add_record(self, name: str, values: Mapping[str, str]) -> None:
        """Append an MCAP metadata record, and the same as a message on RECORDS_TOPIC."""
        self._files[-1].add_record(name, values)
        self._pending.append(record_to_cdr(name, values))

    def _write_pending(self, log_time_ns: int) -> None:
        if not self._records:
            self._records = self.add_topic(RECORDS_TOPIC, definition(RECORDS_TYPE), [RECORDS_QOS])
        for data in self._pending:
            self._append(self._records, log_time_ns, log_time_ns, data)
        self._pending.clear()

    def _append(self, topic: int, log_time_ns: int, publish_time_ns: int, data: bytes) -> None:
        entry = self._topics[topic - 1]
        channel_id = entry.channel_id or self._open_channel(entry)
        self._files[-1].write(channel_id, log_time_ns, publish_time_ns, data, entry.count)
        entry.count += 1

    def flush(self) -> None:
        """Hand what was written to the operating system: it outlives this process."""
        self._files[-1].flush()

    @property
    def fileno(self) -> int:
        """Of the file being written."""
        return self._files[-1].fileno

    def split(self) -> None:
        """Finish the file being written and go on in the next one."""
        self._files[-1].finish()
        self._open_file()

    def close(self) -> None:
        """Write the index and the final metadata.yaml; the file is closed whatever happens."""
        last = self._files[-1]
        try:
            if self._pending and any(file.span.count for file in self._files):
                self._write_pending(max(file.span.last_ns for file in self._files))
            last.add_record('rosbag2', {'serialized_metadata': metadata.to_yaml(self._information())})
        except OSError:
            last.abandon()
            raise
        last.finish()
        self.write_metadata_file()

    def abandon(self) -> None:
        """Close the file as it is, when the disk has refused to take more."""
        self._files[-1].abandon()

    def write_metadata_file(self) -> None:
        """Bring metadata.yaml up to date."""
        metadata.write(self.directory, self._information())

    def _open_file(self) -> None:
        path = self.directory / f'{self.directory.name}_{len(self._files)}.mcap'
        self._files.append(McapWriter(path, self.compression, self.chunk_bytes))
        self._schemas.clear()
        for topic in self._topics:
            topic.channel_id = None
        self.write_metadata_file()

    def _open_channel(self, topic: _Topic) -> int:
        file, definition = self._files[-1], topic.definition
        if definition.type_name not in self._schemas:
            self._schemas[definition.type_name] = file.add_schema(definition.type_name, 'ros2msg', definition.text.encode())
        qos = metadata.to_yaml(dump_qos_v9(topic.qos))
        topic.channel_id = file.add_channel(
            topic.name, 'cdr', self._schemas[definition.type_name],
            {'offered_qos_profiles': qos, 'topic_type_hash': definition.type_hash},
        )
        return topic.channel_id

    def _information(self) -> dict[str, Any]:
        files = [(file.path.name, file.span) for file in self._files]
        topics = [
            metadata.Topic(t.name, t.definition.type_name, t.definition.type_hash, dump_qos_v9(t.qos), t.count)
            for t in self._topics
        ]
        return metadata.information(files, topics)


def _make(directory: Path) -> None:
    if directory.exists():
        raise InputError(f'bag {str(directory)!r} exists already; name a new directory or move the old one away')
    try:
        directory.mkdir(parents=True)
    except OSError as problem:
        raise InputError(
            f'bag {str(directory)!r} cannot be made: {problem.strerror}; name a directory that you may write'
        ) from problem
