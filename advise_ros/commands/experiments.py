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
from advise_ros.core.solve import AUTO, SOLVERS
from advise_ros.domains import DOMAINS
from advise_ros.exits import INTERRUPTED, OK, VERDICT_NO, fail
from advise_ros.experiments import runner
from advise_ros.experiments.experiment import EXPERIMENTS, Request, fulfil
from advise_ros.experiments.method import METHODS
from advise_ros.experiments.problem_file import OPTIONS, READINGS, learn, read_problem, recorded_problem, write_result
from advise_ros.experiments.protocols import FINAL_SEED

EPILOG = """examples:
  ./advise experiments figure5 --domain wumpus --trials 10
  ./advise experiments all --jobs 2 --out out/paper
  ./advise experiments all --dask tcp://127.0.0.1:8786
  ./advise experiments figure5 --domain season/dataset.yaml
  ./advise experiments learn --problem p.npz --out r.npz
  ./advise experiments learn --dataset season --out r.npz

Next: look at the pictures in OUT; docs/paper.md tells what the paper has in their places.
Results are kept trial by trial in OUT/trials.jsonl: after an interruption the same command goes on.
exit code: 0 done; 1 learn: no reward satisfies strict advice; 2 wrong usage or input; 130 interrupted"""


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point; exits with the code of `run`."""
    sys.exit(run(list(sys.argv[1:] if argv is None else argv)))


def run(argv: Sequence[str]) -> int:
    """The command; returns its exit code."""
    options = _parser().parse_args(argv)
    try:
        return options.run(options)
    except AdviseError as problem:
        return fail(str(problem))
    except KeyboardInterrupt:
        print('stopped; the trials that are done are kept, the same command goes on', file=sys.stderr, flush=True)
        return INTERRUPTED


def _figures(options: argparse.Namespace) -> int:
    """Run the trials and write the figures."""
    request = Request(
        tuple(options.domain) if options.domain else None, tuple(options.method or METHODS), options.trials, options.seed,
        Path(options.out),
    )
    console = Console(stderr=True)
    columns = (
        TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn()
    )
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        written = fulfil(options.experiments, request, _performer(options), _progress(bar))
    for path in written:
        print(path, flush=True)
    return OK


def _learn(options: argparse.Namespace) -> int:
    """Solve equation (1) for a problem file or recorded flights."""
    chosen = {name: getattr(options, name) for name in OPTIONS}
    given = recorded_problem(options.dataset, chosen) if options.dataset else read_problem(options.problem, chosen)
    learned = learn(given, options.solver)
    write_result(options.out, learned)
    print(f'{learned.status}, objective {learned.objective:.9g}, {learned.seconds:.3f} s: {options.out}', flush=True)
    return OK if learned.status != 'infeasible' else VERDICT_NO


def _progress(bar: Progress) -> Callable[[str, int, int], None]:
    started: dict[str, Any] = {}

    def tell(name: str, done: int, total: int) -> None:
        if name not in started:
            started[name] = bar.add_task(name, total=total)
        bar.update(started[name], completed=done)

    return tell


def _performer(options: argparse.Namespace) -> runner.Performer:
    if options.dask:
        return runner.OnDask(options.dask)
    return runner.OnCores(options.jobs) if options.jobs > 1 else runner.here


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='experiments', description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(required=True, metavar='COMMAND')
    about = {name: (experiment.about, (name,)) for name, experiment in EXPERIMENTS.items()}
    about['all'] = ('all figures of the paper', tuple(name for name, one in EXPERIMENTS.items() if one.in_all))
    for name, (description, experiments) in about.items():
        _figure_options(commands.add_parser(name, help=description, description=description), experiments)
    _learn_options(commands.add_parser('learn', help='solve equation (1) for a problem of your own (docs/paper.md)'))
    return parser


def _figure_options(parser: argparse.ArgumentParser, experiments: tuple[str, ...]) -> None:
    parser.set_defaults(run=_figures, experiments=experiments)
    parser.add_argument(
        '--domain', nargs='+', action='extend', metavar='NAME',
        help=f'{", ".join(DOMAINS)} (default: all), an .npz file with your own process, or a dataset (docs/paper.md)',
    )
    parser.add_argument(
        '--method', nargs='+', action='extend', choices=METHODS, metavar='NAME', help=f'{", ".join(METHODS)} (default: all)',
    )
    parser.add_argument('--trials', type=_positive, metavar='N', help='default 100; 250 for cluster quality in Sailing')
    parser.add_argument('--seed', type=_natural, default=FINAL_SEED, metavar='N', help='of the first trial (default %(default)s)')
    parser.add_argument('--out', default='out/experiments', metavar='DIR', help='default %(default)s')
    parser.add_argument('--jobs', type=_positive, default=1, metavar='N', help='processes on this machine (default 1)')
    parser.add_argument('--dask', metavar='ADDRESS', help='run on this Dask cluster instead, e.g. tcp://127.0.0.1:8786')


def _learn_options(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_learn)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument('--problem', metavar='FILE', help='.npz: process, demonstrations, advice, options')
    source.add_argument('--dataset', metavar='DIR', help='recorded flights: what discretise --out DIR wrote')
    parser.add_argument('--out', required=True, metavar='FILE', help='.npz: reward, value, q, policy, margins, status')
    parser.add_argument('--solver', default=AUTO, choices=(AUTO, *SOLVERS), help='default %(default)s')
    options = parser.add_argument_group('options (instead of the fields of the same names in the file)')
    options.add_argument('--reading', metavar='R', help=f'{", ".join(READINGS)} (default R3)')
    for name in OPTIONS[1:]:
        options.add_argument('--' + name.replace('_', '-'), type=float, metavar='N')


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
