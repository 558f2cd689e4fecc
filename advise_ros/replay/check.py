"""A bag in, a report out."""

from __future__ import annotations

import time
from pathlib import Path

from advise_ros.core.errors import InputError
from advise_ros.recording.gridfile import load_grid
from advise_ros.replay.demonstrations import demonstration_stages
from advise_ros.replay.flights import flight_stages
from advise_ros.replay.learning import learning_stages
from advise_ros.replay.overrides import Overrides
from advise_ros.replay.report import ReplayReport
from advise_ros.replay.session import RecordedSession, at, read_session
from advise_ros.replay.stage import Comparison, Stage
from advise_ros.ros import convert


def completeness_stages(session: RecordedSession, comparison: Comparison) -> list[Stage]:
    """The logger numbers the messages of each topic; a jump is a lost or removed message."""
    if comparison.what_if:
        return []
    stage = Stage('messages kept', checked=session.bag.count, equal=session.bag.count, notes=list(session.bag.notes))
    for gap in session.bag.gaps:
        stage.count(f'{gap.topic} at log time {at(gap.log_time_ns)}: {gap.missing} messages before it are missing')
    return [stage]


STAGES = (completeness_stages, demonstration_stages, learning_stages, flight_stages)


def check(
    bag: str | Path, namespace: str | None = None, grid_file: str | Path | None = None, overrides: Overrides | None = None,
) -> ReplayReport:
    """Rebuild everything and compare it with what the bag says was published.

    Args:
        bag: by `logger`.
        namespace: of the session; None where the bag holds one only.
        grid_file: the grid that the session must be on; None takes the bag's.
        overrides: what is to be otherwise; then the report shows what would have changed.

    Raises:
        InputError: the bag cannot be read, holds no session, its session is on another grid, or the overrides make no grid.
    """
    begin_s = time.perf_counter()
    session = read_session(bag, namespace, overrides)
    if grid_file is not None:
        _check_grid(session, grid_file)
    _check_overrides(session)
    comparison = Comparison(session)
    stages = tuple(stage for rebuild in STAGES for stage in rebuild(session, comparison))
    return ReplayReport(session, stages, comparison.rebuilt, time.perf_counter() - begin_s)


def _check_overrides(session: RecordedSession) -> None:
    """A missing grid is wrong input, not something that would have changed."""
    for recorded in session.on('demonstration'):
        try:
            flown = convert.grid_from_msg(recorded.value.grid)
        except InputError:  # The stages will report it.
            continue
        session.grid(flown)


def _check_grid(session: RecordedSession, grid_file: str | Path) -> None:
    grid = load_grid(grid_file)
    for recorded in session.on('demonstration'):
        if convert.grid_from_msg(recorded.value.grid) != grid:
            raise InputError(
                f'demonstration {recorded.value.demonstration_id} of {session.bag.path} is on another grid than '
                f'{grid_file}; name the grid file of that session, or none'
            )
