"""Which way to ask suits flights from the start: `occupancy` or `gain` by beliefs, however few the moves are.

    ./advise python benchmarks/asking.py [--trials 30] [--seed 50000] [--out out/asking.jsonl]

Both ask about the same flights, with the node's other defaults. The pilot makes the same mistake again and again in a
fifth of the states, spread over the grid (and 40 % wrong moves in all), or in a square of cells a waypoint (and 15 %
wrong moves elsewhere). Prints Markdown: policies that reach the goal, in per cent with 95 % Wilson intervals, by
`occupancy` / by `gain`; then what `gain` adds to their mean after 1 to 10 answers, by moves a state. After an
interruption the same command goes on.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
from scipy.stats import t

from advise_ros.core.demonstrations.demonstration import Demonstration, count
from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.tables import occurring, successors
from advise_ros.core.learning import algorithm
from advise_ros.core.numerics import Bools
from advise_ros.core.people.simulated_pilot import SimulatedPilot, demonstrate
from advise_ros.core.people.trial import TrialSettings, follow
from advise_ros.core.planning.rollout import optimal_table
from advise_ros.core.statistics import share_in_words
from advise_ros.recording.gridfile import load_grid

FOUR = load_grid(Path(__file__).parent.parent / 'config/grid_6x6.yaml')
ROUTES = {
    '6 x 6, 4 waypoints': FOUR,
    '8 x 8, 3 waypoints': replace(FOUR, width=8, height=8, waypoints=(1 * 8 + 7, 6 * 8 + 2, 0)),
}
WAYS = ('occupancy', 'gain')
FLIGHTS = (5, 10, 20, 40)
POINTS = (1, 2, 3, 4, 6, 10)
# Cells along a square, and the share of wrong moves outside of the squares.
SQUARE, OUTSIDE = 3, 0.15
BOUNDS = (0.0, 3.0, 5.0, 7.0, 9.0, 15.0, 30.0, np.inf)


@dataclass(frozen=True)
class Case:
    """Who flies what how often, and who answers."""

    route: str
    mistakes: str
    errors: float
    flights: int


def cases() -> Iterator[Case]:
    """All that are compared."""
    four, three = ROUTES
    for route, mistakes, errors in ((four, 'spread', 0.0), (four, 'squares', 0.0), (four, 'spread', 0.1), (three, 'spread', 0.0)):
        yield from (Case(route, mistakes, errors, flights) for flights in FLIGHTS)


def wrong_moves(grid: Grid) -> Bools:
    """(n, n_actions) to another, free cell, but on no shortest way."""
    there = successors(grid) % grid.n_cells
    elsewhere = there != (np.arange(grid.n_states) % grid.n_cells)[:, None]
    return elsewhere & ~np.isin(there, grid.blocked) & ~optimal_table(grid) & occurring(grid)[:, None]


def squares(grid: Grid, rng: np.random.Generator) -> dict[int, int]:
    """State -> mistake: one square a waypoint, in whose states the same move is made wherever it is wrong."""
    wrong, mistakes = wrong_moves(grid), {}
    for layer in range(grid.n_layers):
        east, north = int(rng.integers(0, grid.width - SQUARE + 1)), int(rng.integers(0, grid.height - SQUARE + 1))
        states = [
            layer * grid.n_cells + y * grid.width + x
            for x, y in product(range(east, east + SQUARE), range(north, north + SQUARE))
        ]
        votes = wrong[states].sum(axis=0)
        action = int(rng.choice(np.flatnonzero(votes >= max(1, votes.max() // 2))))
        mistakes.update({state: action for state in states if wrong[state, action]})
    return mistakes


def flown(case: Case, settings: TrialSettings, rng: np.random.Generator) -> tuple[Demonstration, ...]:
    """The flights of one pilot."""
    grid = ROUTES[case.route]
    if case.mistakes == 'squares':
        pilot = SimulatedPilot(grid, OUTSIDE, 0.0, rng)
        pilot.mistakes = squares(grid, rng)
    else:
        pilot = SimulatedPilot(grid, settings.noise_rate, settings.mistake_share, rng)
    return tuple(demonstrate(grid, pilot, index, settings.max_moves) for index in range(case.flights))


def trial(case: Case, seed: int) -> dict[str, object]:
    """Moves a state, and success after 0, 1, ... 10 answers for each way to ask."""
    grid, settings = ROUTES[case.route], TrialSettings(flights=case.flights, error_rate=case.errors)
    flights = flown(case, settings, np.random.default_rng(seed))
    curves = {}
    for way in WAYS:
        asking = replace(settings, learn=replace(settings.learn, acquisition=way))
        curve = follow(grid, asking, flights, np.random.default_rng([seed, 1]), seed)
        curves[way] = [int(curve[min(point, len(curve) - 1)]) for point in range(settings.answers + 1)]
    moves = float(count(grid, flights).visits[occurring(grid)].mean())
    return {'case': asdict(case), 'seed': seed, 'moves': moves, **curves}


def run(trials: int, seed: int, out: Path) -> list[dict]:
    """Trials of all cases; what the file has already is not run again."""
    out.parent.mkdir(parents=True, exist_ok=True)
    out.touch()
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    known = {(Case(**row['case']), row['seed']): row for row in rows}
    wanted = [(case, one) for one in range(seed, seed + trials) for case in cases()]
    for case, one in wanted:
        if (case, one) not in known:
            known[case, one] = trial(case, one)
            with out.open('a') as file:
                file.write(json.dumps(known[case, one]) + '\n')
    return [known[key] for key in wanted]


def show_rates(rows: list[dict]) -> None:
    """A line for each case, both ways in each cell."""
    print('| route | mistakes | answers wrong | flights (moves a state) |', ' | '.join(f'after {n}' for n in POINTS), '|')
    print('|', ' | '.join(['---'] * (4 + len(POINTS))), '|')
    for case in cases():
        mine = [row for row in rows if row['case'] == asdict(case)]
        moves = np.mean([row['moves'] for row in mine])
        hits = [[sum(row[way][point] for row in mine) for way in WAYS] for point in POINTS]
        rates = ' | '.join(' / '.join(share_in_words(number, len(mine)) for number in numbers) for numbers in hits)
        print(f'| {case.route} | {case.mistakes} | {case.errors:.0%} | {case.flights} ({moves:.0f}) | {rates} |')


def show_moves(rows: list[dict]) -> None:
    """What `gain` adds, by moves a state."""
    print('\n| moves a state | trials | occupancy, mean of 1-10 | gain adds |\n| --- | --- | --- | --- |')
    for low, high in pairwise(BOUNDS):
        mine = [row for row in rows if low <= row['moves'] < high]
        if len(mine) > 1:
            usual, beliefs = (100 * np.array([row[way][1:] for row in mine]).mean(axis=1) for way in WAYS)
            added = beliefs - usual
            half = t.ppf(0.975, len(added) - 1) * added.std(ddof=1) / np.sqrt(len(added))
            print(f'| {low:g} to {high:g} | {len(mine)} | {usual.mean():.0f} | {added.mean():.0f} ± {half:.0f} |')


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--trials', type=int, default=30)
    parser.add_argument('--seed', type=int, default=50_000, help='of the first trial; the others follow')
    parser.add_argument('--out', type=Path, default=Path('out/asking.jsonl'), help='JSON lines, one a trial')
    options = parser.parse_args()
    algorithm.MOVES = 0.0  # Beliefs decide, however little they rest on: that is the question.
    rows = run(options.trials, options.seed, options.out)
    show_rates(rows)
    show_moves(rows)


if __name__ == '__main__':
    main()
