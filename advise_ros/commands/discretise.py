"""discretise: recordings + a grid -> demonstrations, with a table of what was found and what was not used."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import Field, fields
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich import box
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn
from rich.table import Table

from advise_ros import config
from advise_ros.config import RecorderConfig
from advise_ros.core.demonstration import Audit, Demonstration
from advise_ros.core.discretise import DiscretiseSettings
from advise_ros.core.errors import AdviseError, LogError
from advise_ros.core.flights import Demonstrations, demonstrations_of, waypoints_reached
from advise_ros.core.grid import Grid
from advise_ros.core.samples import Recording
from advise_ros.core.tracker import check_hysteresis
from advise_ros.recording.bags import DEFAULT_TOPICS, BagTopics
from advise_ros.recording.demofile import save_demonstrations
from advise_ros.recording.gridfile import load_grid
from advise_ros.recording.sources import read_recording

OK, USAGE, INTERRUPTED = 0, 2, 130
NS = 1_000_000_000
TABLE_COLUMNS = 120  # Where the terminal does not tell its width.
WAYPOINTS_SHOWN = 6
REASONS_SHOWN = 2

EXAMPLES = """examples:
  ./advise discretise bags/arducopter_flight1.tlog --grid config/grid_6x6.yaml --out demos.json
  ./advise discretise bags/arducopter_five_flights --grid config/grid_6x6.yaml
  ./advise discretise flight*.mcap --grid grid.yaml --pose-topic /drone1/pose --out demos.json

exit code: 0 all recordings gave demonstrations; 2 wrong usage, or a recording gave none
(the demonstrations of the others are written all the same); 130 interrupted, nothing written"""


class Outcome(NamedTuple):
    """What became of the recordings: demonstrations, remarks, and one sentence for each that failed."""

    demonstrations: list[Demonstration]
    remarks: list[str]
    failures: list[str]


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point; exits with the code of `run`."""
    sys.exit(run(list(sys.argv[1:] if argv is None else argv)))


def run(argv: Sequence[str]) -> int:
    """The command; returns its exit code."""
    options = _parser().parse_args(argv)
    try:
        grid, settings = load_grid(options.grid), _settings(options)
        check_hysteresis(grid, settings.hysteresis_m)
        outcome = _discretise_all(options, grid, settings)
        if options.out and outcome.demonstrations:
            save_demonstrations(options.out, outcome.demonstrations)
    except AdviseError as problem:
        return _fail(str(problem))
    except KeyboardInterrupt:
        print('stopped; nothing was written', file=sys.stderr, flush=True)
        return INTERRUPTED
    _report(outcome, grid, options.out)
    return USAGE if outcome.failures else OK


def _fail(sentence: str) -> int:
    print(f'error: {sentence}', file=sys.stderr, flush=True)
    return USAGE


# -- options ---------------------------------------------------------------------------------------
def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='discretise', description='Turn recordings of flights into demonstrations on a grid, with an audit.',
        epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('paths', nargs='+', metavar='PATH', help='a .tlog, a bag directory or an .mcap file')
    parser.add_argument('--grid', required=True, metavar='FILE', help='YAML file with the grid and its waypoints')
    parser.add_argument('--out', metavar='FILE', help='write the demonstrations to this JSON file')
    parser.add_argument(
        '--undivided', action='store_true',
        help='take each recording as one flight: do not look for take-off and landing',
    )
    topics = parser.add_argument_group('topics of a bag (a name without / in front is found in any namespace)')
    topics.add_argument('--pose-topic', metavar='NAME', help='positions (default: pose, else odom)')
    topics.add_argument('--command-topic', metavar='NAME', help=f'default: {DEFAULT_TOPICS.command}, where there is one')
    topics.add_argument('--status-topic', metavar='NAME', help=f'default: {DEFAULT_TOPICS.status}, where there is one')
    settings = parser.add_argument_group('settings (as the parameters of the recorder)')
    for name, spec in _setting_specs().items():
        settings.add_argument(
            '--' + name.replace('_', '-'), type=type(spec.default), default=spec.default, metavar='N',
            help=f'{spec.metadata["doc"]} (default %(default)s; {config.range_text(spec)})',
        )
    return parser


def _setting_specs() -> dict[str, Field[Any]]:
    wanted = {spec.name for spec in fields(DiscretiseSettings)}
    return {spec.name: spec for spec in fields(RecorderConfig) if spec.name in wanted}


def _settings(options: argparse.Namespace) -> DiscretiseSettings:
    values = {name: getattr(options, name) for name in _setting_specs()}
    return config.build(RecorderConfig, values).discretise_settings()


def _topics(options: argparse.Namespace) -> BagTopics:
    pose = (options.pose_topic,) if options.pose_topic else DEFAULT_TOPICS.pose
    asked = {'command': options.command_topic, 'status': options.status_topic}
    named = {kind: name for kind, name in asked.items() if name}
    return DEFAULT_TOPICS._replace(pose=pose, required=tuple(named), **named)


