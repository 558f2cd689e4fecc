"""experiments: the paper's figures and tables on simulated people, and equation (1) on any problem."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from advise_ros.command_line import CommandParser
from advise_ros.core.errors import AdviseError
from advise_ros.core.irl.solvers.choose import AUTO, SOLVERS
from advise_ros.domains import DOMAINS
from advise_ros.exits import INTERRUPTED, OK, VERDICT_NO, fail
from advise_ros.experiments import runner
from advise_ros.experiments.experiment import EXPERIMENTS, TRIALS, Request, fulfil
from advise_ros.experiments.figures import Trials
from advise_ros.experiments.method import METHODS
from advise_ros.experiments.problem_file import (
    OPTIONS,
    READINGS,
    Learned,
    learn,
    read_problem,
    recorded_problem,
    write_result,
)
from advise_ros.experiments.protocols import FINAL_SEED
from advise_ros.experiments.routes.report import NAMES, SEED, RoutesRequest, report
from advise_ros.experiments.routes.report import TRIALS as ROUTES_TRIALS
from advise_ros.experiments.routes.ways import WAY_NAMES
from advise_ros.experiments.sites import SIZES

EPILOG = """examples:
  ./advise experiments figure5 --domain wumpus --trials 10
  ./advise experiments all --jobs 2 --out out/paper
  ./advise experiments all --dask tcp://127.0.0.1:8786
  ./advise experiments figure5 --domain season/dataset.yaml
  ./advise experiments learn --problem p.npz --out r.npz
  ./advise experiments learn --dataset season --out r.npz

Next: look at the pictures in OUT; docs/paper.md has the paper's own ones beside.
Results are kept trial by trial in OUT/trials.jsonl: after an interruption the same command goes on.
exit code: 0 done; 1 learn: no reward satisfies strict advice; 2 wrong usage or input; 130 interrupted"""
EXAMPLES = {
    'figure5': """examples:
  ./advise experiments figure5 --domain wumpus sailing --trials 10 --jobs 2
  ./advise experiments figure5 --domain traffic --method clustered single
  ./advise experiments figure5 --domain mine.npz --out out/mine

A cluster: ./advise python -m distributed.cli.dask_scheduler, and on each machine
./advise python -m distributed.cli.dask_worker tcp://HOST:8786 --nthreads 1; then --dask tcp://HOST:8786.""",
    'figure6': """examples:
  ./advise experiments figure6 --domain sailing --trials 20
  ./advise experiments figure6 --jobs 2 --out out/paper""",
    'clusters': """examples:
  ./advise experiments clusters --domain sailing
  ./advise experiments clusters --trials 20 --out out/paper""",
    'acquisitions': """examples:
  ./advise experiments acquisitions --domain wumpus --trials 10 --seed 30000""",
    'all': """examples:
  ./advise experiments all --jobs 2 --out out/paper
  ./advise experiments all --domain wumpus mine.npz --trials 10

What has no place in figure 6 is left out there: domains without goals, or with one best action everywhere.""",
    'routes': """examples:
  ./advise experiments routes --jobs 2 --page docs/notebook/routes.md
  ./advise experiments routes --tables hidden --sizes 6x6-4 8x8-8 --ways planner site --trials 10
  ./advise experiments routes --tables recordings --recordings bags --grid config/grid_6x6.yaml

Tables: hidden (areas that the map does not tell of), plain (nothing hidden), people, second (another route over the same site),
two (flights of two people are told apart), domains (Wumpus World and Sailing), recordings. Those that a page has already are
renewed where they stand.""",
    'learn': """examples:
  ./advise experiments learn --problem p.npz --out r.npz
  ./advise experiments learn --problem p.npz --out r.npz --reading R1 --slack-cost 1000
  ./advise experiments learn --dataset season --out r.npz --xi-cap 0.1

docs/paper.md lists the fields of both files.
exit code: 0 solved; 1 no reward satisfies strict advice; 2 wrong usage or input""",
}
MOST_NAMED = 20
GRIDS = ('config/grid_6x6.yaml', 'config/grid_demo.yaml')
FIGURES_EXIT = """
exit code: 0 done; 2 wrong usage or input; 130 interrupted (the same command goes on)"""
OPTION_HELP = {
    'lambda_t': 'weight of the demonstrations (default 1000)',
    'lambda_a': 'weight of the advice (default 500)',
    'r_max': 'largest reward (default 1)',
    'xi_cap': 'largest margin that is paid for, 0: no cap (default 0.2; R1 and R2: 0)',
    'delta': 'least margin of advice (default 0.1)',
    'slack_cost': 'price of advice that is not met, 0: advice is strict (default 1000; R1: 0)',
    'temperature': 'of the Boltzmann policy (default 1)',
}


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
    with _bar() as bar:
        return _written(fulfil(options.experiments, request, _performer(options), _progress(bar), _note))


