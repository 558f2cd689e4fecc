"""replay: a bag in, a verdict out: whether the session follows from what the bag holds."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from advise_ros.command_line import CommandParser
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.exits import INTERRUPTED, OK, VERDICT_NO, fail
from advise_ros.replay.against import against, load_baseline
from advise_ros.replay.check import check
from advise_ros.replay.overrides import parse
from advise_ros.replay.report import ReplayReport, show, to_junit

REPORT_COLUMNS = 120  # Where the terminal does not say its width.

EPILOG = """Rebuilds, without a ROS graph: demonstrations from positions and commands, their windows from the vehicle's
state, policies and questions from demonstrations and answers, commands from policy and positions. Each is compared
with what the bag says was published. Commands of pilots and answers are a person's and are not rebuilt.

examples:
  ./advise replay session1
  ./advise replay session1 --json verdict.json --junit verdict.xml
  ./advise replay session1 --against accepted.json
  ./advise replay session1 --live
  ./advise replay session1 -p advise.clusters:=8 -p grid.resolution:=1.0

Of a bag that is cut off or damaged, what is whole is replayed and the rest is listed.

Next: keep the verdict of a session that you accept (--json accepted.json) and hold the next version to it (--against);
docs/replay.md has the workflow.

exit code: 0 all agree; 1 something differs or would have changed; 2 wrong usage, or no bag with a session; 130 interrupted"""


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point; exits with the code of `run`."""
    sys.exit(run(list(sys.argv[1:] if argv is None else argv)))


def run(argv: Sequence[str]) -> int:
    """The command; returns its exit code."""
    options = _parser().parse_args(argv)
    try:
        report = _report(options)
        if options.json:
            _write(options.json, json.dumps(report.as_json(), indent=2) + '\n')
        if options.junit:
            _write(options.junit, to_junit(report))
    except AdviseError as problem:
        return fail(str(problem))
    except KeyboardInterrupt:
        return fail('stopped before the verdict', INTERRUPTED)
    if '-' not in (options.json, options.junit):
        console = Console()
        show(report, console if console.is_terminal else Console(width=REPORT_COLUMNS))
    return OK if report.agrees else VERDICT_NO


def _report(options: argparse.Namespace) -> ReplayReport:
    overrides = parse(options.override)
    if options.live and overrides:
        raise InputError('--live replays what was recorded; leave --override out')
    report = check(options.bag, options.namespace, options.grid, overrides)
    if options.live:
        from advise_ros.replay.live_stages import live_stages  # noqa: PLC0415  a graph is seldom wanted

        report = replace(report, stages=report.stages + live_stages(report.session, speed=options.speed, domain=options.domain))
    if not options.against:
        return report
    baseline = load_baseline(options.against, options.namespace)
    return replace(report, baseline=baseline.name, beside=against(report, baseline))


def _write(path: str, text: str) -> None:
    if path == '-':
        print(text, end='')
        return
    try:
        Path(path).write_text(text, encoding='utf-8')
    except OSError as problem:
        raise InputError(f'{path} cannot be written ({problem.strerror}); name another file') from problem


def _parser() -> argparse.ArgumentParser:
    parser = CommandParser(
        prog='replay', description='Check that a recorded session follows from what its bag holds.',
        epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('bag', metavar='BAG', help='a bag directory or an .mcap file by logger')
    parser.add_argument('--json', metavar='FILE', help="write the verdict as JSON too; '-': to the terminal, and no table")
    parser.add_argument('--grid', metavar='FILE', help='the grid file that the session must have been flown on')
    parser.add_argument('--junit', metavar='FILE', help='write the verdict as JUnit XML, a test case a stage')
    parser.add_argument(
        '--against', metavar='BASELINE', help='a bag, or a file by --json: the verdict is whether the same is decided as there',
    )
    parser.add_argument(
        '-p', '--override', action='append', default=[], metavar='NODE.NAME:=VALUE',
        help='show what would have changed with another parameter of recorder, advise or policy, or another grid',
    )
    live = parser.add_argument_group('through the real nodes')
    live.add_argument('--live', action='store_true', help='have recorder, advise and policy live through the session again, too')
    live.add_argument('--speed', type=float, default=20.0, metavar='N', help='recorded seconds a second (default 20)')
    live.add_argument('--domain', type=int, metavar='ID', help='ROS domain of those nodes (default: a private one)')
    parser.add_argument('--namespace', metavar='NAME', help='of the session, where the bag holds several')
    return parser


if __name__ == '__main__':
    main()
