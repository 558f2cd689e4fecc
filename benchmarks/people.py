"""What ways to ask that rest on a model of people are worth with people of another make, on tuning seeds.

    ./advise python benchmarks/people.py [--domain wumpus sailing drone] [--trials 40] [--seed 7000] [--jobs 2]

Prints Markdown: performance after 0, 1, ... questions of an expert who is right, its mean over 1 to 10 questions, and by
how much the mean is ahead of `gain` on the same demonstrations (in Traffic less is better), with 95 % intervals. After
an interruption the same command goes on.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from advise_ros.core.numerics import Floats
from advise_ros.domains.people import Demonstrator
from advise_ros.experiments.acquisitions import BELIEFS, GAINS, PAPER
from advise_ros.experiments.figures import Trials, stored, tasks
from advise_ros.experiments.protocols import FINAL_SEED, PROTOCOLS
from advise_ros.experiments.runner import OnCores, here, run
from advise_ros.experiments.statistics import estimate
from advise_ros.experiments.store import Store

POINTS = (0, 1, 2, 3, 5, 10)
VARIANTS = (PAPER, GAINS, BELIEFS)


def makes(person: Demonstrator) -> Iterator[tuple[str, Demonstrator]]:
    """Name and settings of each kind of person."""
    yield 'as in the figures', person
    for rate in (0.55, 0.95):
        yield f'the mistake in {rate:.0%} of the actions', replace(person, mistake_rate=rate)
    yield 'no mistakes but slips', replace(person, mistake_share=0.0)
    yield 'mistakes without habits', replace(person, kinds='each')
    yield 'a fifth more random actions', replace(person, noise_rate=person.noise_rate + 0.2)


def cells(curves: Floats, reference: Floats) -> Iterator[str]:
    """Of trials (m, 11) and those of the reference on the same seeds."""
    for point in POINTS:
        yield f'{curves[:, point].mean():.4g}'
    for values in (curves[:, 1:].mean(axis=1), (curves - reference)[:, 1:].mean(axis=1)):
        mean, ci95, _ = estimate(values)
        yield f'{mean:.4g} ± {ci95:.2g}'


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--domain', nargs='+', choices=PROTOCOLS, default=['wumpus', 'sailing', 'drone'])
    parser.add_argument('--trials', type=int, default=40)
    parser.add_argument('--seed', type=int, default=7000, help='of the first trial; the others follow')
    parser.add_argument('--jobs', type=int, default=1, help='processes (default %(default)s)')
    parser.add_argument('--out', type=Path, default=Path('out/people'), help='trials are kept here (default %(default)s)')
    options = parser.parse_args()
    if options.seed + options.trials > FINAL_SEED:
        parser.error(f'seeds from {FINAL_SEED} on are those of the published figures; choose lower ones')
    trials, performer = Trials(options.trials, options.seed), OnCores(options.jobs) if options.jobs > 1 else here
    print(f'| domain, demonstrator | method | {" | ".join(map(str, POINTS))} | mean of 1-10 | ahead of gain |')
    print('| --- ' * (4 + len(POINTS)) + '|', flush=True)
    with Store(options.out / 'trials.jsonl') as store:
        for domain in options.domain:
            for name, person in makes(PROTOCOLS[domain].demonstrator):  # type: ignore[arg-type]
                protocol = replace(PROTOCOLS[domain], demonstrator=person)
                run(tasks('interview', protocol, VARIANTS, trials), store, performer, lambda *_: None)
                curves = {one.name: stored(store, 'interview', protocol, one, trials)[:, 0] for one in VARIANTS}
                for method, found in curves.items():
                    print(f'| {domain}, {name} | {method} | {" | ".join(cells(found, curves["gain"]))} |', flush=True)


if __name__ == '__main__':
    main()
