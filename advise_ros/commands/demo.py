"""The whole loop in one command: rough flights, a first policy, questions, a better policy, a replayed bag."""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

from advise_ros.config import AdviseConfig, LoggerConfig
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.learning.learner import learn
from advise_ros.demo.console import DemoConsole
from advise_ros.demo.graph import refuse_a_second_graph
from advise_ros.demo.options import DemoOptions, check_parameters, node_config, share
from advise_ros.demo.out import out_directory, refuse_a_full_disk, refuse_what_holds_something
from advise_ros.demo.story import DemoSession, Story
from advise_ros.demo.summary import DemoOutcome, page_values, rate, table
from advise_ros.demo.trials import TrialPool, trial_settings
from advise_ros.exits import INTERRUPTED, OK, VERDICT_NO, fail
from advise_ros.fair_clock import cpu_s
from advise_ros.recording.gridfile import load_grid
from advise_ros.report import page
from advise_ros.ros.arguments import check_environment
from advise_ros.ros.run import exit_now
from advise_ros.settings import learn_settings
from advise_ros.supervisor import Child, Supervisor, executable

EXAMPLES = """examples:
  ./advise demo                        the whole story, about a minute
  ./advise demo --expert human         you answer the questions yourself
  ./advise demo --seed 7 --flights 8   another pilot, more demonstrations
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
    parser = argparse.ArgumentParser(
        prog='demo', description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--expert', choices=('simulated', 'human'), default='simulated', help='who answers')
    parser.add_argument('--seed', type=int, default=0, help='seed of the pilot, the expert and the wind (default %(default)s)')
    parser.add_argument('--flights', type=int, default=3, help='demonstrations to fly (default %(default)s)')
    parser.add_argument('--answers', type=int, default=6, help='questions to answer (default %(default)s)')
    parser.add_argument(
        '--seeds-flown', type=int, default=None, help='learning sessions to fly (default 3; 1 when a person answers)',
    )
    parser.add_argument('--trials', type=int, default=100, help='seeds on the grid model (default %(default)s)')
    parser.add_argument('--speedup', type=float, default=20.0, help='simulated seconds a second (default %(default)s)')
    parser.add_argument('--grid', type=Path, default=share('grid_demo.yaml'), help='grid file')
    parser.add_argument('--params-file', type=Path, default=share('demo.yaml'), help='node parameters')
    parser.add_argument('--out', type=Path, default=None, help='directory of the results (default out/demo-DATE-TIME)')
    given = parser.parse_args(argv)
    if given.expert == 'human' and (given.seeds_flown or 1) != 1:
        raise InputError(f'--seeds-flown is {given.seeds_flown}, but a person answers in one session only; leave it out')
    if given.seeds_flown is None:
        given.seeds_flown = 1 if given.expert == 'human' else 3
    for name, low in (('flights', 1), ('answers', 1), ('seeds_flown', 1), ('trials', 2)):
        if getattr(given, name) < low:
            raise InputError(f'--{name.replace("_", "-")} is {getattr(given, name)}; it must be {low} or more')
    if not 0.1 <= given.speedup <= 100:
        raise InputError(f'--speedup is {given.speedup}; it must be 0.1 to 100')
    if not 0 <= given.seed <= SEED_MAX:
        raise InputError(f'--seed is {given.seed}; it must be 0 to {SEED_MAX}')
    out = given.out or Path('out') / time.strftime('demo-%Y%m%d-%H%M%S')
    refuse_what_holds_something(out)
    return DemoOptions(
        given.expert, given.seed, given.flights, given.answers, given.seeds_flown, given.trials, given.speedup,
        given.grid.resolve(), given.params_file.resolve(), out.resolve(),
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
    grid = load_grid(options.grid_file)
    check_parameters(options)
    refuse_a_full_disk(options.out, node_config(options.params_file, 'logger', LoggerConfig).min_free_mib)
    pool = TrialPool()
    try:
        with out_directory(options.out), Supervisor(options.out / 'logs') as supervisor:
            story = Story(options, grid, supervisor, console)
            try:
                return _run_story(options, story, Tools(supervisor, pool, console))
            finally:
                story.close()
    finally:
        pool.close()


def _run_story(options: DemoOptions, story: Story, tools: Tools) -> int:
    time.sleep(DISCOVERY_S)
    refuse_a_second_graph(story.client.node.get_node_names())
    bag = options.out / 'bag'
    settings, seeds = trial_settings(options), range(options.seed, options.seed + options.trials)
    by_person = options.expert == 'human'
    story.start()
    if not by_person:
        tools.pool.start(story.grid, settings, seeds)
    sessions = [story.flown_session(bag)]
    if by_person:
        tools.pool.start(story.grid, settings, seeds, sessions[0].log)
    replay = tools.supervisor.start('replay', [str(executable('replay')), str(bag)], may_end=True, fatal=False)
    further = range(options.seed + 1, options.seed + options.seeds_flown)
    sessions += [story.model_session(seed, options.out) for seed in further]
    return _close(options, story, tools, sessions, replay)


def _close(options: DemoOptions, story: Story, tools: Tools, sessions: list[DemoSession], replay: Child) -> int:
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
    outcome = story_outcome(options, story, tools, sessions, code)
    report = page.write(options.out, page_values(outcome))
    tools.console.rich.print()
    tools.console.rich.print(table(outcome))
    tools.console.rich.print(f'Report: {report}\nBag:    {outcome.bag}\nLogs:   {options.out / "logs"}', markup=False)
    if code != OK:
        tools.console.rich.print('[red]The bag does not replay:[/red]')
        tools.console.rich.print(replay.last_lines(), markup=False)
    return OK if outcome.good else VERDICT_NO


def story_outcome(options: DemoOptions, story: Story, tools: Tools, sessions: list[DemoSession], replay_code: int) -> DemoOutcome:
    """All results of a run in one value."""
    main_session = sessions[0]
    settings = learn_settings(
        replace(node_config(options.params_file, 'advise', AdviseConfig), grid_file='', seed=options.seed),
    )
    trials = tools.pool.results()
    return DemoOutcome(
        sessions=sessions,
        tracks=story.tracks,
        log=main_session.log,
        before=learn(story.grid, settings, main_session.demonstrations, ()),
        after=learn(story.grid, settings, main_session.demonstrations, main_session.log),
        rate_before=rate([trial.before for trial in trials]),
        rate_after=rate([trial.after for trial in trials]),
        answers_mean=sum(trial.answers for trial in trials) / len(trials),
        first_trial_seed=options.seed,
        by_person=options.expert == 'human',
        replay_equal=replay_code == OK,
        seconds=tools.console.seconds,
        bag=options.out / 'bag',
    )


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