# -- work ------------------------------------------------------------------------------------------
def _discretise_all(options: argparse.Namespace, grid: Grid, settings: DiscretiseSettings) -> Outcome:
    outcome = Outcome([], [], [])
    columns = (TextColumn('{task.description}'), BarColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        for path in options.paths:
            task = bar.add_task(Path(path).name, total=None)
            try:
                recording = read_recording(path, _topics(options), partial(_show, bar, task))
                _add(outcome, path, recording, _demonstrations(options, grid, settings, recording, outcome))
            except LogError as problem:
                outcome.failures.append(str(problem))
            bar.remove_task(task)
    return outcome


def _show(bar: Progress, task: TaskID, done: int, total: int) -> None:
    bar.update(task, completed=done, total=total)


def _demonstrations(
    options: argparse.Namespace, grid: Grid, settings: DiscretiseSettings, recording: Recording, outcome: Outcome,
) -> Demonstrations:
    """Those of one recording, or a LogError that says why there are none."""
    first = len(outcome.demonstrations) + 1
    found = demonstrations_of(grid, recording, settings, first=first, undivided=options.undivided)
    if not found.demonstrations:
        reason = '; '.join(found.notes[:REASONS_SHOWN]) or _why_no_flight(grid, recording)
        raise LogError(f'{recording.source} gives no demonstration on this grid: {reason}')
    return found


def _why_no_flight(grid: Grid, recording: Recording) -> str:
    stamps_ns, positions_enu_m = recording.poses
    numbers = np.isfinite(positions_enu_m).all(axis=1)
    if not numbers.any():
        return 'none of its positions is a number'
    if not (numbers & (stamps_ns != 0)).any():
        return 'none of its positions has a stamp; record them with header.stamp set'
    highest_m = positions_enu_m[numbers & (stamps_ns != 0), 2].max()
    return f'no flight reaches {grid.altitude_m:g} m, the highest position is {highest_m:.1f} m'


def _add(outcome: Outcome, path: str, recording: Recording, found: Demonstrations) -> None:
    outcome.demonstrations.extend(found.demonstrations)
    outcome.remarks.extend(f'{path}: {note}' for note in (*recording.notes, *found.notes))


# -- report ----------------------------------------------------------------------------------------
def _report(outcome: Outcome, grid: Grid, out: str | None) -> None:
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = TABLE_COLUMNS
    if outcome.demonstrations:
        console.print(_table(outcome.demonstrations, grid))
    for demonstration in outcome.demonstrations:
        for note in demonstration.audit.notes:
            console.print(f'{demonstration.demonstration_id}: {note}', markup=False)
    for remark in outcome.remarks:
        console.print(remark, markup=False)
    if out and outcome.demonstrations:
        count = len(outcome.demonstrations)
        console.print(f'{count} demonstration{"s" * (count > 1)} written to {out}', markup=False)
    for failure in outcome.failures:
        _fail(failure)


def _table(demonstrations: Sequence[Demonstration], grid: Grid) -> Table:
    table = Table(box=box.SIMPLE)
    table.add_column('id', no_wrap=True)
    table.add_column('moves', justify='right')
    table.add_column('seconds', justify='right')
    table.add_column('waypoints in order')
    table.add_column('end', no_wrap=True)
    table.add_column('audit')
    for demonstration in demonstrations:
        table.add_row(*_row(demonstration, grid))
    return table


def _row(demonstration: Demonstration, grid: Grid) -> tuple[str, ...]:
    reached = waypoints_reached(demonstration)
    cells = [f'({x},{y})' for x, y in map(grid.xy, grid.waypoints[:reached])]
    if len(cells) > WAYPOINTS_SHOWN:
        cells[1 : 1 - WAYPOINTS_SHOWN] = ['...']
    return (
        demonstration.demonstration_id,
        str(len(demonstration.states)),
        f'{(demonstration.window_ns[1] - demonstration.window_ns[0]) / NS:.1f}',
        ' '.join((*cells, '' if reached == grid.n_layers else f'{reached} of {grid.n_layers}')).strip(),
        demonstration.end_reason.name.lower().replace('_', ' '),
        _audit(demonstration.audit),
    )


def _audit(audit: Audit) -> str:
    """The counts that are not zero."""
    counts = (
        (audit.late, 'late'), (audit.unstamped, 'without stamp'), (audit.out_of_grid, 'outside'),
        (audit.cell_skips, 'cells skipped'), (audit.ambiguous_actions, 'actions by motion'),
    )
    said = [f'{audit.samples} samples', f'gap {audit.max_gap_s:.2f} s', *(f'{n} {what}' for n, what in counts if n)]
    return ', '.join(said)


if __name__ == '__main__':
    main()
