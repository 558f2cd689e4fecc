"""What came of a promise: a figure, its limit and how often it was tried."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from statistics import median
from typing import Any, NamedTuple

from rich.table import Table

from advise_ros.core.statistics import wilson

HEADS = ('promise', 'trouble', 'figure', 'trials', 'median', 'worst', 'limit', 'broken at most', 'busy', '')


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
        values: of the single trials, where they are known.
        busy: share of the machine's time that was worked meanwhile, by whomever; NaN when it was not measured.
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
    values: tuple[float, ...] = ()
    busy: float = math.nan

    @property
    def kept(self) -> bool:
        return self.trials > 0 and self.worst <= self.limit and not self.broken

    @property
    def broken_at_most(self) -> float:
        """Upper end of the 95 % Wilson interval of the share of trials that break the promise; NaN for a single trial."""
        if len(self.values) < 2:
            return math.nan
        above = sum(not value <= self.limit for value in self.values)
        failures = min(len(self.values), max(above, len(self.broken)))
        return wilson(failures, len(self.values)).high

    def with_slack(self, slack_s: float) -> Row:
        """On a busy machine processes get their turn later than the promise allows for."""
        return self._replace(limit=self.limit + slack_s) if self.timed else self

    def as_mapping(self) -> dict[str, Any]:
        """Everything but the single values."""
        known = {name: value for name, value in self._asdict().items() if name != 'values'}
        middle = median(self.values) if self.values else math.nan
        return {**known, 'median': middle, 'broken_at_most': self.broken_at_most, 'kept': self.kept}

    def cells(self) -> tuple[str, ...]:
        """The row as HEADS names it, without the verdict."""
        return (
            self.promise, self.trouble, self.figure, str(self.trials),
            f'{median(self.values):.3g}' if len(self.values) > 1 else '', f'{self.worst:.3g}', f'{self.limit:g}',
            _percent(self.broken_at_most), _percent(self.busy),
        )


def _percent(share: float) -> str:
    return '' if math.isnan(share) else f'{100.0 * share:.3g} %'


def row(
    names: tuple[str, str, str], values: Sequence[float], limit: float, broken: Iterable[str] = (), note: str = '',
) -> Row:
    """The row of trials whose figures are times; `names`: promise, trouble, figure."""
    worst = max(values, default=math.nan)
    return Row(*names, len(values), worst, limit, tuple(broken), note, timed=True, values=tuple(values))


def table(rows: Sequence[Row]) -> Table:
    """The ledger for a terminal."""
    shown = Table(*HEADS, title='Promises')
    for entry in rows:
        shown.add_row(*entry.cells(), '[green]kept[/]' if entry.kept else '[red]BROKEN[/]')
    return shown


def markdown(rows: Sequence[Row]) -> str:
    """The ledger for docs/safety.md."""
    lines = [f'| {" | ".join(HEADS)} |', '| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |']
    lines += [f'| {" | ".join((*entry.cells(), "kept" if entry.kept else "**broken**"))} |' for entry in rows]
    return '\n'.join(lines) + '\n'
