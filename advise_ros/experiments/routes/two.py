"""Two people with other wishes fly one site: how often the learner says so, and how often it says so of one person."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from advise_ros.core.demonstrations.demonstration import count
from advise_ros.core.site.agreement import two_people
from advise_ros.core.site.belief import believe
from advise_ros.core.site.layout import layout_of
from advise_ros.experiments.routes.cases import RouteCase, RouteTrial

SIZES = ('6x6-4', '12x12-6')


class Said(NamedTuple):
    """What the learner says of the flights of a trial.

    Attributes:
        two: that they are of two people.
        right: and names just those of the second, or of the first.
        seconds: of processor time that this takes.
    """

    two: bool
    right: bool
    seconds: float


def agreement(trial: RouteTrial) -> Said:
    """Whether the flights are one person's."""
    layout, rng = layout_of(trial.site.grid), trial.rng
    taken = [count(trial.site.grid, [flight]).taken for flight in trial.flights]
    belief = believe(layout, np.sum(taken, axis=0), (), rng)
    begun = time.process_time()
    found = two_people(layout, taken, belief, rng)
    seconds = round(time.process_time() - begun, 3)
    every = range(len(taken))
    return Said(found is not None, found is not None and found.flights in (tuple(every[1::2]), tuple(every[::2])), seconds)


def cases(sizes: Sequence[str]) -> Iterator[tuple[str, RouteCase]]:
    """One person and two, of several kinds, on those of the sizes that are looked at."""
    for size in (size for size in SIZES if size in sizes):
        for people in (1, 2):
            usual = RouteCase(size, people=people)
            variants = {
                '5 flights': usual, '10 flights': usual._replace(flights=10), 'never errs': usual._replace(noise=0.0),
                'soft': usual._replace(pilot='soft'),
            }
            for label, case in variants.items():
                yield f'{size}: {"one person" if people == 1 else "two people"}, {label}', case
