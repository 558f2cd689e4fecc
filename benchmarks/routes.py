"""Routes over sites whose map does not say all: what is learnt of them, beside simpler ways, on the same flights.

    ./advise python benchmarks/routes.py [--trials 30] [--seed 500000] [--sizes 6x6-4 12x12-6] [--out out/routes.jsonl]

Prints Markdown: per cent of policies that reach all waypoints in order within twice the best steps and enter no cell that
the person wants kept out of, after so many answers, with 95 % Wilson intervals; then the questions asked until nothing is
worth asking, and seconds of processor time. Ways: `planner` (shortest way to the next waypoint), `cloning` (the most frequent
action, elsewhere the shortest way to a state that was flown), `occupancy` (the paper's algorithm with the node's defaults),
`site` (acquisition `site`: equation (1) with the believed actions), `site-plan` (the plan of the same belief). After an
interruption the same command goes on.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest

from advise_ros.core.demonstrations.demonstration import Demonstration, count
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.session import Session
from advise_ros.core.numerics import Bools, Ints
from advise_ros.core.people.simulated_expert import SimulatedExpert
from advise_ros.core.planning.process import successors
from advise_ros.core.planning.rollout import optimal_table
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.plan import plan
from advise_ros.experiments.sites import SIZES, Site, expert_of, flights_of, judge, pilot_of, random_site

POINTS = (0, 1, 2, 3, 4, 6, 8, 10)
MOST_ANSWERS = 10


class Case(NamedTuple):
    """Who flies and answers where."""

    size: str
    hidden: bool
    pilot: str
    noise: float
    errors: float
    flights: int


class Trial(NamedTuple):
    """The same site, flights and person for every way."""

    site: Site
    flights: tuple[Demonstration, ...]
    expert: SimulatedExpert
    rng: np.random.Generator
    seed: int


def trial_of(case: Case, seed: int) -> Trial:
    people, learner = np.random.default_rng([seed, 1]), np.random.default_rng([seed, 2])
    site = random_site(case.size, np.random.default_rng([seed, 0]), hidden=case.hidden)
    pilot = pilot_of(site, case.pilot, case.noise, 0.2, people)
    return Trial(site, flights_of(site, pilot, case.flights), expert_of(site, case.errors, people), learner, seed)


def planner(trial: Trial) -> list[bool]:
    options = optimal_table(trial.site.grid)
    greedy = np.array([trial.rng.choice(np.flatnonzero(row)) if row.any() else 0 for row in options])
    return [judge(trial.site, greedy).success]


def cloning(trial: Trial) -> list[bool]:
    counts = count(trial.site.grid, trial.flights)
    favourite = counts.favourite()
    greedy = np.where(favourite >= 0, favourite, _toward(successors(trial.site.grid), counts.visits > 0))
    return [judge(trial.site, greedy).success]


def _toward(there: Ints, known: Bools) -> Ints:
    """(states,) the action of a shortest way to a known state."""
    distance = np.where(known, 0, len(known))
    while True:
        nearer = np.minimum(distance, distance[there].min(axis=1) + 1)
        if np.array_equal(nearer, distance):
            return distance[there].argmin(axis=1)
        distance = nearer


def occupancy(trial: Trial) -> list[bool]:
    return _interview(trial, 'occupancy')


def site(trial: Trial) -> list[bool]:
    return _interview(trial, 'site')


def site_plan(trial: Trial) -> list[bool]:
    """The plan of the belief, without equation (1), asked as `site` asks."""
    return _interview(trial, 'site', fly_plan=True)


def _interview(trial: Trial, acquisition: str, *, fly_plan: bool = False) -> list[bool]:
    """Success after 0, 1, ... answers, until nothing is worth asking."""
    layout = layout_of(trial.site.grid)
    session = Session(trial.site.grid, LearnSettings(acquisition=acquisition, seed=trial.seed), -1)
    for flight in trial.flights:
        session.add(flight)
    curve: list[bool] = []
    while True:
        learnt = session.snapshot().run()
        session.adopt(learnt)
        greedy = plan(layout, learnt.keep_out).greedy if fly_plan else learnt.greedy
        curve.append(judge(trial.site, greedy).success)
        if session.query is None or len(curve) > MOST_ANSWERS:
            return curve
        session.submit(trial.expert.answer(session.query))


WAYS: dict[str, Callable[[Trial], list[bool]]] = {
    'planner': planner, 'cloning': cloning, 'occupancy': occupancy, 'site': site, 'site-plan': site_plan,
}


def run(case: Case, ways: list[str], seeds: range, out: Path) -> list[dict[str, Any]]:
    """All trials of a case; what stands in the file is not run again."""
    out.parent.mkdir(parents=True, exist_ok=True)
    out.touch()
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    known = {(tuple(row['case']), row['way'], row['seed']) for row in rows}
    for seed, way in product(seeds, ways):
        if (tuple(case), way, seed) in known:
            continue
        begun = time.process_time()
        curve = WAYS[way](trial_of(case, seed))
        row = {'case': list(case), 'way': way, 'seed': seed, 'curve': curve, 's': round(time.process_time() - begun, 3)}
        rows.append(row)
        with out.open('a') as file:
            file.write(json.dumps(row) + '\n')
    return [row for row in rows if row['case'] == list(case) and row['seed'] in seeds]


def cell(hits: list[bool]) -> str:
    """Per cent and its interval."""
    low, high = binomtest(sum(hits), len(hits)).proportion_ci(method='wilson')
    return f'{100 * np.mean(hits):.0f} ({100 * low:.0f}-{100 * high:.0f})'


def table(rows: list[dict[str, Any]], ways: list[str]) -> str:
    """Markdown lines of one case."""
    lines = []
    for way in ways:
        mine = [row for row in rows if row['way'] == way]
        if mine:
            at = [cell([row['curve'][min(point, len(row['curve']) - 1)] for row in mine]) for point in POINTS]
            asked, seconds = np.mean([len(row['curve']) - 1 for row in mine]), np.mean([row['s'] for row in mine])
            lines.append(f'| {way} | {len(mine)} | {" | ".join(at)} | {asked:.1f} | {seconds:.2f} |')
    return '\n'.join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--trials', type=int, default=30)
    parser.add_argument('--seed', type=int, default=500_000, help='the first; choose one that tuned nothing')
    parser.add_argument('--sizes', nargs='+', choices=SIZES, default=['6x6-4', '8x8-3', '8x8-8', '12x12-6'])
    parser.add_argument('--ways', nargs='+', choices=WAYS, default=list(WAYS))
    parser.add_argument('--pilot', choices=('errs', 'shy', 'soft'), default='errs')
    parser.add_argument('--noise', type=float, default=0.4, help='share of wrong moves')
    parser.add_argument('--errors', type=float, default=0.0, help='share of wrong answers')
    parser.add_argument('--flights', type=int, default=5)
    parser.add_argument('--nothing-hidden', action='store_true', help='the map says all')
    parser.add_argument('--out', type=Path, default=Path('out/routes.jsonl'))
    given = parser.parse_args()
    for size in given.sizes:
        case = Case(size, not given.nothing_hidden, given.pilot, given.noise, given.errors, given.flights)
        rows = run(case, given.ways, range(given.seed, given.seed + given.trials), given.out)
        print(f'\n**{size}**, {given.pilot}, {given.noise:.0%} wrong moves, {given.flights} flights\n')
        print(f'| | trials | {" | ".join(map(str, POINTS))} | asked | s |')
        print('|---' * (len(POINTS) + 4) + '|')
        print(table(rows, given.ways), flush=True)


if __name__ == '__main__':
    main()
