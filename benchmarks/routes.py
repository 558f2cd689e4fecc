"""One kind of person on routes, chosen by options, for tuning; the published tables are `./advise experiments routes`.

    ./advise python benchmarks/routes.py [--trials 30] [--seed 41000] [--sizes 6x6-4 12x12-6] [--ways site] [--pilot soft]

Prints Markdown as the page has it; what each way is: advise_ros/experiments/routes/ways.py. Results are kept by the code of
`core/`: after an interruption the same command goes on, and after a change of that code it begins again.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from advise_ros.experiments.figures import Trials
from advise_ros.experiments.routes.cases import RouteCase
from advise_ros.experiments.routes.tables import Line, RouteTable, markdown, tasks
from advise_ros.experiments.routes.ways import SECOND_WAYS, WAY_NAMES, WAYS
from advise_ros.experiments.runner import OnCores, run
from advise_ros.experiments.sites import SIZES
from advise_ros.experiments.store import Store


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--trials', type=int, default=30, help='half of it from 20x20-8 on')
    parser.add_argument('--seed', type=int, default=41_000, help='of the first trial')
    parser.add_argument('--sizes', nargs='+', choices=SIZES, default=['6x6-4', '8x8-3', '8x8-8', '12x12-6'])
    parser.add_argument('--ways', nargs='+', choices=WAY_NAMES, default=['planner', 'site'])
    parser.add_argument('--pilot', choices=('errs', 'shy', 'soft'), default='errs')
    parser.add_argument('--noise', type=float, default=0.4, help='share of wrong moves')
    parser.add_argument('--errors', type=float, default=0.0, help='share of wrong answers')
    parser.add_argument('--flights', type=int, default=5)
    parser.add_argument('--given-up', type=int, default=0, help='how many of these end half-way')
    parser.add_argument('--people', type=int, choices=(1, 2), default=1, help='who fly in turn, with other wishes each')
    parser.add_argument('--second', action='store_true', help='judge another route over the site, without a flight of its own')
    parser.add_argument('--nothing-hidden', action='store_true', help='the map says all')
    parser.add_argument('--jobs', type=int, default=1, help='processes')
    parser.add_argument('--out', type=Path, default=Path('out/routes/trials.jsonl'), help='file of results')
    given = parser.parse_args()
    lines = tuple(
        Line(size, RouteCase(
            size, not given.nothing_hidden, given.pilot, given.noise, given.errors, given.flights, given.given_up, given.people,
            given.second,
        ))
        for size in given.sizes
    )
    ways = tuple(way for way in given.ways if way in (SECOND_WAYS if given.second else WAYS))
    table, trials = RouteTable('', lines, ways), Trials(given.trials, given.seed)
    with Store(given.out) as store:
        run(tasks(table, trials), store, OnCores(given.jobs), lambda done, total: None)
        print(markdown(table, store, trials))


if __name__ == '__main__':
    main()
