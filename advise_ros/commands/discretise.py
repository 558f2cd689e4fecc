"""discretise: recordings + a grid -> demonstrations, with a table of them and of what was not used."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import Field, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from advise_ros import config
from advise_ros.command_line import CommandParser
from advise_ros.config import RecorderConfig
from advise_ros.core.demonstrations import recorded_flights
from advise_ros.core.demonstrations.demonstration import Audit, Demonstration
from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.errors import AdviseError, LogError
from advise_ros.core.grid.cell_tracker import check_hysteresis
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import NS
from advise_ros.exits import INTERRUPTED, OK, USAGE, fail
from advise_ros.recording.batch import ReadTask, RecordingResult, read_all, read_one
from advise_ros.recording.dataset import Dataset, save_dataset
from advise_ros.recording.demofile import save_demonstrations
from advise_ros.recording.gridfile import load_grid, load_place
from advise_ros.recording.sources import find_recordings
from advise_ros.recording.topics import DEFAULT_TOPICS, BagTopics

TABLE_COLUMNS = 120  # Where the terminal does not say its width.
WAYPOINTS_SHOWN = 6
ROWS_SHOWN = 100
PLACE_NUMBERS = 4

EXAMPLES = """examples:
  ./advise discretise bags/arducopter_flight1.tlog --grid config/grid_6x6.yaml --out demos.json
  ./advise discretise bags/arducopter_five_flights --grid config/grid_6x6.yaml
  ./advise discretise flight*.mcap --grid grid.yaml --pose-topic /drone1/pose --out demos.json
  ./advise discretise season/ --grid grid.yaml --out dataset          (dataset.yaml and demonstrations.npz)
  ./advise discretise season/ --grid grid.yaml --out dataset --dask tcp://10.0.0.5:8786

Of a recording that is cut off or damaged, what is whole is used and the rest is listed.

Next: learn from them, and see the first question:
  ./advise advise --ros-args -p grid_file:=config/grid_6x6.yaml -p demonstrations_file:=demos.json
  ./advise answer

exit code: 0 all recordings gave demonstrations; 2 wrong usage, or a recording gave none
(the demonstrations of the others are written all the same); 130 interrupted, nothing written"""


class BatchOutcome(NamedTuple):
    """What became of the recordings: demonstrations, remarks, one sentence for each that failed, and how many each gave."""

    demonstrations: list[Demonstration]
    remarks: list[str]
    failures: list[str]
    recordings: dict[str, int]


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point; exits with the code of `run`."""
    sys.exit(run(list(sys.argv[1:] if argv is None else argv)))


def run(argv: Sequence[str]) -> int:
    """The command; returns its exit code."""
    options = _parser().parse_args(argv)
    try:
        grid, settings = load_grid(options.grid, options.obstacle_map), _settings(options)
        check_hysteresis(grid, settings.hysteresis_m)
        outcome = _discretise_all(options, grid, settings)
        if options.out and outcome.demonstrations:
            _save(options.out, outcome, grid, settings)
    except AdviseError as problem:
        return fail(str(problem))
    except KeyboardInterrupt:
        return fail('stopped; nothing was written', INTERRUPTED)
    _report(outcome, grid, options.out)
    return USAGE if outcome.failures else OK


def _save(out: str, outcome: BatchOutcome, grid: Grid, settings: DiscretiseSettings) -> None:
    if Path(out).suffix == '.json':
        save_demonstrations(out, outcome.demonstrations)
        return
    found = tuple(outcome.demonstrations)
    save_dataset(out, Dataset(grid, found, settings, outcome.recordings, tuple(outcome.failures)))


# -- options ---------------------------------------------------------------------------------------
def _parser() -> argparse.ArgumentParser:
    parser = CommandParser(
        prog='discretise', description='Turn recordings of flights into demonstrations on a grid, with an audit.',
        epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        'paths', nargs='+', metavar='PATH', help='a bag (directory or file), a .tlog, .ulg or .BIN, or a directory of them',
    )
    parser.add_argument('--grid', required=True, metavar='FILE', help='YAML file with the grid and its waypoints')
    parser.add_argument(
        '--obstacle-map', default='', metavar='FILE', help='map of nav2_map_server (YAML) whose obstacles are blocked cells, too',
    )
    parser.add_argument(
        '--out', metavar='OUT', help='write the demonstrations to this .json file, or as a dataset into this directory',
    )
    parser.add_argument(
        '--undivided', action='store_true',
        help='take each recording as one flight: do not look for take-off and landing',
    )
    parser.add_argument(
        '--policy-flights', action='store_true', help='take flights that our own policy flew as demonstrations, too',
    )
    many = parser.add_argument_group('many recordings')
    many.add_argument('--jobs', type=_jobs, default=0, metavar='N', help='processes at a time (default: one a core)')
    many.add_argument(
        '--dask', default='', metavar='ADDRESS', help='use the Dask cluster whose scheduler is there, e.g. tcp://host:8786',
    )
    topics = parser.add_argument_group('topics of a bag (a name without / in front is found in any namespace)')
    topics.add_argument('--pose-topic', metavar='NAME', help='positions (default: pose, else odom, of the vehicle that flies)')
    topics.add_argument('--command-topic', metavar='NAME', help='TwistStamped or Twist (default: cmd_vel, where there is one)')
    topics.add_argument(
        '--status-topic', metavar='NAME',
        help="the vehicle's state (default: vehicle_status, MAVROS' state or PX4's vehicle_status)",
    )
    topics.add_argument(
        '--vehicle', default='', metavar='NAME', help='of several vehicles: its namespace, or its system id in a .tlog',
    )
    topics.add_argument(
        '--frame', default='', metavar='NAME', help="frame of the positions whose origin and axes are the grid's (default: map)",
    )
    topics.add_argument(
        '--frame-at', type=_place, default=(), metavar='EAST,NORTH,UP,YAW',
        help='where that frame lies on the grid, in metres and degrees counter-clockwise, as --frame-at=-2,1.5,0,90',
    )
    settings = parser.add_argument_group('settings (as the parameters of the recorder)')
    for name, spec in _setting_specs().items():
        settings.add_argument(
            '--' + name.replace('_', '-'), type=type(spec.default), default=spec.default, metavar='N',
            help=f'{spec.metadata["doc"]} (default %(default)s; {config.range_text(spec)})',
        )
    return parser


