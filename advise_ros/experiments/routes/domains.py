"""The paper's domains with ends that are good or bad (`experiments/ends.py`), beside the paper's way and `belief`."""

from __future__ import annotations

import numpy as np

from advise_ros.experiments.acquisitions import BELIEFS, PAPER
from advise_ros.experiments.figures import Trials
from advise_ros.experiments.interview import ENDS, Interview, with_errors
from advise_ros.experiments.protocols import PROTOCOLS
from advise_ros.experiments.statistics import estimate
from advise_ros.experiments.store import Store, key_of
from advise_ros.experiments.work import Task

DOMAINS, ERRORS, VARIANTS = ('wumpus', 'sailing'), (0.0, 0.1, 0.2), (PAPER, BELIEFS, ENDS)
POINTS = (0, 1, 2, 3, 5, 10)
GIVEN = {PAPER.name: 'nothing', BELIEFS.name: 'nothing', ENDS.name: 'that only ends matter'}


def tasks(trials: Trials) -> list[Task]:
    """One a domain, kind of expert and seed."""
    return [
        Task('interview', with_errors(PROTOCOLS[domain], rate), VARIANTS, seed)
        for domain in DOMAINS for rate in ERRORS for seed in trials.seeds
    ]


def markdown(store: Store, trials: Trials) -> str:
    """Goal reached [%] after so many answers, with its 95 % interval by Student's t; a line a way."""
    head = ['domain', 'wrong answers', 'way', 'given', 'trials', *map(str, POINTS)]
    lines = [head, ['---'] * len(head)]
    for domain in DOMAINS:
        for rate in ERRORS:
            for variant in VARIANTS:
                key = key_of('interview', with_errors(PROTOCOLS[domain], rate), variant)
                found = [Interview(*map(tuple, store[key, seed])) for seed in trials.seeds]
                curves = np.array([one.performance for one in found])
                points = (estimate(curves[:, point]) for point in POINTS)
                cells = (f'{point.mean:.0f} ± {point.ci95:.0f}' for point in points)
                lines.append([domain, f'{rate:.0%}', variant.name, GIVEN[variant.name], str(trials.number), *cells])
    return '\n'.join([f'Seeds {trials.seeds[0]} to {trials.seeds[-1]}.', '', *(f'| {" | ".join(line)} |' for line in lines)])
