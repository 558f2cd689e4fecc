"""What is whole in an unfinished or damaged .mcap file, and a whole bag made of it. The original is never touched."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import TypeAlias

from mcap.records import Attachment, Channel, Header, Message, Metadata, Schema

from advise_ros.recording.mcapfile import McapFile, NotWholeError, WholeChunk, records

Record: TypeAlias = Header | Schema | Channel | Message | Metadata | Attachment


def is_whole(path: str | Path) -> bool:
    """Whether a file was finished: its summary is there and right. Chunks are not looked at.

    Raises:
        OSError: the file cannot be opened.
    """
    with McapFile(path) as file:
        return file.summary() is not None


class Salvage:
    """The records of an .mcap file as mcap's StreamReader gives them, but for what is damaged or cut off.

    A definition that was lost with its chunk is taken from wherever else the file holds it. A context
    manager; memory is bounded by the largest chunk.

        with Salvage('cut.mcap') as salvage:
            for record in salvage.records():
                ...
            print(salvage.losses())

    Attributes:
        file: the file; its `damages` list what was stepped over so far.
        finished: the recording was ended properly (its chunks may be damaged all the same).
        orphans: channel id -> messages that were dropped because their channel or schema was lost.
    """

    def __init__(self, path: str | Path) -> None:
        """Raises OSError when the file cannot be opened."""
        self.path = Path(path)
        self.file = McapFile(path)
        self.orphans: Counter[int] = Counter()
        summary = self.file.summary()
        self.finished = summary is not None
        self._summary = summary or []
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}

    def __enter__(self) -> Salvage:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.file.__exit__(kind, error, trace)

    def records(self) -> Iterator[Record]:
        """In the order of the file; a definition comes before what needs it."""
        for definition in self._summary:
            yield from self._define(definition, checked=True)
        for piece in self.file.walk():
            if isinstance(piece, WholeChunk):
                yield from self._chunk(piece)
            elif isinstance(piece, Schema | Channel):
                yield from self._define(piece, checked=False)
            elif not isinstance(piece, Message) or self._is_known(piece):
                yield piece

    def _chunk(self, chunk: WholeChunk) -> Iterator[Record]:
        try:
            found = records(chunk)
        except NotWholeError as problem:
            self.file.damage(chunk.offset, chunk.n_bytes, str(problem))
            return
        for record in found:
            if not isinstance(record, Message):
                yield from self._define(record, checked=True)
            elif self._is_known(record):
                yield record

    def _define(self, record: Schema | Channel, *, checked: bool) -> Iterator[Schema | Channel]:
        """What stands outside of chunks has no checksum: it only fills in for what was lost."""
        known: dict[int, Schema] | dict[int, Channel] = self._schemas if isinstance(record, Schema) else self._channels
        if record.id not in known or (checked and known[record.id] != record):
            known[record.id] = record  # type: ignore[assignment]
            yield record

    def _is_known(self, message: Message) -> bool:
        channel = self._channels.get(message.channel_id)
        if channel is not None and (channel.schema_id in self._schemas or not channel.schema_id):
            return True
        self.orphans[message.channel_id] += 1
        return False

    @property
    def whole(self) -> bool:
        """Nothing was lost, as far as the walk went, and the file was finished."""
        return self.finished and not self.file.damages and not self.orphans

    def losses(self) -> str:
        """One sentence about what was lost, '' when nothing was."""
        parts = [] if self.finished else ['the recording was not finished']
        parts += _damages(self)
        if self.orphans:
            parts.append(f'{self.orphans.total()} messages are without the definition of their topic')
        return '; '.join(parts)


def _damages(salvage: Salvage) -> list[str]:
    damages = salvage.file.damages
    if not damages:
        return []
    total = sum(damage.n_bytes for damage in damages)
    first = damages[0]
    where = f'at byte {first.offset}: {first.reason}'
    if len(damages) > 1:
        where = f'{len(damages)} places, the first {where}'
    return [f'{total} of {salvage.file.size} bytes are lost ({where})']
