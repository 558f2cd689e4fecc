"""Bags in the rosbag2 layout: a directory with `metadata.yaml` and one `.mcap`, definitions embedded."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, BinaryIO

from mcap.writer import CompressionType, Writer
from rosbags.interfaces import Qos
from rosbags.rosbag2.metadata import dump_qos_v9
from ruamel.yaml import YAML

import advise_ros
from advise_ros.core.errors import InputError
from advise_ros.recording.definitions import Definition

METADATA_VERSION = 9
METADATA_FILE = 'metadata.yaml'
COMPRESSIONS = {'zstd': CompressionType.ZSTD, 'lz4': CompressionType.LZ4, 'none': CompressionType.NONE}
NO_MESSAGE_NS = 2**63 - 1


def to_yaml(value: Any) -> str:
    """Block-style YAML, as rosbag2 writes it."""
    yaml = YAML(typ='safe')
    yaml.default_flow_style = False
    yaml.width = 4096
    yaml.representer.ignore_aliases = lambda _: True
    out = StringIO()
    yaml.dump(value, out)
    return out.getvalue().strip() + '\n'


def write_atomically(path: Path, text: str) -> None:
    """Replace a file so that a reader sees either the old text or the new one."""
    temporary = path.with_name(path.name + '.tmp')
    with temporary.open('w', encoding='utf-8') as out:
        out.write(text)
        out.flush()
        os.fsync(out.fileno())
    temporary.replace(path)


@dataclass
class _Channel:
    topic: str
    definition: Definition
    qos: list[Qos]
    count: int = 0


@dataclass
class _Span:
    """Log times seen so far, and how many messages they belong to."""

    first_ns: int = NO_MESSAGE_NS
    last_ns: int = 0
    count: int = 0

    def add(self, log_time_ns: int) -> None:
        self.first_ns = min(self.first_ns, log_time_ns)
        self.last_ns = max(self.last_ns, log_time_ns)
        self.count += 1


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
    chunk_bytes: int = 768 * 1024
    _channels: dict[int, _Channel] = field(default_factory=dict, init=False, repr=False)
    _schemas: dict[str, int] = field(default_factory=dict, init=False, repr=False)
    _span: _Span = field(default_factory=_Span, init=False, repr=False)

    def __post_init__(self) -> None:
        _make(self.directory)
        self._stream: BinaryIO = self._file.open('xb')
        self._mcap = Writer(self._stream, chunk_size=self.chunk_bytes, compression=COMPRESSIONS[self.compression])
        self._mcap.start(profile='ros2', library=f'advise_ros {advise_ros.__version__}')
        self.flush()
        self.write_metadata_file()

    @property
    def _file(self) -> Path:
        return self.directory / f'{self.directory.name}_0.mcap'

    @property
    def counts(self) -> dict[str, int]:
        """Topic -> messages written."""
        return {channel.topic: channel.count for channel in self._channels.values()}

    def add_topic(self, topic: str, definition: Definition, qos: Sequence[Qos] = ()) -> int:
        """Open a channel; returns its id. One channel a topic: call it once for each."""
        if definition.type_name not in self._schemas:
            self._schemas[definition.type_name] = self._mcap.register_schema(
                definition.type_name, 'ros2msg', definition.text.encode()
            )
        channel_id = self._mcap.register_channel(
            topic, 'cdr', self._schemas[definition.type_name],
            {'offered_qos_profiles': to_yaml(dump_qos_v9(list(qos))), 'topic_type_hash': definition.type_hash},
        )
        self._channels[channel_id] = _Channel(topic, definition, list(qos))
        return channel_id

    def write(self, channel_id: int, log_time_ns: int, publish_time_ns: int, data: bytes) -> None:
        """Append one CDR message; the file keeps the order of the calls."""
        channel = self._channels[channel_id]
        self._mcap.add_message(channel_id, log_time_ns, data, publish_time_ns, channel.count)
        channel.count += 1
        self._span.add(log_time_ns)

    def add_record(self, name: str, values: Mapping[str, str]) -> None:
        """Append an MCAP metadata record."""
        self._mcap.add_metadata(name, dict(values))

    def flush(self) -> None:
        """Close the chunk in progress and hand it to the operating system."""
        self._mcap.flush()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Write the index and the final metadata.yaml; the file is closed whatever happens."""
        try:
            self._mcap.add_metadata('rosbag2', {'serialized_metadata': to_yaml(self._information())})
            self._mcap.finish()  # type: ignore[no-untyped-call]
        finally:
            self._abandon()
        self.write_metadata_file()

    def _abandon(self) -> None:
        """Close the file; after a failed write its buffer holds what the disk refused."""
        try:
            self._stream.close()
        except OSError:
            self._stream = BytesIO()

    def write_metadata_file(self) -> None:
        """Bring metadata.yaml up to date."""
        text = to_yaml({'rosbag2_bagfile_information': self._information()})
        write_atomically(self.directory / METADATA_FILE, text)

    def _information(self) -> dict[str, Any]:
        """The contents of metadata.yaml, format version 9."""
        span = self._span
        start = {'nanoseconds_since_epoch': span.first_ns}
        duration = {'nanoseconds': span.last_ns - span.first_ns if span.count else 0}
        name = self._file.name
        return {
            'version': METADATA_VERSION,
            'storage_identifier': 'mcap',
            'duration': duration,
            'starting_time': start,
            'message_count': span.count,
            'topics_with_message_count': [_topic_information(channel) for channel in self._channels.values()],
            'compression_format': '',
            'compression_mode': '',
            'relative_file_paths': [name],
            'files': [{'path': name, 'starting_time': start, 'duration': duration, 'message_count': span.count}],
            'custom_data': {'advise_ros': advise_ros.__version__},
            'ros_distro': os.environ.get('ROS_DISTRO', 'jazzy'),
        }


def _make(directory: Path) -> None:
    if directory.exists():
        raise InputError(f'bag {str(directory)!r} exists already; name a new directory or move the old one away')
    try:
        directory.mkdir(parents=True)
    except OSError as problem:
        raise InputError(
            f'bag {str(directory)!r} cannot be made: {problem.strerror}; name a directory that you may write'
        ) from problem


def _topic_information(channel: _Channel) -> dict[str, Any]:
    return {
        'topic_metadata': {
            'name': channel.topic,
            'type': channel.definition.type_name,
            'serialization_format': 'cdr',
            'offered_qos_profiles': dump_qos_v9(channel.qos),
            'type_description_hash': channel.definition.type_hash,
        },
        'message_count': channel.count,
    }
