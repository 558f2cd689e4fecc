"""The page on routes: runs the trials that are missing, writes tables and picture."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

from advise_ros.core.errors import InputError
from advise_ros.experiments import plots
from advise_ros.experiments.figures import Trials
from advise_ros.experiments.routes import domains, maxent
from advise_ros.experiments.routes.page import write_page
from advise_ros.experiments.routes.picture import picture
from advise_ros.experiments.routes.recordings import recordings
from advise_ros.experiments.routes.tables import TABLES, RouteTable, markdown, tasks, two_markdown, two_tasks
from advise_ros.experiments.routes.ways import MOST_ANSWERS, WAYS
from advise_ros.experiments.runner import Performer, run
from advise_ros.experiments.store import Store

TITLE = 'Routes: what the map does not say'
# Of sites up to 12 x 12 cells; larger ones have half of them.
TRIALS, SEED = 100, 700_000
DRAWN = 'hidden'
TWO, DOMAINS, RECORDINGS = 'two', 'domains', 'recordings'
NAMES = (*TABLES, TWO, DOMAINS, RECORDINGS)


class RoutesRequest(NamedTuple):
    """What a user asked for.

    Attributes:
        tables: of NAMES.
        sizes: of SIZES.
        ways: of WAYS; None for all that can run.
        trials: how many, and their first seed.
        out: directory of the results.
        page: of the tables; the picture is beside it.
        recordings, grids: directory of recorded flights, and the files of their grids.
    """

    tables: tuple[str, ...]
    sizes: tuple[str, ...]
    ways: tuple[str, ...] | None
    trials: Trials
    out: Path
    page: Path
    recordings: Path
    grids: tuple[Path, ...]


def report(
    request: RoutesRequest, performer: Performer, progress: Callable[[str, int, int], None], tell: Callable[[str], None],
) -> list[Path]:
    """Run what is missing and write the page; returns the files.

    Args:
        request: what is asked for.
        performer: where trials run.
        progress: gets title, trials done and trials in all.
        tell: gets what is left out, and why.

    Raises:
        InputError: a way that was asked for lacks its package, or something cannot be read or written.
    """
    ways = _ways(request.ways, tell)
    chosen = {name: TABLES[name].only(request.sizes, ways) for name in request.tables if name in TABLES}
    made: dict[str, str] = {}
    with Store(request.out / 'trials.jsonl') as store, plots.in_style():
        for name, table in chosen.items():
            run(tasks(table, request.trials), store, performer, partial(progress, name))
            made[name] = markdown(table, store, request.trials)
        if TWO in request.tables:
            run(two_tasks(request.sizes, request.trials), store, performer, partial(progress, TWO))
            made[TWO] = two_markdown(request.sizes, store, request.trials)
        if DOMAINS in request.tables:
            run(domains.tasks(request.trials), store, performer, partial(progress, DOMAINS))
            made[DOMAINS] = domains.markdown(store, request.trials)
        if RECORDINGS in request.tables:
            made[RECORDINGS] = recordings(request.recordings, request.grids)
        write_page(request.page, TITLE, made)
        drawn = _drawn(chosen, request, store)
    return [request.page, *drawn]


def _ways(asked: tuple[str, ...] | None, tell: Callable[[str], None]) -> tuple[str, ...]:
    """All that can run, or those that were asked for."""
    if not maxent.is_missing() or (asked and 'maxent' not in asked):
        return asked or tuple(WAYS)
    if asked:
        raise InputError(maxent.MISSING)
    tell(maxent.MISSING)
    return tuple(way for way in WAYS if way != 'maxent')


def _drawn(chosen: dict[str, RouteTable], request: RoutesRequest, store: Store) -> list[Path]:
    table = chosen.get(DRAWN)
    if table is None or not table.lines:
        return []
    return plots.save(picture(table, store, request.trials, MOST_ANSWERS), request.page.with_suffix(''), ('.svg',))