def _jobs(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f'{text!r} is not a number of processes')
    return int(text)


def _place(text: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(part) for part in text.split(','))
    except ValueError:
        numbers = ()
    if len(numbers) != PLACE_NUMBERS or not all(map(math.isfinite, numbers)):
        raise argparse.ArgumentTypeError(f'{text!r} is not four numbers with commas, as 1.5,-2,0,90')
    return numbers


def _setting_specs() -> dict[str, Field[Any]]:
    wanted = {spec.name for spec in fields(DiscretiseSettings)}
    return {spec.name: spec for spec in fields(RecorderConfig) if spec.name in wanted}


def _settings(options: argparse.Namespace) -> DiscretiseSettings:
    values = {name: getattr(options, name) for name in _setting_specs()}
    return config.build(RecorderConfig, values).discretise_settings()


def _topics(options: argparse.Namespace) -> BagTopics:
    asked = {'command': options.command_topic, 'status': options.status_topic}
    named = {kind: name for kind, name in asked.items() if name}
    pose = (options.pose_topic,) if options.pose_topic else ()
    return DEFAULT_TOPICS._replace(
        pose=pose, required=tuple(named), vehicle=options.vehicle, frame=options.frame, frame_at=options.frame_at, **named,
    )


# -- work ------------------------------------------------------------------------------------------
def _discretise_all(options: argparse.Namespace, grid: Grid, settings: DiscretiseSettings) -> BatchOutcome:
    outcome = BatchOutcome([], [], [], {})
    paths = _found(options.paths, outcome)
    task = ReadTask(grid, settings, _topics(options), options.undivided, options.policy_flights, load_place(options.grid))
    for one in _read_paths(options, paths, task):
        first = len(outcome.demonstrations) + 1
        outcome.demonstrations.extend(
            replace(demonstration, demonstration_id=recorded_flights.name(first + index))
            for index, demonstration in enumerate(one.demonstrations)
        )
        outcome.remarks.extend(one.remarks)
        outcome.failures.extend([one.failure] if one.failure else ())
        outcome.recordings[one.path] = len(one.demonstrations)
    return outcome


def _found(paths: Sequence[str], outcome: BatchOutcome) -> list[str]:
    found: list[str] = []
    for path in paths:
        try:
            found += map(str, find_recordings(path))
        except LogError as problem:
            outcome.failures.append(str(problem))
    return list(dict.fromkeys(found))


def _read_paths(options: argparse.Namespace, paths: list[str], task: ReadTask) -> list[RecordingResult]:
    columns = (TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        if len(paths) == 1 and not options.dask:
            (path,) = paths
            work = bar.add_task(Path(path).name, total=None)
            return [read_one(path, task, lambda done, total: bar.update(work, completed=done, total=total))]
        work = bar.add_task('recordings', total=len(paths))
        return read_all(paths, task, jobs=options.jobs, dask=options.dask, done=lambda: bar.advance(work))


# -- report ----------------------------------------------------------------------------------------
def _report(outcome: BatchOutcome, grid: Grid, out: str | None) -> None:
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
        fail(failure)


def _table(demonstrations: Sequence[Demonstration], grid: Grid) -> Table:
    table = Table(box=box.SIMPLE)
    table.add_column('id', no_wrap=True)
    table.add_column('moves', justify='right')
    table.add_column('seconds', justify='right')
    table.add_column('waypoints in order')
    table.add_column('end', no_wrap=True)
    table.add_column('audit')
    for demonstration in demonstrations[:ROWS_SHOWN]:
        table.add_row(*_row(demonstration, grid))
    if len(demonstrations) > ROWS_SHOWN:
        moves = sum(len(one.states) for one in demonstrations)
        table.add_row('...', str(moves), '', f'{len(demonstrations)} demonstrations in all')
    return table


def _row(demonstration: Demonstration, grid: Grid) -> tuple[str, ...]:
    reached = recorded_flights.waypoints_reached(demonstration)
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
