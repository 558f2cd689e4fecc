"""The messages of a bag file that rosbag2 stored as sqlite3 (.db3), also unfinished, cut off or damaged ones.

The file is never written to: what its recorder left in a write-ahead log is taken up in a copy.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

from advise_ros.recording.blocks import Channel, Row

# Files beside a database that belong to it while it is written.
BESIDE = ('-wal', '-journal')
BATCH = 4096
LAST_ID = 2**62


class StoredTopic(NamedTuple):
    """A row of the table of topics, with the definition of its type, '' where the file has none."""

    number: int
    channel: Channel
    serialization: str


class SqliteFile:
    """An open file; a context manager.

    Attributes:
        topics: that it names.
        losses: one sentence for each part that could not be read so far.
    """

    def __init__(self, connection: sqlite3.Connection) -> None:
        """Raises sqlite3.DatabaseError where even the topics cannot be read."""
        self._connection = connection
        self.losses: list[str] = []
        # A file that is cut off is read as far as it goes.
        connection.execute('PRAGMA writable_schema = ON')
        self.topics = [
            StoredTopic(number, Channel(str(name), str(kind), *definitions.get(kind, ('', ''))), str(serialization))
            for definitions in (self._definitions(),)
            for number, name, kind, serialization in connection.execute('SELECT id, name, type, serialization_format FROM topics')
        ]

    def _definitions(self) -> dict[str, tuple[str, str]]:
        """Type -> encoding and text; bags before Iron have none."""
        wanted = 'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions'
        try:
            return {kind: (str(encoding), str(text)) for kind, encoding, text in self._connection.execute(wanted)}
        except sqlite3.DatabaseError:
            return {}

    def rows(self) -> Iterator[list[Row]]:
        """All messages that can be read, in the order in which they were stored: a batch at a time."""
        first = 0
        while first < LAST_ID:
            try:
                for batch, last in self._from(first):
                    first = last + 1
                    yield batch
            except sqlite3.DatabaseError as problem:
                after = self._next_whole(first)
                self.losses.append(
                    f'{problem} after message {first - 1}' + ('' if after >= LAST_ID else f', up to message {after}')
                )
                first = after
            else:
                return

    def _from(self, first: int) -> Iterator[tuple[list[Row], int]]:
        """Batches of messages with a number from `first` on, each with the last number in it."""
        wanted = 'SELECT id, topic_id, timestamp, data FROM messages WHERE id >= ? ORDER BY id'
        rows: list[Row] = []
        last = first - 1
        try:
            for last, topic, stamp_ns, data in self._connection.execute(wanted, (first,)):
                if not (isinstance(topic, int) and isinstance(stamp_ns, int) and isinstance(data, bytes)):
                    raise sqlite3.DatabaseError('database disk image is malformed')
                rows.append((topic, 0, stamp_ns, stamp_ns, data))
                if len(rows) == BATCH:
                    yield rows, last
                    rows = []
        except sqlite3.DatabaseError:
            if rows:
                yield rows, last
            raise
        if rows:
            yield rows, last

    def _next_whole(self, first: int) -> int:
        """The number from which on messages can be read again, LAST_ID for none."""
        step, wanted = 1, 'SELECT id, data FROM messages WHERE id >= ? ORDER BY id'
        while first + step < LAST_ID:
            try:
                found = self._connection.execute(wanted, (first + step,)).fetchone()
            except sqlite3.DatabaseError:
                found = (0, None)
            if found is None:
                return LAST_ID
            if isinstance(found[1], bytes):
                return int(found[0])
            step *= 2
        return LAST_ID

    @property
    def count(self) -> int:
        """How many messages there are, as far as can be known cheaply: the last number."""
        try:
            return int(self._connection.execute('SELECT max(id) FROM messages').fetchone()[0] or 0)
        except sqlite3.DatabaseError:
            return 0


@contextmanager
def open_sqlite(file: Path) -> Iterator[SqliteFile]:
    """Open a file.

    Raises:
        sqlite3.DatabaseError: it cannot be read.
    """
    beside = [other for ending in BESIDE if (other := file.with_name(file.name + ending)).is_file() and other.stat().st_size]
    with tempfile.TemporaryDirectory(prefix='advise_ros_') as directory:
        address = f'file:{quote(str(file.absolute()))}?mode=ro&immutable=1'
        half_page = _half_page(file)
        if beside or half_page:
            for one in (file, *beside):
                shutil.copy(one, directory)
            if half_page:  # SQLite would take what is missing of it for zeros.
                os.truncate(Path(directory) / file.name, file.stat().st_size - half_page)
            address = f'file:{quote(str(Path(directory) / file.name))}'
        with closing(sqlite3.connect(address, uri=True)) as connection:
            yield SqliteFile(connection)


def _half_page(file: Path) -> int:
    """Bytes of the last page where that is cut off, else 0. https://www.sqlite.org/fileformat2.html"""
    with file.open('rb') as opened:
        size = int.from_bytes(opened.read(18)[16:18], 'big')
    return file.stat().st_size % (65536 if size == 1 else size or 65536)
