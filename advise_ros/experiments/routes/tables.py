"""Which trials the tables of the page consist of, and their lines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from advise_ros.core.statistics import share_in_words
from advise_ros.experiments.figures import Trials
from advise_ros.experiments.routes import two
from advise_ros.experiments.routes.cases import RouteCase
from advise_ros.experiments.routes.ways import SECOND_WAYS, WAYS
from advise_ros.experiments.routes.work import AGREEMENT, RouteTask, outcomes
from advise_ros.experiments.sites import SIZES
from advise_ros.experiments.store import Store

# Answers after which success is shown, beside the end.
POINTS = (0, 1, 2, 4)
# Sites with more cells have half the trials, and are left out of what takes hours there.
LARGE = ('20x20-8', '30x30-10')
SMALL = tuple(size for size in SIZES if size not in LARGE)
# A learner that stops so many answers before or after its best point stops in time.
IN_TIME = 1


class Line(NamedTuple):
    """What a case is called in its table."""

    label: str
    case: RouteCase


class RouteTable(NamedTuple):
    """One table.

    Attributes:
        about: what it shows.
        lines: cases.
        ways: compared in each case.
    """

    about: str
    lines: tuple[Line, ...]
    ways: tuple[str, ...]

    def only(self, sizes: Sequence[str], ways: Sequence[str]) -> RouteTable:
        """The part of it with these sizes and ways."""
        lines = tuple(line for line in self.lines if line.case.size in sizes)
        return self._replace(lines=lines, ways=tuple(way for way in self.ways if way in ways))

    def ways_of(self, case: RouteCase) -> tuple[str, ...]:
        """Those that take no hours in a case."""
        return tuple(way for way in self.ways if way != 'maxent' or case.size in SMALL)


def _people() -> Iterator[Line]:
    for size in ('6x6-4', '12x12-6'):
        usual = RouteCase(size)
        variants = {
            'as usual': usual,
            'errs in 20 %': usual._replace(noise=0.2),
            'errs in 55 %': usual._replace(noise=0.55),
            'never errs': usual._replace(noise=0.0),
            'shy: never enters by mistake': usual._replace(pilot='shy'),
            'soft: errs the less the more it costs': usual._replace(pilot='soft'),
            'soft, errs in 20 %': usual._replace(pilot='soft', noise=0.2),
            '3 flights': usual._replace(flights=3),
            '10 flights': usual._replace(flights=10),
            '2 of 5 flights given up half-way': usual._replace(given_up=2),
            '10 % of the answers wrong': usual._replace(errors=0.1),
            '20 % of the answers wrong': usual._replace(errors=0.2),
            'two people with other wishes, 5 flights': usual._replace(people=2),
            'two people with other wishes, 10 flights': usual._replace(people=2, flights=10),
        }
        for label, case in variants.items():
            yield Line(f'{size}: {label}', case)


TABLES = {
    'hidden': RouteTable(
        'areas that the map does not tell of', tuple(Line(size, RouteCase(size)) for size in SIZES), tuple(WAYS),
    ),
    'plain': RouteTable(
        'nothing hidden', tuple(Line(size, RouteCase(size, hidden=False)) for size in SIZES), ('planner', 'occupancy', 'site'),
    ),
    'people': RouteTable('other people', tuple(_people()), ('site',)),
    'second': RouteTable(
        'a second route over the site, without a flight or an answer',
        tuple(Line(size, RouteCase(size, second=True)) for size in SIZES), tuple(SECOND_WAYS),
    ),
}


def tasks(table: RouteTable, trials: Trials) -> list[RouteTask]:
    """One a case and seed."""
    return [
        RouteTask(line.case, table.ways_of(line.case), seed)
        for line in table.lines for seed in seeds_of(line.case, trials)
    ]


def seeds_of(case: RouteCase, trials: Trials) -> range:
    """Large sites have the first half of the seeds."""
    return trials.seeds[: (trials.number + 1) // 2] if case.size in LARGE else trials.seeds


def markdown(table: RouteTable, store: Store, trials: Trials) -> str:
    """A line a case and way."""
    points = [str(point) for point in POINTS]
    head = ['', 'way', 'trials', *points, 'end', 'answers', 'in time', 'first [s]', 'answer [s]', 'MB']
    lines = [_line(head), _line(['---'] * len(head))]
    for label, case in table.lines:
        seeds = seeds_of(case, trials)
        for way in table.ways_of(case):
            found = outcomes(store, case, way, seeds)
            lines.append(_line([label, way, *cells(found)]))
            if any(one['planned'] != one['curve'] for one in found):
                lines.append(_line([label, f'{way}, its plan', *cells([{**one, 'curve': one['planned']} for one in found])]))
    return '\n'.join([f'Seeds {trials.seeds[0]} to {trials.seeds[-1]}.', '', *lines])


def two_tasks(sizes: Sequence[str], trials: Trials) -> list[RouteTask]:
    """One a case of one person or two, and seed."""
    return [RouteTask(case, (AGREEMENT,), seed) for _, case in two.cases(sizes) for seed in trials.seeds]


def two_markdown(sizes: Sequence[str], store: Store, trials: Trials) -> str:
    """How often the flights are said to be of two people, and these named rightly; a line a case."""
    head = ['', 'trials', 'says two', 'and names their flights', '[s]']
    lines = [_line(head), _line(['---'] * len(head))]
    for label, case in two.cases(sizes):
        found = outcomes(store, case, AGREEMENT, trials.seeds)
        said, right = ([one[part] for one in found] for part in ('two', 'right'))
        seconds = np.mean([one['seconds'] for one in found])
        lines.append(_line([label, str(len(found)), _share(said), _share(right) if case.people > 1 else '-', f'{seconds:.2f}']))
    return '\n'.join([f'Seeds {trials.seeds[0]} to {trials.seeds[-1]}.', '', *lines])


def cells(found: Sequence[dict[str, Any]]) -> list[str]:
    """What a way's trials come to: their number, success, answers asked, stopping, seconds and memory."""
    if not found:
        return ['0', *['-'] * (len(POINTS) + 6)]
    at = [_share([_after(one, point) for one in found]) for point in (*POINTS, -1)]
    asked = [len(one['curve']) - 1 for one in found]
    answers = [second for one in found for second in one['seconds'][1:]]
    asks = any(asked) or any(one['beyond'] for one in found)
    return [
        str(len(found)), *at, f'{np.mean(asked):.1f}' if asks else '-',
        f'{100 * np.mean([in_time(one) for one in found]):.0f}' if asks else '-',
        f'{np.mean([one["seconds"][0] for one in found]):.2f}', f'{np.mean(answers):.2f}' if answers else '-',
        f'{max(one["mb"] for one in found):.0f}',
    ]


def _after(outcome: dict[str, Any], answers: int) -> bool:
    """Success after so many answers, -1: at the end; what asked less stays as it was."""
    curve = outcome['curve']
    return bool(curve[-1] if answers < 0 else curve[min(answers, len(curve) - 1)])


def _share(hits: Sequence[bool]) -> str:
    return share_in_words(sum(hits), len(hits))


def in_time(outcome: dict[str, Any]) -> bool:
    """Whether it stopped near its best point: the fewest answers after which success is as good as it ever gets."""
    curve = [*outcome['curve'], *outcome['beyond']]
    return abs(curve.index(max(curve)) - (len(outcome['curve']) - 1)) <= IN_TIME


def _line(cells: Sequence[str]) -> str:
    return f'| {" | ".join(cells)} |'
