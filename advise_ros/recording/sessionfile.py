"""The session file: a journal of accepted answers that outlives the learner.

JSON lines: first `{"advise_session": 1, "grid": {...}}` with the keys of a grid file, then one line an
event, in order: `{"advice": {...}, "stamp_ns": n}` for an entry of the advice log, `{"asked": n}` for the
id of a published query. A line counts once it ends with a newline; every append is forced to the disk.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from advise_ros.core.advice.advice import AdviceRecord, Verdict
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.recording import metadata
from advise_ros.recording.gridfile import grid_from_mapping, grid_to_mapping

FORMAT = 1
HEADER_START = b'{"advise_session"'


class LogEntry(NamedTuple):
    """One entry of the advice log and when it was accepted (the node's clock)."""

    record: AdviceRecord
    stamp_ns: int


class Loaded(NamedTuple):
    """What a session file held.

    Attributes:
        entries: the advice log, in order.
        last_query_id: the highest query id that was published or answered, 0 if none.
        dropped: one sentence for each line that could not be used.
    """

    entries: tuple[LogEntry, ...]
    last_query_id: int
    dropped: tuple[str, ...]


class SessionFile:
    """An open session file; one process writes it at a time."""

    def __init__(self, path: str | Path, grid: Grid) -> None:
        """Opens or begins the file. What was torn by a crash is set aside in PATH.damaged.

        Raises:
            InputError: it cannot be opened, is in use, is no session file or belongs to another grid.
        """
        self.path = Path(path)
        self._grid = grid
        self._file = self._open()
        try:
            self.loaded = self._load()
        except BaseException:
            self._file.close()
            raise

    def append_advice(self, record: AdviceRecord, stamp_ns: int) -> None:
        """Write an entry of the advice log; it is on the disk when this returns.

        Args:
            record: entry of the log.
            stamp_ns: when it was accepted.

        Raises:
            AdviseError: it could not be written; the file is as before.
        """
        self._append({'advice': {**asdict(record), 'verdict': record.verdict.name}, 'stamp_ns': stamp_ns})

    def append_asked(self, query_id: int) -> None:
        """Write the id of a query before it is published, so that no later one bears it.

        Raises:
            AdviseError: as append_advice.
        """
        self._append({'asked': query_id})

    def close(self) -> None:
        self._file.close()

    # -- opening -----------------------------------------------------------------------------
    def _open(self) -> BinaryIO:
        try:
            file = open(self.path, 'a+b', buffering=0)  # noqa: SIM115  kept open for the session
        except OSError as problem:
            raise InputError(
                f'session file {self.path}: it cannot be opened ({problem.strerror}); name a file in a folder that exists'
            ) from None
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            file.close()
            raise InputError(
                f'session file {self.path}: another learner is writing it; name another file or stop that one'
            ) from None
        return file

    def _load(self) -> Loaded:
        self._file.seek(0)
        *lines, torn = self._file.read().split(b'\n')
        unended = _is_json(torn)  # Only its newline is missing, as some editors leave it.
        lines += [torn] if unended else []
        if lines:
            self._check_header(lines[0])
        dropped = self._set_aside(torn) if torn and not unended else ()
        if not lines:
            self._append({'advise_session': FORMAT, 'grid': grid_to_mapping(self._grid)})
            with contextlib.suppress(OSError):  # The file's name is to outlive a power failure too, where that can be asked.
                metadata.sync_directory(self.path.absolute().parent)
        if unended:
            self._file.write(b'\n')
        entries, asked, damaged = self._parse(lines[1:])
        last = max([*asked, *(entry.record.query_id for entry in entries)], default=0)
        return Loaded(entries, last, damaged + dropped)

    def _set_aside(self, torn: bytes) -> tuple[str, ...]:
        end = os.fstat(self._file.fileno()).st_size
        if end == len(torn) and not (torn.startswith(HEADER_START) or HEADER_START.startswith(torn)):
            raise self._not_ours()
        aside = self.path.with_name(self.path.name + '.damaged')
        with open(aside, 'ab') as file:
            file.write(torn + b'\n')
        self._file.truncate(end - len(torn))
        return (f'the last line was cut off ({len(torn)} bytes, kept in {aside.name})',)

    def _check_header(self, line: bytes) -> None:
        try:
            header = json.loads(line)
            version, grid = header['advise_session'], grid_from_mapping(header['grid'])
        except (ValueError, KeyError, TypeError, AttributeError, InputError):
            raise self._not_ours() from None
        if version != FORMAT:
            raise InputError(f'session file {self.path}: its format is {version}, this version reads {FORMAT}; name another file')
        if grid != self._grid:
            raise InputError(
                f'session file {self.path}: it belongs to another grid ({_in_words(grid)}; this one: {_in_words(self._grid)}); '
                f"name another session file or that grid's file"
            )

    def _not_ours(self) -> InputError:
        return InputError(f'session file {self.path}: it is not a session file; name a new file or one that advise wrote')

    def _parse(self, lines: list[bytes]) -> tuple[tuple[LogEntry, ...], list[int], tuple[str, ...]]:
        entries: list[LogEntry] = []
        asked: list[int] = []
        dropped: list[str] = []
        for number, line in enumerate(lines, start=2):
            try:
                event = json.loads(line)
                if 'asked' in event:
                    asked.append(_whole(event['asked']))
                else:
                    entries.append(LogEntry(_record_from_json(event['advice'], self._grid), _whole(event['stamp_ns'])))
            except (ValueError, KeyError, TypeError, AttributeError):
                dropped.append(f'line {number} is damaged')
        return tuple(entries), asked, tuple(dropped)

    # -- writing -----------------------------------------------------------------------------
    def _append(self, event: dict[str, Any]) -> None:
        line = json.dumps(event).encode() + b'\n'
        before = os.fstat(self._file.fileno()).st_size
        try:
            if self._file.write(line) != len(line):
                raise OSError(0, 'the disk took only a part')
            os.fsync(self._file.fileno())
        except OSError as problem:
            with contextlib.suppress(OSError):  # A device or a broken disk; what was torn is dropped at the next start.
                self._file.truncate(before)
            raise AdviseError(f'session file {self.path} cannot be written ({problem.strerror})') from None


def _is_json(line: bytes) -> bool:
    try:
        json.loads(line)
    except ValueError:
        return False
    return True


def _in_words(grid: Grid) -> str:
    waypoints = ' '.join(f'[{x}, {y}]' for x, y in (grid.xy(cell) for cell in grid.waypoints))
    return (
        f'{grid.width} x {grid.height} cells of {grid.resolution_m:g} m from {list(grid.origin_enu_m)} '
        f'at {grid.altitude_m:g} m, waypoints {waypoints}, {len(grid.blocked)} blocked'
    )


def _record_from_json(values: dict[str, Any], grid: Grid) -> AdviceRecord:
    record = AdviceRecord(
        advice_id=_whole(values['advice_id']),
        query_id=_whole(values['query_id']),
        states=tuple(_below(state, grid.n_states) for state in values['states']),
        preferred=tuple(_below(action, N_ACTIONS) for action in values['preferred']),
        avoided=tuple(_below(action, N_ACTIONS) for action in values['avoided']),
        verdict=Verdict[values['verdict']],
        expert_id=str(values['expert_id']),
        comment=str(values['comment']),
        retracted=values['retracted'],
    )
    if not isinstance(record.retracted, bool):
        raise TypeError('retracted is not true or false')
    return record


def _whole(value: Any) -> int:
    if type(value) is not int or value < 0:
        raise ValueError(f'{value!r} is not a whole number from 0 on')
    return value


def _below(value: Any, end: int) -> int:
    if _whole(value) >= end:
        raise ValueError(f'{value} is not below {end}')
    return int(value)
