"""What came of a promise: a figure, its limit and how often it was tried."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from rich.table import Table


class Row(NamedTuple):
    """One promise under one kind of trouble.

    Attributes:
        promise: short name, as in docs/safety.md.
        trouble: what was done.
        figure: what was measured; seconds unless it says otherwise.
        trials: how many.
        worst: of all trials; NaN when there was none.
        limit: the promise: no trial above it.
        broken: what went wrong beside the figure, a sentence each.
        note: what readers should know.
        timed: the limit is a time, which a busy machine may need more of.
    """

    promise: str
    trouble: str
    figure: str
    trials: int
    worst: float
    limit: float
    broken: tuple[str, ...] = ()
    note: str = ''
    timed: bool = False

    @property
    def kept(self) -> bool:
        return self.trials > 0 and self.worst <= self.limit and not self.broken

    def with_slack(self, slack_s: float) -> Row:
        """On a busy machine processes get their turn later than the promise allows for."""
        return self._replace(limit=self.limit + slack_s) if self.timed else self

    def as_mapping(self) -> dict[str, Any]:
        return {**self._asdict(), 'kept': self.kept}


def row(
    names: tuple[str, str, str], values: Sequence[float], limit: float, broken: Iterable[str] = (), note: str = '',
) -> Row:
    """The row of trials whose figures are times; `names`: promise, trouble, figure."""
    worst = max(values, default=math.nan)
    return Row(*names, len(values), worst, limit, tuple(broken), note, timed=True)


def table(rows: Sequence[Row]) -> Table:
    """The ledger for a terminal."""
    shown = Table('promise', 'trouble', 'figure', 'trials', 'worst', 'limit', '', title='Promises')
    for entry in rows:
        verdict = '[green]kept[/]' if entry.kept else '[red]BROKEN[/]'
        shown.add_row(
            entry.promise, entry.trouble, entry.figure, str(entry.trials), f'{entry.worst:.3g}', f'{entry.limit:g}', verdict,
        )
    return shown


def markdown(rows: Sequence[Row]) -> str:
    """The ledger for docs/safety.md."""
    lines = ['| promise | trouble | figure | trials | worst | limit | |', '| --- | --- | --- | ---: | ---: | ---: | --- |']
    for entry in rows:
        verdict = 'kept' if entry.kept else '**broken**'
        cells = (
            entry.promise, entry.trouble, entry.figure, str(entry.trials), f'{entry.worst:.3g}', f'{entry.limit:g}', verdict,
        )
        lines.append(f'| {" | ".join(cells)} |')
    return '\n'.join(lines) + '\n'
