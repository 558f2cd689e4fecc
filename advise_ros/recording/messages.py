"""Messages and records of MCAP bags, decoded by the definitions that the bag itself holds.

No installed message package is needed. What `bags.py` reads as arrays is not decoded here again.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

from mcap.records import Channel, Header, Metadata, Schema
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader
from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from advise_ros.core.errors import LogError

METADATA_FILE = 'metadata.yaml'
# Start of the library name in the files of writer.py.
LIBRARY = 'advise_ros'
# Longest padding that a serialiser may leave behind a message.
MAX_PADDING = 8


class Message(NamedTuple):
    """One message as it was recorded.

    Attributes:
        data: CDR bytes with their 4 bytes of encapsulation.
        log_time_ns: arrival at the logger, by the logger's clock.
        publish_time_ns: the publisher's wall clock.
    """

    topic: str
    type_name: str
    log_time_ns: int
    publish_time_ns: int
    data: bytes


class Record(NamedTuple):
    """An MCAP metadata record."""

    name: str
    values: dict[str, str]


class Gap(NamedTuple):
    """Messages of a topic that are missing from a bag whose writer numbered them."""

    topic: str
    missing: int
    log_time_ns: int


@cache
def _parsed(type_name: str, encoding: str, text: str) -> Typesdict:
    """Fields by type; parsing takes ten milliseconds a type."""
    return get_types_from_msg(text, type_name) if encoding == 'ros2msg' else get_types_from_idl(text)


class Codec:
    """Decodes and encodes messages by text definitions."""

    def __init__(self) -> None:
        self.store: Typestore = get_typestore(Stores.EMPTY)

    def learn(self, type_name: str, encoding: str, text: str) -> None:
        """Take up a definition: encoding 'ros2msg' or 'ros2idl'."""
        if type_name not in self.store.fielddefs:
            types = _parsed(type_name, encoding, text)
            self.store.register({name: fields for name, fields in types.items() if name not in self.store.fielddefs})

    def knows(self, type_name: str) -> bool:
        return type_name in self.store.fielddefs

    def decode(self, data: bytes, type_name: str) -> Any:
        """The message as an object with the definition's fields.

        Raises:
            LogError: the bytes do not fit the definition.
        """
        for padding in range(0, MAX_PADDING + 1, 4):
            try:
                return self.store.deserialize_cdr(data[: len(data) - padding], type_name)
            except Exception as problem:  # noqa: BLE001  rosbags lets many types through for damaged bytes
                reason = problem
        raise LogError(f'a message of type {type_name} does not fit its definition ({reason})') from reason

    def canonical(self, value: Any, type_name: str) -> bytes:
        """CDR bytes with padding set to zero: equal values give equal bytes."""
        return bytes(self.store.serialize_cdr(value, type_name))


class Bag:
    """The messages of some types and all metadata records of one bag, read in one pass in the order of the file.

    Attributes:
        path: a rosbag2 directory with .mcap files, or an .mcap file.
        topics: topic -> type of every channel.
        codec: knows the wanted types of the bag.
        first_ns, last_ns: log times of all messages; 0 and 0 when there are none.
        count: of all messages.
        gaps: where the numbers of a topic's messages jump; never in bags of other writers than `logger`.

    Raises:
        LogError: the path is no MCAP bag, or it is damaged or cut off.
    """

    def __init__(self, path: str | Path, type_names: Collection[str]) -> None:
        self.path = Path(path)
        self.codec = Codec()
        self.topics: dict[str, str] = {}
        self.messages: list[Message] = []
        self.records: list[Record] = []
        self.first_ns, self.last_ns, self.count = 0, 0, 0
        self.gaps: list[Gap] = []
        self._next: dict[str, int] | None = None
        self._wanted = frozenset(type_names)
        for file in _files(self.path):
            with _one_sentence(self.path):
                self._read(file)

    def _read(self, file: Path) -> None:
        schemas: dict[int, Schema] = {}
        channels: dict[int, Channel] = {}
        with file.open('rb') as stream:
            for record in StreamReader(stream, validate_crcs=True).records:
                if isinstance(record, McapMessage):
                    self._take(record, channels[record.channel_id], schemas)
                elif isinstance(record, Schema):
                    schemas[record.id] = record
                    if record.name in self._wanted:
                        self.codec.learn(record.name, record.encoding, record.data.decode())
                elif isinstance(record, Channel):
                    channels[record.id] = record
                    self.topics[record.topic] = schemas[record.schema_id].name
                elif isinstance(record, Metadata):
                    self.records.append(Record(record.name, dict(record.metadata)))
                elif isinstance(record, Header):
                    self._begin(record)

    def _begin(self, header: Header) -> None:
        if header.profile not in ('ros2', ''):
            raise LogError(f'{self.path} is not a ROS 2 recording (MCAP profile {header.profile!r})')
        if header.library.startswith(LIBRARY) and self._next is None:
            self._next = {}

    def _take(self, record: McapMessage, channel: Channel, schemas: dict[int, Schema]) -> None:
        self.first_ns = min(self.first_ns, record.log_time) if self.count else record.log_time
        self.last_ns = max(self.last_ns, record.log_time)
        self.count += 1
        self._follow(record, channel.topic)
        type_name = schemas[channel.schema_id].name
        if type_name in self._wanted:
            self.messages.append(
                Message(channel.topic, type_name, record.log_time, record.publish_time, bytes(record.data))
            )

    def _follow(self, record: McapMessage, topic: str) -> None:
        """Our writer numbers the messages of each topic from 0 on."""
        if self._next is None:
            return
        due = self._next.get(topic, 0)
        if record.sequence != due:
            self.gaps.append(Gap(topic, record.sequence - due, record.log_time))
        self._next[topic] = record.sequence + 1

    def on(self, topic: str) -> tuple[Message, ...]:
        """Messages of one topic, in the order of the file."""
        return tuple(self._by_topic.get(topic, ()))

    @cached_property
    def _by_topic(self) -> dict[str, list[Message]]:
        found: dict[str, list[Message]] = {}
        for message in self.messages:
            found.setdefault(message.topic, []).append(message)
        return found

    def decode(self, message: Message) -> Any:
        """As Codec.decode; the error names the bag and the topic."""
        try:
            return self.codec.decode(message.data, message.type_name)
        except LogError as problem:
            raise LogError(f'{self.path}, topic {message.topic}: {problem}') from problem


def _files(path: Path) -> list[Path]:
    """The .mcap files of a bag, in order."""
    if not path.exists():
        raise LogError(f'{path}: there is no such file; name a bag directory or an .mcap file')
    if not path.is_dir():
        return [path]
    if not (path / METADATA_FILE).is_file():
        raise LogError(f'{path} is not a bag: it has no {METADATA_FILE}; name a bag directory or an .mcap file')
    try:
        information = YAML(typ='safe').load((path / METADATA_FILE).read_text(encoding='utf-8'))['rosbag2_bagfile_information']
        files = [path / str(name) for name in information['relative_file_paths']]
        storage = str(information['storage_identifier'])
    except (YAMLError, KeyError, TypeError, UnicodeDecodeError, OSError):
        raise LogError(f'{path}: its {METADATA_FILE} is not one of rosbag2; was it edited or cut off?') from None
    if storage != 'mcap':
        raise LogError(f'{path} is stored as {storage!r}; replay reads bags stored as mcap, which the logger writes')
    missing = [file.name for file in files if not file.is_file()]
    if missing:
        raise LogError(f'{path}: its file {missing[0]} is missing; copy the whole directory')
    return files


@contextmanager
def _one_sentence(path: Path) -> Iterator[None]:
    """Turn whatever a damaged file makes the reader raise into a LogError."""
    try:
        yield
    except LogError:
        raise
    except Exception as problem:  # mcap lets struct, zstd, unicode and its own errors through
        reason = str(problem).splitlines()[0].rstrip('.') if str(problem) else type(problem).__name__
        raise LogError(
            f'{path} is not a whole bag ({reason}); if its recording was cut off, the tool `mcap recover` saves what is whole'
        ) from problem
