"""What each setting of the paper's figures is worth: one at a time away from its protocol, on tuning seeds.

    ./advise python benchmarks/sensitivity.py [--domain wumpus sailing] [--trials 40] [--seed 0]

Prints Markdown: performance with 95 % intervals after the number of questions named in the head. Seeds must lie below
those of the published figures, so that no setting is chosen on them.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from advise_ros.experiments.method import METHODS, Protocol
from advise_ros.experiments.protocols import FINAL_SEED, PROTOCOLS
from advise_ros.experiments.statistics import estimate
from advise_ros.experiments.trial import cluster_quality, curves

# Of clusters and of single questions: where the curves are far apart.
POINTS = {'wumpus': (2, 10), 'sailing': (3, 10), 'traffic': (4, 30), 'drone': (3, 30)}
COLUMNS = (('clustered', 0), ('shuffled', 0), ('single', 1), ('random', 1), ('trajectories', 0))


def variants(protocol: Protocol) -> Iterator[tuple[str, Protocol]]:
    """Name and settings of each row."""
    person, terms = protocol.demonstrator, protocol.terms
    yield 'as in the figures', protocol
    for factor in (0.25, 4):
        number = round(factor * person.demonstrations)
        yield f'{number} demonstrations', replace(protocol, demonstrator=replace(person, demonstrations=number))
    together = replace(person, demonstrations=max(1, person.demonstrations // 5), steps=5 * person.steps, restarts='start')
    yield 'five times as long, a fifth as many, from the start', replace(protocol, demonstrator=together)
    for clusters in (protocol.clusters - 1, protocol.clusters + 2, 2 * protocol.clusters):
        yield f'{clusters} clusters', replace(protocol, clusters=clusters)
    yield 'laplace 1', replace(protocol, laplace=1.0)
    for w_p in (0.0, 0.5):
        yield f'w_p {w_p:g}', replace(protocol, w_p=w_p)
    yield 'w_p 0.5, temperature 0.1', replace(protocol, w_p=0.5, temperature=0.1)
    yield 'U_c a sum', replace(protocol, score='sum')
    yield 'no cap (R2)', replace(protocol, terms=terms._replace(margin_cap=0.0))
    yield 'literal, no cap (R1, elastic)', replace(protocol, terms=terms._replace(reading='literal', margin_cap=0.0))
    yield 'expert avoids all others', replace(protocol, expert=replace(protocol.expert, avoid='all_others'))
    yield 'mistakes in the largest kind first', replace(protocol, demonstrator=replace(person, kinds='largest'))
    for share in (0.15, 0.35):
        yield f'mistakes in {share:.0%} of the states', replace(protocol, demonstrator=replace(person, mistake_share=share))


def row(protocol: Protocol, seeds: range) -> list[str]:
    """Quality of the clusters, then each column."""
    methods = tuple(METHODS[name] for name, _ in COLUMNS)
    found = [curves(protocol, methods, seed) for seed in seeds]
    cells = [100.0 * np.array([cluster_quality(protocol, METHODS['clustered'], seed) for seed in seeds])]
    for name, which in COLUMNS:
        place = protocol.points.index(POINTS[protocol.domain][which])
        cells.append(np.array([curve[name][place] for curve in found]))
    return [f'{mean:.3g} ± {ci95:.2g}' for mean, ci95, _ in map(estimate, cells)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--domain', nargs='+', choices=PROTOCOLS, default=list(PROTOCOLS))
    parser.add_argument('--trials', type=int, default=40)
    parser.add_argument('--seed', type=int, default=0, help='of the first trial; the others follow')
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.trials)
    if seeds.stop > FINAL_SEED:
        parser.error(f'seeds from {FINAL_SEED} on are those of the published figures; choose lower ones')
    for domain in options.domain:
        head = [f'{name} ({POINTS[domain][which]})' for name, which in COLUMNS]
        print(f'\n| {domain} | quality [%] | {" | ".join(head)} |\n| --- |{" --- |" * (1 + len(COLUMNS))}', flush=True)
        for name, protocol in variants(PROTOCOLS[domain]):
            print(f'| {name} | {" | ".join(row(protocol, seeds))} |', flush=True)


if __name__ == '__main__':
    main()