def _bar() -> Progress:
    console = Console(stderr=True)
    columns = (
        TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn()
    )
    return Progress(*columns, console=console, disable=not console.is_terminal)


def _routes(options: argparse.Namespace) -> int:
    """Run the trials on routes and write their page."""
    out = Path(options.out)
    request = RoutesRequest(
        tuple(options.tables), tuple(options.sizes), tuple(options.ways) if options.ways else None,
        Trials(options.trials, options.seed), out, Path(options.page) if options.page else out / 'routes.md',
        Path(options.recordings), tuple(map(Path, options.grid)),
    )
    with _bar() as bar:
        return _written(report(request, _performer(options), _progress(bar), _note))


def _written(paths: Sequence[Path]) -> int:
    for path in paths:
        print(path, flush=True)
    return OK


def _learn(options: argparse.Namespace) -> int:
    """Solve equation (1) for a problem file or recorded flights."""
    chosen = {name: getattr(options, name) for name in OPTIONS}
    given = recorded_problem(options.dataset, chosen) if options.dataset else read_problem(options.problem, chosen)
    learned = learn(given, options.solver)
    write_result(options.out, learned)
    print(f'{learned.status}, objective {learned.objective:.9g}, {learned.seconds:.3f} s: {options.out}', flush=True)
    if len(learned.contradictory):
        print(_conflict(learned), file=sys.stderr, flush=True)
    return OK if learned.status != 'infeasible' else VERDICT_NO


def _conflict(learned: Learned) -> str:
    rows = learned.contradictory.tolist()
    named = f'{", ".join(map(str, rows[:MOST_NAMED]))}{", ..." if len(rows) > MOST_NAMED else ""}'
    who = f'rows {named} of the advice cannot all hold' if len(rows) > 1 else f'row {named} of the advice cannot hold'
    remedy = 'drop one, or set slack_cost above 0' if learned.status == 'infeasible' else 'field slack says what it costs'
    return f'{who} (rows count from 0); {remedy}'


def _note(sentence: str) -> None:
    print(f'left out: {sentence}', file=sys.stderr, flush=True)


def _progress(bar: Progress) -> Callable[[str, int, int], None]:
    started: dict[str, Any] = {}

    def report(name: str, done: int, total: int) -> None:
        if name not in started:
            started[name] = bar.add_task(name, total=total)
        bar.update(started[name], completed=done)

    return report


def _performer(options: argparse.Namespace) -> runner.Performer:
    if options.dask:
        return runner.OnDask(options.dask)
    return runner.OnCores(options.jobs) if options.jobs > 1 else runner.here


