"""The whole loop in one command: rough flights round a garden on no map, a policy, questions, another route, a replayed bag."""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from advise_ros.command_line import CommandParser
from advise_ros.config import LoggerConfig
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.demo.console import DemoConsole
from advise_ros.demo.graph import refuse_a_second_graph
from advise_ros.demo.options import DemoOptions, check_parameters, load_sites, node_config, share
from advise_ros.demo.out import out_directory, refuse_a_full_disk, refuse_what_holds_something
from advise_ros.demo.story import DemoFlight, DemoSession, Story
from advise_ros.demo.summary import DemoOutcome, page_values, table
from advise_ros.demo.trials import TrialPool, trial_settings
from advise_ros.exits import INTERRUPTED, OK, VERDICT_NO, fail
from advise_ros.fair_clock import cpu_s
from advise_ros.report import page
from advise_ros.ros.arguments import check_environment
from advise_ros.ros.run import exit_now
from advise_ros.supervisor import Child, Supervisor, executable

EXAMPLES = """examples:
  ./advise demo                        the whole story, some minutes
  ./advise demo --expert human         you answer the questions yourself
  ./advise demo --seed 7 --flights 6   another pilot, more demonstrations
  ./advise demo --trials 20            how often it goes well: ten seconds more for each seed
  make demo EXPERT=human SEED=7        the same through make

Next: open OUT/report.html; ./advise replay OUT/bag -p advise.clusters:=8 shows what another parameter would have changed.

exit code: 0 the story holds; 1 it does not, or something in it failed; 2 wrong usage; 130 interrupted
"""
# What computes is waited for as long as it goes on; when it has used no processor for this long, it hangs.
COMPUTE_PATIENCE_S = 300.0
# Another graph in this domain shows itself within this time.
DISCOVERY_S = 0.5
# The seeds of the trials and of the nodes count up from the given one and stay in the parameters' range.
SEED_MAX = 2**30


