"""`metadata.yaml` of a bag, as rosbag2 writes it (format version 9)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

import advise_ros
from advise_ros.recording.definitions import EVENT

VERSION = 9
FILE_NAME = 'metadata.yaml'
NO_MESSAGE_NS = 2**63 - 1


@dataclass
class Span:
    """Log times seen so far, and how many messages they belong to."""

    first_ns: int = NO_MESSAGE_NS
    last_ns: int = 0
    count: int = 0

    def add(self, log_time_ns: int) -> None:
        self.first_ns = min(self.first_ns, log_time_ns)
        self.last_ns = max(self.last_ns, log_time_ns)
        self.count += 1

    @property
    def duration_ns(self) -> int:
        return self.last_ns - self.first_ns if self.count else 0


class Topic(NamedTuple):
    """A topic of a bag; `qos` are the offered profiles as rosbag2 maps them."""

    name: str
    type_name: str
    type_hash: str
    qos: Sequence[Any]
    n_messages: int


def to_yaml(value: Any) -> str:
    """Block-style YAML, as rosbag2 writes it."""
    yaml = YAML(typ='safe')
    yaml.default_flow_style = False
    yaml.width = 4096
    yaml.representer.ignore_aliases = lambda _: True
    out = StringIO()
    yaml.dump(value, out)
    return out.getvalue().strip() + '\n'


def from_yaml(text: str) -> list[dict[str, Any]]:
    """The profiles that a channel's metadata hold as YAML; none if they are not what rosbag2 writes."""
    try:
        found = YAML(typ='safe').load(text)
    except (YAMLError, ValueError):
        return []
    return [entry for entry in found if isinstance(entry, dict)] if isinstance(found, list) else []


def information(files: Sequence[tuple[str, Span]], topics: Sequence[Topic]) -> dict[str, Any]:
    """The contents of metadata.yaml of a bag stored as MCAP."""
    spans = [span for _, span in files if span.count]
    whole = Span(
        min((span.first_ns for span in spans), default=NO_MESSAGE_NS),
        max((span.last_ns for span in spans), default=0),
        sum(span.count for span in spans),
    )
    return {
        'version': VERSION,
        'storage_identifier': 'mcap',
        **_times(whole),
        'topics_with_message_count': [_topic(topic) for topic in topics],
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [name for name, _ in files],
        'files': [{'path': name, **_times(span)} for name, span in files],
        'custom_data': {'advise_ros': advise_ros.__version__},
        'ros_distro': os.environ.get('ROS_DISTRO', 'jazzy'),
    }


def write(directory: Path, contents: dict[str, Any]) -> None:
    """Replace a bag's metadata.yaml so that a reader sees either the old one or the new one.

    Raises:
        OSError: the disk is full or gone; the old one stays.
    """
    path = directory / FILE_NAME
    temporary = path.with_name(path.name + '.tmp')
    with temporary.open('w', encoding='utf-8') as out:
        out.write(to_yaml({'rosbag2_bagfile_information': contents}))
        out.flush()
        os.fsync(out.fileno())
    temporary.replace(path)
    sync_directory(directory)


def sync_directory(directory: Path) -> None:
    """Names of new files are on the disk when this returns."""
    handle = os.open(directory, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _times(span: Span) -> dict[str, Any]:
    return {
        'duration': {'nanoseconds': span.duration_ns},
        'starting_time': {'nanoseconds_since_epoch': span.first_ns},
        'message_count': span.count,
    }


def _topic(topic: Topic) -> dict[str, Any]:
    return {
        'topic_metadata': {
            'name': topic.name,
            'type': topic.type_name,
            'serialization_format': 'cdr',
            'offered_qos_profiles': list(topic.qos),
            # rosbags looks for the type of each hash that stands here, and knows those of messages and actions only: a service's
            # event has its hash in the file itself, where rosbag2 looks for it.
            'type_description_hash': '' if topic.type_name.endswith(EVENT) else topic.type_hash,
        },
        'message_count': topic.n_messages,
    }