def _parser() -> argparse.ArgumentParser:
    parser = CommandParser(
        prog='experiments', description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(required=True, metavar='COMMAND')
    about = {name: (experiment.about, (name,)) for name, experiment in EXPERIMENTS.items()}
    about['all'] = ('all figures of the paper', tuple(name for name, one in EXPERIMENTS.items() if one.in_all))
    for name, (description, experiments) in about.items():
        _figure_options(_command(commands, name, description, FIGURES_EXIT), experiments)
    about_routes = 'routes over sites whose map does not say all: the learner beside simpler ways, people, recordings'
    _routes_options(_command(commands, 'routes', about_routes, FIGURES_EXIT))
    _learn_options(_command(commands, 'learn', 'equation (1) for a problem of your own (docs/paper.md)'))
    return parser


def _command(commands: Any, name: str, about: str, exits: str = '') -> argparse.ArgumentParser:
    made: argparse.ArgumentParser = commands.add_parser(
        name, help=about, description=about, epilog=EXAMPLES[name] + exits,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    return made


def _figure_options(parser: argparse.ArgumentParser, experiments: tuple[str, ...]) -> None:
    parser.set_defaults(run=_figures, experiments=experiments, method=None)
    parser.add_argument(
        '--domain', nargs='+', action='extend', metavar='NAME',
        help=f'{", ".join(DOMAINS)} (default: all that suit), an .npz file with your own process, or a dataset (docs/paper.md)',
    )
    if 'figure5' in experiments:
        parser.add_argument(
            '--method', nargs='+', action='extend', choices=METHODS, metavar='NAME',
            help=f'of figure 5: {", ".join(METHODS)} (default: all)',
        )
    sailing = '; 250 for cluster quality in Sailing' if 'clusters' in experiments else ''
    parser.add_argument('--trials', type=_positive, metavar='N', help=f'default {TRIALS}{sailing}')
    parser.add_argument('--seed', type=_natural, default=FINAL_SEED, metavar='N', help='of the first trial (default %(default)s)')
    _run_options(parser, 'out/experiments')


def _run_options(parser: argparse.ArgumentParser, out: str) -> None:
    parser.add_argument('--out', default=out, metavar='DIR', help='default %(default)s')
    parser.add_argument('--jobs', type=_positive, default=1, metavar='N', help='processes on this machine (default 1)')
    parser.add_argument('--dask', metavar='ADDRESS', help='run on this Dask cluster instead, e.g. tcp://127.0.0.1:8786')


def _routes_options(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_routes)
    parser.add_argument('--tables', nargs='+', choices=NAMES, default=NAMES, metavar='NAME', help=f'{", ".join(NAMES)}')
    parser.add_argument('--sizes', nargs='+', choices=SIZES, default=tuple(SIZES), metavar='SIZE', help=f'{", ".join(SIZES)}')
    parser.add_argument('--ways', nargs='+', choices=WAY_NAMES, metavar='WAY', help=f'{", ".join(WAY_NAMES)} (default: all)')
    parser.add_argument(
        '--trials', type=_positive, default=ROUTES_TRIALS, metavar='N', help='default %(default)s; half of it from 20x20-8 on',
    )
    parser.add_argument('--seed', type=_natural, default=SEED, metavar='N', help='of the first trial (default %(default)s)')
    parser.add_argument('--page', metavar='FILE', help='where tables go, and beside it the picture (default OUT/routes.md)')
    parser.add_argument('--recordings', default='bags', metavar='DIR', help='recorded flights (default %(default)s)')
    parser.add_argument('--grid', nargs='+', default=GRIDS, metavar='FILE', help=f'their grids (default {" ".join(GRIDS)})')
    _run_options(parser, 'out/routes')


def _learn_options(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_learn)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument('--problem', metavar='FILE', help='.npz: process, demonstrations, advice, options')
    source.add_argument('--dataset', metavar='DIR', help='recorded flights: what discretise --out DIR wrote')
    parser.add_argument('--out', required=True, metavar='FILE', help='.npz: reward, value, q, policy, margins, status')
    parser.add_argument('--solver', default=AUTO, choices=(AUTO, *SOLVERS), help='default %(default)s')
    options = parser.add_argument_group('options (instead of the fields of the same names in the file)')
    options.add_argument(
        '--reading', metavar='R', help=f'{", ".join(READINGS)} (default R3): as printed; advice replaces a*; that, capped',
    )
    for name, about in OPTION_HELP.items():
        options.add_argument('--' + name.replace('_', '-'), type=float, metavar='N', help=about)


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
