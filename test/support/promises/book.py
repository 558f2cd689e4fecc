"""Trials written down as they come: an interrupted run keeps what it has, and a later one goes on from there."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from support.promises.ledger import Row, row


class Measure(NamedTuple):
    """What came of a trial.

    Attributes:
        promise, trouble, figure, limit, note: as in a Row.
        value: of the figure; infinite when it never came.
        timed: the limit is a time, which a busy machine may need more of.
        broken: what went wrong beside the figure, in a sentence.
        count: trials that it stands for.
    """

    promise: str
    trouble: str
    figure: str
    value: float
    limit: float
    timed: bool = True
    broken: str = ''
    note: str = ''
    count: int = 1


class Busy:
    """How much of the machine's time was worked, by whomever."""

    def __init__(self) -> None:
        self._last = self._ticks()

    @staticmethod
    def _ticks() -> tuple[int, int]:
        """Idle and all, summed over the cores."""
        first = Path('/proc/stat').read_text().split('\n')[0]
        ticks = [int(word) for word in first.split()[1:9]]  # user, nice, system, idle, waiting for disks, ...
        return ticks[3] + ticks[4], sum(ticks)

    def share(self) -> float:
        """Since the last call; NaN when no time has passed."""
        (idle_before, all_before), self._last = self._last, self._ticks()
        idle, everything = self._last[0] - idle_before, self._last[1] - all_before
        return 1.0 - idle / everything if everything > 0 else math.nan


class Book:
    """The trials of one part of the promises, on disk line by line.

    Attributes:
        total: trials that are meant.
        done: trials that are over, those of earlier runs too.
    """

    def __init__(self, path: Path, total: int, until_s: float = math.inf) -> None:
        """`until_s` (steady time): no round begins later."""
        self._path, self.total, self._until_s, self._busy = path, total, until_s, Busy()
        self.done = max((line['done'] for line in lines_of(path) if 'done' in line), default=0)

    def rounds(self, of: int = 1) -> Iterator[int]:
        """Numbers of the rounds of `of` trials that are still to be done, while there is time."""
        while self.done < self.total and not self.late:
            yield self.done // of
            self.advance(of)

    @property
    def late(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() >= self._until_s

    def advance(self, trials: int) -> None:
        """So many more are over."""
        self.done = min(self.total, self.done + trials)
        self._write({'done': self.done})

    def add(self, *measures: Measure) -> None:
        """Write down what came of a trial."""
        busy = self._busy.share()
        for measure in measures:
            self._write({**measure._asdict(), 'busy': busy})

    def fail(self, sentence: str) -> None:
        """A trial could not be carried out."""
        self._write({'failed': sentence})

    def _write(self, line: dict[str, Any]) -> None:
        with self._path.open('a') as file:
            file.write(json.dumps(line) + '\n')


def lines_of(path: Path) -> list[dict[str, Any]]:
    """What a book holds; a last line that was cut off is none."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text().split('\n')[:-1]]


def rows_of(promise: str, lines: Iterable[dict[str, Any]]) -> list[Row]:
    """The ledger's rows of a promise, from the lines of its books."""
    measures: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    failed = []
    for line in lines:
        if 'failed' in line:
            failed.append(line['failed'])
        elif 'figure' in line:
            measures.setdefault((line['promise'], line['trouble'], line['figure']), []).append(line)
    rows = [_row(names, found) for names, found in measures.items()]
    if failed:
        names = (promise, 'trials that could not be carried out', 'how many')
        rows.append(Row(*names, len(failed), len(failed), 0.0, tuple(failed)))
    return rows


def _row(names: tuple[str, str, str], found: list[dict[str, Any]]) -> Row:
    first = found[-1]
    values = [line['value'] for line in found]
    broken = tuple(line['broken'] for line in found if line['broken'])
    busy = [line['busy'] for line in found if not math.isnan(line['busy'])]
    return row(names, values, first['limit'], broken, first['note'])._replace(
        timed=first['timed'], trials=sum(line['count'] for line in found),
        busy=sum(busy) / len(busy) if busy else math.nan,
    )