def parse(argv: list[str] | None = None) -> DemoOptions:
    """Options of the command line.

    Raises:
        InputError: a file does not exist or a number is out of range.
    """
    parser = CommandParser(
        prog='demo', description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--expert', choices=('simulated', 'human'), default='simulated', help='who answers')
    parser.add_argument('--seed', type=int, default=0, help='seed of the pilot, the expert and the wind (default %(default)s)')
    parser.add_argument('--flights', type=int, default=2, help='demonstrations to fly (default %(default)s)')
    parser.add_argument('--answers', type=int, default=4, help='questions to answer (default %(default)s)')
    parser.add_argument(
        '--trials', type=int, default=0, help='seeds on the grid model that give success rates (default %(default)s)',
    )
    parser.add_argument('--speedup', type=float, default=20.0, help='simulated seconds a second (default %(default)s)')
    parser.add_argument('--grid', type=Path, default=None, help="grid file (default: the demo's, with its other two files)")
    parser.add_argument('--other-grid', type=Path, default=None, help='another route over the same site, flown in the end')
    parser.add_argument('--wish', type=Path, default=None, help='cells that the simulated people want kept out of')
    parser.add_argument('--params-file', type=Path, default=share('demo.yaml'), help='node parameters')
    parser.add_argument('--out', type=Path, default=None, help='directory of the results (default out/demo-DATE-TIME)')
    given = parser.parse_args(argv)
    for name, low in (('flights', 1), ('answers', 1), ('trials', 0)):
        if getattr(given, name) < low:
            raise InputError(f'--{name} is {getattr(given, name)}; it must be {low} or more')
    if not 0.1 <= given.speedup <= 100:
        raise InputError(f'--speedup is {given.speedup}; it must be 0.1 to 100')
    if not 0 <= given.seed <= SEED_MAX:
        raise InputError(f'--seed is {given.seed}; it must be 0 to {SEED_MAX}')
    out = given.out or Path('out') / time.strftime('demo-%Y%m%d-%H%M%S')
    refuse_what_holds_something(out)
    grid, other, wish = given.grid, given.other_grid, given.wish
    if grid is None:
        grid, other, wish = share('grid_demo.yaml'), other or share('grid_demo_other.yaml'), wish or share('garden.yaml')
    return DemoOptions(
        given.expert, given.seed, given.flights, given.answers, given.trials, given.speedup, grid.resolve(),
        given.params_file.resolve(), out.resolve(), other and other.resolve(), wish and wish.resolve(),
    )


@dataclass(frozen=True)
class Tools:
    """What a run works with beside the story."""

    supervisor: Supervisor
    pool: TrialPool
    console: DemoConsole


def run(options: DemoOptions, console: DemoConsole) -> int:
    """Run the story and report; returns the exit code.

    Raises:
        InputError: the run was refused, and nothing of it is left.
        AdviseError: something in it failed.
    """
    sites = load_sites(options)
    check_parameters(options.params_file)
    refuse_a_full_disk(options.out, node_config(options.params_file, 'logger', LoggerConfig).min_free_mib)
    pool = TrialPool()
    try:
        with out_directory(options.out), Supervisor(options.out / 'logs') as supervisor:
            story = Story(options, sites, supervisor, console)
            try:
                return _run_story(options, story, Tools(supervisor, pool, console))
            finally:
                story.close()
    finally:
        pool.close()


def _run_story(options: DemoOptions, story: Story, tools: Tools) -> int:
    time.sleep(DISCOVERY_S)
    refuse_a_second_graph(story.client.node, simulated_time=options.speedup != 1.0)
    bag = options.out / 'bag'
    grid, settings = story.sites.shown.grid, trial_settings(options)
    seeds = range(options.seed, options.seed + options.trials)
    by_person = options.expert == 'human'
    story.start()
    if not by_person:
        tools.pool.start(grid, settings, seeds)
    session = story.flown_session(bag)
    if by_person:
        tools.pool.start(grid, settings, seeds, session.log)
    replay = tools.supervisor.start('replay', [str(executable('replay')), str(bag)], may_end=True, fatal=False)
    other = None if story.sites.other is None else story.other_session(story.sites.other)
    return _close(options, story, tools, (session, other), replay)


def _close(
    options: DemoOptions, story: Story, tools: Tools, flown: tuple[DemoSession, DemoFlight | None], replay: Child,
) -> int:
    """Wait for what still computes, write the report, print the table."""
    with tools.console.bar('trials on the grid model', options.trials) as bar:
        story.client.wait(
            'the trials', lambda: bar.at(tools.pool.done) and tools.pool.done == options.trials, COMPUTE_PATIENCE_S,
            tools.pool.progress,
        )
    story.client.wait(
        'the replay of the bag', lambda: replay.process.poll() is not None, COMPUTE_PATIENCE_S,
        lambda: cpu_s(replay.process.pid),
    )
    code = replay.process.wait()
    outcome = DemoOutcome(
        story.sites, *flown, story.tracks, tools.pool.results(), options.seed, options.expert == 'human', code == OK,
        tools.console.seconds, options.out / 'bag',
    )
    report = page.write(options.out, page_values(outcome))
    tools.console.rich.print()
    tools.console.rich.print(table(outcome))
    tools.console.rich.print(f'Replay of the bag: {outcome.replay_text}; the whole demo took {outcome.seconds:.0f} s')
    tools.console.rich.print(f'Report: {report}\nBag:    {outcome.bag}\nLogs:   {options.out / "logs"}', markup=False)
    if code != OK:
        tools.console.rich.print('[red]The bag does not replay:[/red]')
        tools.console.rich.print(replay.last_lines(), markup=False)
    return OK if outcome.good else VERDICT_NO


def main() -> None:
    """Entry point of `demo`."""
    try:
        options = parse()
        check_environment()
        code = run(options, DemoConsole())
    except InputError as problem:
        code = fail(str(problem))
    except AdviseError as problem:
        code = fail(str(problem), VERDICT_NO)
    except KeyboardInterrupt:
        print('stopped; every process of the demo has ended', file=sys.stderr, flush=True)
        code = INTERRUPTED
    exit_now(code)
