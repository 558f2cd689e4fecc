"""replay: a bag in, a verdict out: whether the session follows from what the bag holds."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from advise_ros.core.errors import AdviseError, InputError
from advise_ros.recording.gridfile import load_grid
from advise_ros.replay.completeness import completeness_stages
from advise_ros.replay.demonstrations import demonstration_stages
from advise_ros.replay.flights import flight_stages
from advise_ros.replay.learning import learning_stages
from advise_ros.replay.report import Report, show
from advise_ros.replay.session import RecordedSession, read_session
from advise_ros.replay.stage import Comparison
from advise_ros.ros import convert

OK, DIFFERS, USAGE, INTERRUPTED = 0, 1, 2, 130
STAGES = (completeness_stages, demonstration_stages, learning_stages, flight_stages)
REPORT_COLUMNS = 120  # Where the terminal does not tell its width.

EPILOG = """Rebuilds, without a ROS graph: demonstrations from positions and commands, their windows from the vehicle's
state, policies and questions from demonstrations and answers, commands from policy and positions. Each is compared
with what the bag says was published. Commands of pilots and answers are a person's and are not rebuilt.

examples:
  ./advise replay session1
  ./advise replay session1 --json verdict.json

exit code: 0 all agree; 1 something differs; 2 wrong usage, or no whole bag with a session; 130 interrupted"""


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point; exits with the code of `run`."""
    sys.exit(run(list(sys.argv[1:] if argv is None else argv)))


def run(argv: Sequence[str]) -> int:
    """The command; returns its exit code."""
    options = _parser().parse_args(argv)
    try:
        report = replay(options.bag, options.namespace, options.grid)
        if options.json:
            _write(options.json, report)
    except AdviseError as problem:
        print(f'error: {problem}', file=sys.stderr, flush=True)
        return USAGE
    except KeyboardInterrupt:
        print('stopped before the verdict', file=sys.stderr, flush=True)
        return INTERRUPTED
    if options.json != '-':
        console = Console()
        show(report, console if console.is_terminal else Console(width=REPORT_COLUMNS))
    return OK if report.agrees else DIFFERS


def replay(bag: str | Path, namespace: str | None = None, grid_file: str | Path | None = None) -> Report:
    """Rebuild and compare everything.

    Args:
        bag: by `logger`.
        namespace: of the session; None where the bag holds one only.
        grid_file: the grid that the session must be on; None takes the bag's.

    Raises:
        InputError: the bag cannot be read, holds no session, or its session is on another grid.
    """
    begin_s = time.perf_counter()
    session = read_session(bag, namespace)
    if grid_file is not None:
        _check_grid(session, grid_file)
    comparison = Comparison(session)
    stages = tuple(stage for rebuild in STAGES for stage in rebuild(session, comparison))
    return Report(session, stages, time.perf_counter() - begin_s)


def _check_grid(session: RecordedSession, grid_file: str | Path) -> None:
    grid = load_grid(grid_file)
    for recorded in session.on('demonstration'):
        if convert.grid_from_msg(recorded.value.grid) != grid:
            raise InputError(
                f'demonstration {recorded.value.demonstration_id} of {session.bag.path} is on another grid than '
                f'{grid_file}; name the grid file of that session, or none'
            )


def _write(path: str, report: Report) -> None:
    text = json.dumps(report.as_json(), indent=2) + '\n'
    if path == '-':
        print(text, end='')
        return
    try:
        Path(path).write_text(text, encoding='utf-8')
    except OSError as problem:
        raise InputError(f'{path} cannot be written ({problem.strerror}); name another file') from problem


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='replay', description='Check that a recorded session follows from what its bag holds.',
        epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('bag', metavar='BAG', help='a bag directory or an .mcap file by logger')
    parser.add_argument('--json', metavar='FILE', help="write the verdict as JSON too; '-': to the terminal, and no table")
    parser.add_argument('--grid', metavar='FILE', help='the grid file that the session must have been flown on')
    parser.add_argument('--namespace', metavar='NAME', help='of the session, where the bag holds several')
    return parser


if __name__ == '__main__':
    main()
