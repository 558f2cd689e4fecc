"""Traffic: the signals of two intersections, four roads each, on which cars wait or not (section 4, figure 3 right)."""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np
from scipy import sparse

from advise_ros.core.planning.process import Mdp
from advise_ros.domains.domain import Domain, Measure, uniform_over

DIRECTIONS = ('north', 'east', 'south', 'west')
ROADS = 2 * len(DIRECTIONS)
# Chance that cars arrive on a road in a step, and how many cars its queue is: busy roads have both.
ARRIVALS = np.array([0.5, 0.25, 0.35, 0.15, 0.2, 0.5, 0.15, 0.35])
CARS = np.array([1.0, 0.5, 0.7, 0.3, 0.4, 1.0, 0.3, 0.7])
# What leaves the first intersection's west road drives on to the second one's, with this chance; and back by its east.
DRIVES_ON = 0.3
PASSES = ((3, 4 + 3), (4 + 1, 1))
GAMMA = 0.8
HORIZON = 50


@lru_cache(maxsize=1)
def traffic() -> Domain:
    """Keep the cars' wait short: 256 states (bit i: cars wait on road i), 16 joint greens.

    Action = 4 * green of the second intersection + green of the first. The green road is empty after the step;
    on each other road cars may arrive. Wait is the number of waiting cars. Rates, queues and the roads that join
    the two intersections are this model's: the paper gives the sizes only.
    """
    n = 2**ROADS
    queues = np.arange(n)[:, None] >> np.arange(ROADS) & 1
    greens = [(first, 4 + second) for second, first in product(range(4), repeat=2)]
    return Domain(
        name='traffic',
        mdp=Mdp(sparse.vstack([_action(queues, green) for green in greens], format='csr'), GAMMA),
        reward=-(queues @ CARS),
        ended=np.zeros(n, dtype=np.bool_),
        goal=np.zeros(n, dtype=np.bool_),
        start=uniform_over(np.ones(n, dtype=np.bool_)),
        measure=Measure.WAIT,
        horizon=HORIZON,
        features=queues.astype(float),
        actions=tuple(f'{DIRECTIONS[second - 4]} of 2, {DIRECTIONS[first]} of 1' for first, second in greens),
    )


def _action(queues: np.ndarray, green: tuple[int, int]) -> sparse.csr_array:
    """(n, n) transitions: roads fill independently, so a row is the outer product of eight coins."""
    waits = np.where(queues == 1, 1.0, ARRIVALS)
    for road, onto in PASSES:
        if road in green:
            waits[:, onto] = np.where(queues[:, road] == 1, 1.0 - (1.0 - waits[:, onto]) * (1.0 - DRIVES_ON), waits[:, onto])
    waits[:, green] = 0.0
    rows = np.ones((len(queues), 1))
    for road in range(ROADS):
        rows = np.hstack([rows * (1.0 - waits[:, [road]]), rows * waits[:, [road]]])
    return sparse.csr_array(rows)
