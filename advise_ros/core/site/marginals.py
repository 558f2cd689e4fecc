"""What each cell is expected to be, finer than by counting the drawn maps that mark it.

With all other cells as a drawn map has them, the probability of each level of one cell can be worked out; its mean over
several maps is the Rao-Blackwell estimate of the marginal (Gelfand & Smith 1990). A count over 100 maps does not tell 0.001
from 0, and that is what decides between ways of the same length.
"""

from __future__ import annotations

import numpy as np

from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.site.chain import (
    ANSWERS,
    MOVES,
    Chain,
    Journal,
    Problem,
    change,
    new_chain,
    new_journal,
    prior_change,
    undo,
)
from advise_ros.core.site.compiled import compiled
from advise_ros.core.site.layout import Bytes

# The pilot may err otherwise than any model has it: with this probability the moves count less, as at this temperature.
MISJUDGED, MISJUDGED_TEMPERATURE = 0.1, 3.0
# A level whose prior is lower by more than this is not looked at [nat].
HOPELESS = -30.0


@compiled
def level_probabilities(problem: Problem, maps: Bytes) -> Floats:
    """(cells, levels) probability of each level of each cell, mean over maps (k, cells) of what it is given all other cells.

    Args:
        problem: what maps are judged by; wishes are the same on the way to all waypoints.
        maps: drawn ones.
    """
    n, kinds, every = maps.shape[1], len(problem.wishes.price), 1.0 / len(maps)
    likely, journal = np.zeros((n, kinds)), new_journal(len(problem.layout.acting), n, n)
    place, level, marked = np.zeros(1, np.int64), np.zeros(1, np.uint8), np.zeros(n, np.uint8)
    prior, moves = np.zeros(kinds), np.zeros(kinds)
    for row in range(len(maps)):
        chain = new_chain(problem, maps[row])
        for cell in range(n):
            if problem.layout.open_cells[cell]:
                likely[cell, 0] += every
                continue
            place[0] = cell
            for kind in range(kinds):
                level[0] = kind
                prior[kind], moves[kind] = _difference(problem, chain, journal, place, level, marked)
            likely[cell] += every * (1.0 - MISJUDGED) * _normalised(prior + moves)
            likely[cell] += every * MISJUDGED * _normalised(prior + moves / MISJUDGED_TEMPERATURE)
    return likely


@compiled
def _difference(
    problem: Problem, chain: Chain, journal: Journal, place: Ints, level: Bytes, marked: Bytes,
) -> tuple[float, float]:
    """By how much another level (1,) of a place (1,) changes the logs of prior and answers, and of the moves."""
    if level[0] == chain.levels[place[0]]:
        return 0.0, 0.0
    prior = prior_change(problem, chain.levels, place, level, 1, marked)
    if prior < HOPELESS:
        return prior, 0.0
    change(problem, chain, journal, place, level, 1)
    prior += chain.total[ANSWERS] - journal.total_was[ANSWERS]
    moves = chain.total[MOVES] - journal.total_was[MOVES]
    undo(problem, chain, journal, place, 1)
    return prior, moves


@compiled
def _normalised(logs: Floats) -> Floats:
    """Probabilities that add up to 1."""
    odds = np.exp(logs - logs.max())
    return odds / odds.sum()
