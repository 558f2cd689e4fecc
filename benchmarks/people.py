"""What ways to ask that rest on a model of people are worth with people of another make, on tuning seeds.

    ./advise python benchmarks/people.py [--domain wumpus sailing drone] [--trials 40] [--seed 7000] [--jobs 2]

Prints Markdown: performance after 0, 1, ... questions of an expert who is right, its mean over 1 to 10 questions, and by
how much the mean is ahead of `gain` on the same demonstrations (in Traffic less is better), with 95 % intervals. After
an interruption the same command goes on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from tuning import parse

from advise_ros.core.numerics import Floats
from advise_ros.core.people.simulated_demonstrator import Demonstrator
from advise_ros.experiments.acquisitions import BELIEFS, GAINS, PAPER
from advise_ros.experiments.figures import stored, tasks
from advise_ros.experiments.protocols import PROTOCOLS
from advise_ros.experiments.runner import run
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
    domains, trials, performer, path = parse(str(__doc__), 'people', ('wumpus', 'sailing', 'drone'), 7000)
    print(f'| domain, demonstrator | method | {" | ".join(map(str, POINTS))} | mean of 1-10 | ahead of gain |')
    print('| --- ' * (4 + len(POINTS)) + '|', flush=True)
    with Store(path) as store:
        for domain in domains:
            for name, person in makes(PROTOCOLS[domain].demonstrator):  # type: ignore[arg-type]
                protocol = replace(PROTOCOLS[domain], demonstrator=person)
                run(tasks('interview', protocol, VARIANTS, trials), store, performer, lambda *_: None)
                curves = {one.name: stored(store, 'interview', protocol, one, trials)[:, 0] for one in VARIANTS}
                for method, found in curves.items():
                    print(f'| {domain}, {name} | {method} | {" | ".join(cells(found, curves["gain"]))} |', flush=True)


if __name__ == '__main__':
    main()
