"""experiments: the paper's figures and tables on simulated people, and equation (1) on any problem."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from advise_ros.core.errors import AdviseError
from advise_ros.domains import DOMAINS
from advise_ros.experiments import runner
from advise_ros.experiments.experiment import EXPERIMENTS, Request, Where
from advise_ros.experiments.method import METHODS
from advise_ros.experiments.protocols import FINAL_SEED

OK, USAGE, INTERRUPTED = 0, 2, 130

EPILOG = """examples:
  ./advise experiments figure5 --domain wumpus --trials 10
  ./advise experiments all --jobs 2 --out out/paper
  ./advise experiments all --dask tcp://127.0.0.1:8786

Results are kept trial by trial in OUT/trials.jsonl: after an interruption the same command goes on.
exit code: 0 done; 2 wrong usage or input; 130 interrupted"""


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point; exits with the code of `run`."""
    sys.exit(run(list(sys.argv[1:] if argv is None else argv)))


def run(argv: Sequence[str]) -> int:
    """The command; returns its exit code."""
    options = _parser().parse_args(argv)
    try:
        options.run(options)
    except AdviseError as problem:
        print(f'error: {problem}', file=sys.stderr, flush=True)
        return USAGE
    except KeyboardInterrupt:
        print('stopped; the trials that are done are kept, the same command goes on', file=sys.stderr, flush=True)
        return INTERRUPTED
    return OK


def _figures(options: argparse.Namespace) -> None:
    """Run the trials and write the figures."""
    request = Request(
        options.experiment, tuple(options.domain or DOMAINS), tuple(options.method or METHODS), options.trials,
        options.seed, Path(options.out),
    )
    console = Console(stderr=True)
    columns = (
        TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn()
    )
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        written = request.fulfil(_performer(options), _progress(bar))
    for path in written:
        print(path, flush=True)


def _progress(bar: Progress) -> Callable[[str, int, int], None]:
    started: dict[str, Any] = {}

    def tell(name: str, done: int, total: int) -> None:
        if name not in started:
            started[name] = bar.add_task(name, total=total)
        bar.update(started[name], completed=done)

    return tell


def _performer(options: argparse.Namespace) -> Where:
    if options.dask:
        return runner.OnDask(options.dask)
    return runner.OnCores(options.jobs) if options.jobs > 1 else runner.here


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='experiments', description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(required=True, metavar='COMMAND')
    for name, experiment in EXPERIMENTS.items():
        _figure_options(commands.add_parser(name, help=experiment.about, description=experiment.about), name)
    return parser


def _figure_options(parser: argparse.ArgumentParser, name: str) -> None:
    parser.set_defaults(run=_figures, experiment=name)
    parser.add_argument(
        '--domain', nargs='+', action='extend', metavar='NAME',
        help=f'{", ".join(DOMAINS)} (default: all), or an .npz file with your own process (docs/paper.md)',
    )
    parser.add_argument(
        '--method', nargs='+', action='extend', choices=METHODS, metavar='NAME', help=f'{", ".join(METHODS)} (default: all)',
    )
    parser.add_argument('--trials', type=_positive, metavar='N', help='default 100; 250 for cluster quality in Sailing')
    parser.add_argument('--seed', type=_natural, default=FINAL_SEED, metavar='N', help='of the first trial (default %(default)s)')
    parser.add_argument('--out', default='out/experiments', metavar='DIR', help='default %(default)s')
    parser.add_argument('--jobs', type=_positive, default=1, metavar='N', help='processes on this machine (default 1)')
    parser.add_argument('--dask', metavar='ADDRESS', help='run on this Dask cluster instead, e.g. tcp://127.0.0.1:8786')


def _positive(text: str) -> int:
    return _whole(text, 1)


def _natural(text: str) -> int:
    return _whole(text, 0)


def _whole(text: str, least: int) -> int:
    try:
        number = int(text)
    except ValueError:
        number = least - 1
    if number < least:
        raise argparse.ArgumentTypeError(f"'{text}' is no whole number from {least}")
    return number


if __name__ == '__main__':
    main()
