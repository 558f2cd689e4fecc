"""Flights in wind: does a belief from moves that the wind made suffer, and is a plan that knows of the wind worth it?

    ./advise python benchmarks/wind.py [--trials 30] [--seed 43000] [--sizes 6x6-4 12x12-6] [--pilot errs]

Five flights with 40 % wrong moves of the pilot's own; then the wind makes a share of the moves. Prints Markdown: per cent of
plans that are right without wind, learnt from calm and from windy flights; probability that a plan arrives in wind without
being blown into a hidden cell, planned without and with the wind, by the belief from windy flights and by the true map.
"""

from __future__ import annotations

import argparse

import numpy as np

from advise_ros.core.demonstrations.demonstration import count
from advise_ros.core.people.known_site import Site, judge
from advise_ros.core.people.simulated_pilot import SimulatedPilot
from advise_ros.core.site.belief import believe
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.plan import plan
from advise_ros.experiments.sites import SIZES, flights_of, pilot_of, random_site
from advise_ros.experiments.wind import BlownPilot, success_in_wind

SLIPS = (0.0, 0.1, 0.2)


def trial(size: str, kind: str, slip: float, seed: int) -> list[float]:
    """Right from calm flights, from windy ones; success in wind by the belief without, with wind; by the map without, with."""
    site = random_site(size, np.random.default_rng([seed, 0]))
    layout, wind = layout_of(site.grid), np.random.default_rng([seed, 5])
    calm = learnt(site, pilot_of(site, kind, 0.4, 0.2, np.random.default_rng([seed, 1])), seed)
    windy = learnt(site, BlownPilot(pilot_of(site, kind, 0.4, 0.2, np.random.default_rng([seed, 1])), slip, wind), seed)
    right = [float(judge(site, plan(layout, weights).greedy).success) for weights in (calm, windy)]
    plans = [plan(layout, weights, known).greedy for weights in (windy, site.keep_out.astype(float)) for known in (0.0, slip)]
    return [*right, *(success_in_wind(site, greedy, slip) for greedy in plans)]


def learnt(site: Site, pilot: SimulatedPilot, seed: int) -> np.ndarray:
    taken = count(site.grid, flights_of(site, pilot, 5)).taken
    return believe(layout_of(site.grid), taken, (), np.random.default_rng([seed, 2])).expected


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--trials', type=int, default=30)
    parser.add_argument('--seed', type=int, default=43_000, help='the first; choose one that tuned nothing')
    parser.add_argument('--sizes', nargs='+', choices=SIZES, default=['6x6-4', '12x12-6'])
    parser.add_argument('--pilot', choices=('errs', 'shy', 'soft'), default='errs')
    given = parser.parse_args()
    print('| site | trials | wind | right: calm flights | windy flights | in wind: without | with | true map: without | with |')
    print('|---' * 9 + '|')
    for size in given.sizes:
        for slip in SLIPS:
            rows = [trial(size, given.pilot, slip, given.seed + at) for at in range(given.trials)]
            shares = ' | '.join(f'{share:.0%}' for share in np.mean(rows, axis=0))
            print(f'| {size} | {len(rows)} | {slip:.0%} | {shares} |', flush=True)


if __name__ == '__main__':
    main()
