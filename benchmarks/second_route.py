"""A second route over a site that was learnt on a first one, with no new flight.

    ./advise python benchmarks/second_route.py [--trials 30] [--seed 700000] [--sizes 6x6-4 12x12-6] [--out FILE.jsonl]

The first route is flown five times with 40 % wrong moves and asked about until nothing is worth asking, --first answers at
most. The second has other waypoints, and its direct ways cross what is hidden. Prints Markdown: per cent of policies that
reach all waypoints in order within twice the best steps and enter no cell that the person wants kept out of, with no answer
and after --second answers, with 95 % Wilson intervals, by what was kept: `planner` (nothing), `flights` (flights and answers,
as site_map_out keeps them), `map` (the probabilities of the cells alone, in whole per cent), `shifted map` (the same map
through cells that are moved by half a cell). After an interruption the same command goes on.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from advise_ros.core.grid.raster import Raster, on_cells
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.session import Session
from advise_ros.core.numerics import Floats
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.plan import plan
from advise_ros.core.site.prior import SitePrior
from advise_ros.experiments.sites import (
    SIZES,
    Site,
    expert_of,
    flights_of,
    judge,
    other_route,
    pilot_of,
    random_site,
    site_with,
)

WAYS = ('planner', 'flights', 'map', 'shifted map')


def interview(site: Site, session: Session, answers: int, rng: np.random.Generator, *, fly_plan: bool) -> list[bool]:
    """Success after 0, 1, ... answers, until nothing is worth asking; of the plan of the belief, or of the policy."""
    expert, curve = expert_of(site, 0.0, rng), list[bool]()
    while True:
        learnt = session.snapshot().run()
        session.adopt(learnt)
        greedy = plan(layout_of(site.grid), learnt.keep_out).greedy if fly_plan else learnt.greedy
        curve.append(judge(site, greedy).success)
        if session.query is None or len(curve) > answers:
            return curve
        session.submit(expert.answer(session.query))


def trial(size: str, seed: int, given: argparse.Namespace) -> dict[str, Any] | None:
    """One site, both routes; None where it has no second one."""
    site = random_site(size, np.random.default_rng([seed, 0]))
    other = other_route(site, np.random.default_rng([seed, 3]))
    if other is None:
        return None
    people, settings = np.random.default_rng([seed, 1]), LearnSettings(acquisition='site', seed=seed)
    first = Session(site.grid, settings)
    for flight in flights_of(site, pilot_of(site, given.pilot, 0.4, 0.2, people), given.flights):
        first.add(flight)
    row: dict[str, Any] = {'first': interview(site, first, given.first, people, fly_plan=given.plan)}
    learned = first.learned
    known = first.kept(learned)
    row['planner'] = [judge(other, site_with(other.grid, np.zeros_like(site.keep_out)).right.argmax(axis=1)).success]
    kept = {'flights': known, 'map': _map(learned.keep_out), 'shifted map': _shifted(other, learned.keep_out)}
    for way, prior in ((way, kept[way]) for way in given.ways):
        begun = time.process_time()
        session, rng = Session(other.grid, settings, prior=prior), np.random.default_rng([seed, 4])
        row[way] = interview(other, session, given.second, rng, fly_plan=given.plan)
        row[f'{way} s'] = round(time.process_time() - begun, 2)
    return row


def _map(keep_out: Floats) -> SitePrior:
    return SitePrior(tuple(np.round(100 * keep_out).astype(int).tolist()))


def _shifted(other: Site, keep_out: Floats) -> SitePrior:
    """The map that another grid, half a cell off, would have kept."""
    grid = other.grid
    half = replace(grid, origin_enu_m=tuple(at - grid.resolution_m / 2 for at in grid.origin_enu_m))
    there = on_cells(Raster(keep_out.reshape(grid.height, grid.width), grid.resolution_m, grid.origin_enu_m), half).mean
    back = on_cells(Raster(there.reshape(grid.height, grid.width), grid.resolution_m, half.origin_enu_m), grid)
    return _map(np.nan_to_num(back.mean))


def cell(hits: list[bool]) -> str:
    low, high = binomtest(sum(hits), len(hits)).proportion_ci(method='wilson')
    return f'{100 * np.mean(hits):.0f} ({100 * low:.0f}-{100 * high:.0f})'


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--trials', type=int, default=30)
    parser.add_argument('--seed', type=int, default=700_000, help='the first; choose one that tuned nothing')
    parser.add_argument('--sizes', nargs='+', choices=SIZES, default=['6x6-4', '8x8-8', '12x12-6', '20x20-8'])
    parser.add_argument('--pilot', choices=('errs', 'shy', 'soft'), default='errs')
    parser.add_argument('--flights', type=int, default=5)
    parser.add_argument('--first', type=int, default=4, help='answers on the first route, at most')
    parser.add_argument('--second', type=int, default=2, help='answers on the second route, at most')
    parser.add_argument('--plan', action='store_true', help='fly the plan of the belief, without equation (1)')
    parser.add_argument('--ways', nargs='+', choices=WAYS[1:], default=list(WAYS[1:]))
    parser.add_argument('--out', type=Path, default=Path('out/second_route.jsonl'))
    given = parser.parse_args()
    given.out.parent.mkdir(parents=True, exist_ok=True)
    given.out.touch()
    rows = [json.loads(line) for line in given.out.read_text().splitlines()]
    ways = ['planner', *given.ways]
    print('| | trials | first route, end | ' + ' | '.join(f'{way}: 0, {given.second}' for way in ways) + ' |')
    print('|---' * (len(ways) + 3) + '|')
    for size in given.sizes:
        case = [size, given.flights, given.pilot, given.first, given.second, given.ways, given.plan]
        for seed in range(given.seed, given.seed + given.trials):
            if not any(row['case'] == case and row['seed'] == seed for row in rows):
                row = {'case': case, 'seed': seed, 'found': trial(size, seed, given)}
                rows.append(row)
                with given.out.open('a') as file:
                    file.write(json.dumps(row) + '\n')
        seeds = range(given.seed, given.seed + given.trials)
        mine = [row['found'] for row in rows if row['case'] == case and row['seed'] in seeds and row['found']]
        at = [f'{cell([row[way][0] for row in mine])}, {cell([row[way][-1] for row in mine])}' for way in ways]
        print(f'| {size} | {len(mine)} | {cell([row["first"][-1] for row in mine])} | {" | ".join(at)} |', flush=True)


if __name__ == '__main__':
    main()
