"""Messages and records of bags, one by one. What `bags.py` reads as arrays is not decoded here again."""

from __future__ import annotations

from collections.abc import Collection
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from advise_ros.core.errors import LogError
from advise_ros.recording.bagrecords import RECORDS_TOPIC, RECORDS_TYPE, Record, all_records
from advise_ros.recording.blocks import Block, Channel
from advise_ros.recording.codec import Codec
from advise_ros.recording.storage import open_source


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


class Gap(NamedTuple):
    """Messages of a topic that are missing from a bag whose writer numbered them."""

    topic: str
    missing: int
    log_time_ns: int


class Bag:
    """The messages of some types and all metadata records of one bag, read in one pass in the order of the file.

    Attributes:
        path: a rosbag2 directory or an .mcap file; what is damaged or cut off is left out and mentioned in `notes`.
        topics: topic -> type of every channel.
        records: metadata records, and those that stand on RECORDS_TOPIC alone since somebody converted the bag.
        codec: knows the wanted types of the bag.
        first_ns, last_ns: log times of all messages; 0 and 0 when there are none.
        count: of all messages.
        gaps: where the numbers of a topic's messages jump; never in bags of other writers than `logger`.
        notes: what could not be read, one sentence each.

    Raises:
        LogError: the path is no bag, or nothing in it can be read.
    """

    def __init__(self, path: str | Path, type_names: Collection[str]) -> None:
        self.path = Path(path)
        self.codec = Codec()
        self.messages: list[Message] = []
        self.first_ns, self.last_ns, self.count = 0, 0, 0
        self.gaps: list[Gap] = []
        self._next: dict[str, int] = {}
        self._wanted = frozenset(type_names)
        self._record_texts: list[str] = []
        source = open_source(path)
        for block in source.blocks():
            self._take(block, numbered=source.numbered)
        self.topics: dict[str, str] = source.topics
        self.records: list[Record] = all_records(source.records, self._record_texts)
        self.notes: tuple[str, ...] = tuple(source.notes)

    def _take(self, block: Block, *, numbered: bool) -> None:
        if not len(block.log_ns):
            return
        first, last = int(block.log_ns.min()), int(block.log_ns.max())
        self.first_ns = min(self.first_ns, first) if self.count else first
        self.last_ns = max(self.last_ns, last)
        self.count += len(block.log_ns)
        wanted = np.zeros(len(block.log_ns), dtype=np.bool_)
        for number, channel in block.channels.items():
            rows = block.where(number)
            if numbered and rows.size:
                self._follow(block, rows, channel.topic)
            if channel.topic == RECORDS_TOPIC:
                self._record_texts += self._texts(block, rows, channel)
            elif channel.type_name in self._wanted:
                self._learn(channel)
                wanted[rows] = True
        for row in np.flatnonzero(wanted).tolist():
            channel = block.channels[int(block.channel_ids[row])]
            self.messages.append(Message(
                channel.topic, channel.type_name, int(block.log_ns[row]), int(block.publish_ns[row]),
                block.data[int(block.starts[row]) : int(block.ends[row])],
            ))  # fmt: skip

    def _texts(self, block: Block, rows: Any, channel: Channel) -> list[str]:
        self._learn(channel)
        data = [block.data[int(block.starts[row]) : int(block.ends[row])] for row in rows.tolist()]
        return [str(self.codec.decode(one, channel.type_name).data) for one in data] if channel.type_name == RECORDS_TYPE else []

    def _learn(self, channel: Channel) -> None:
        try:
            self.codec.learn(channel.type_name, channel.encoding, channel.definition)
        except Exception as problem:  # rosbags lets its parser's errors through
            raise LogError(f'{self.path}: its definition of {channel.type_name} cannot be read; was it edited?') from problem

    def _follow(self, block: Block, rows: Any, topic: str) -> None:
        """Our writer numbers the messages of each topic from 0 on."""
        numbers = block.sequences[rows]
        due = np.concatenate([[self._next.get(topic, 0)], numbers[:-1] + 1])
        for jump in np.flatnonzero(numbers != due).tolist():
            self.gaps.append(Gap(topic, int(numbers[jump] - due[jump]), int(block.log_ns[rows[jump]])))
        self._next[topic] = int(numbers[-1]) + 1

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
        """As Codec.decode; the error names the bag and the topic.

        Raises:
            LogError: it does not fit its definition; names the bag and the topic.
        """
        try:
            return self.codec.decode(message.data, message.type_name)
        except LogError as problem:
            raise LogError(f'{self.path}, topic {message.topic}: {problem}') from problem
