"""What each setting of the paper's figures is worth: one at a time away from its protocol, on tuning seeds.

    ./advise python benchmarks/sensitivity.py [--domain wumpus sailing] [--trials 40] [--seed 0] [--jobs 2]

Prints Markdown: performance with 95 % intervals after the number of questions named in the head. Seeds must lie below
those of the published figures, so that no setting is chosen on them. After an interruption the same command goes on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from tuning import parse

from advise_ros.core.numerics import Floats
from advise_ros.experiments.figures import Trials, stored, tasks
from advise_ros.experiments.method import METHODS, Method, Protocol
from advise_ros.experiments.protocols import PROTOCOLS
from advise_ros.experiments.runner import Performer, run
from advise_ros.experiments.statistics import estimate
from advise_ros.experiments.store import Store

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
    if protocol.domain == 'traffic':  # The paper's quality of clusters, 69.58 %, by want of demonstrations.
        for number, clusters in ((100, 10), (200, 8)):
            few = replace(person, demonstrations=number)
            yield f'{number} demonstrations, {clusters} clusters', replace(protocol, demonstrator=few, clusters=clusters)
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


class Bench(NamedTuple):
    """Where trials are kept and run."""

    store: Store
    performer: Performer
    trials: Trials

    def results(self, kind: str, protocol: Protocol, methods: tuple[Method, ...]) -> Iterator[Floats]:
        """(trials, ...) of each method."""
        run(tasks(kind, protocol, methods, self.trials), self.store, self.performer, lambda *_: None)
        return (stored(self.store, kind, protocol, method, self.trials) for method in methods)


def row(protocol: Protocol, bench: Bench) -> list[str]:
    """Quality of the clusters, then each column; nothing is learnt that no column shows."""
    points = POINTS[protocol.domain]
    methods = tuple(replace(METHODS[name], budget=points[which]) for name, which in COLUMNS)
    (quality,) = bench.results('quality', protocol, (METHODS['clustered'],))
    curves = bench.results('curves', replace(protocol, points=(0, *points)), methods)
    cells = [100.0 * quality, *(curve[:, -1] for curve in curves)]
    return [f'{mean:.3g} ± {ci95:.2g}' for mean, ci95, _ in map(estimate, cells)]


def main() -> None:
    domains, trials, performer, path = parse(str(__doc__), 'sensitivity', tuple(PROTOCOLS), 0)
    with Store(path) as store:
        bench = Bench(store, performer, trials)
        for domain in domains:
            head = [f'{name} ({POINTS[domain][which]})' for name, which in COLUMNS]
            print(f'\n| {domain} | quality [%] | {" | ".join(head)} |\n| --- |{" --- |" * (1 + len(COLUMNS))}', flush=True)
            for name, protocol in variants(PROTOCOLS[domain]):
                print(f'| {name} | {" | ".join(row(protocol, bench))} |', flush=True)


if __name__ == '__main__':
    main()
