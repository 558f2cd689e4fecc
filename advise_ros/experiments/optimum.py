"""Equation (1) solved again and again with little changed: only the margin rows that matter, exact all the same."""

from __future__ import annotations

import numpy as np

from advise_ros.core.numerics import Bools, Floats
from advise_ros.core.program import Pairs, Problem, Solution
from advise_ros.core.solve import solve

# Below so many margin rows the whole program takes no longer than finding out which of them matter.
FEW = 1000
# A row that is missed by less is satisfied: the solvers' own tolerance.
MISSED = 1e-6
# A row is taken along when its margin is within this share of the cap of its state's least.
NEAR = 0.25
WORST = 6


def optimum(problem: Problem, near: Solution | None) -> Solution:
    """An optimum of the whole program.

    Rows that the optimum of a smaller program misses are added until none is missed, which makes it an optimum
    of the whole.

    Args:
        problem: the whole.
        near: the optimum of a neighbouring problem.
    """
    pairs = problem.demonstration_pairs
    if near is None or len(pairs.states) < FEW:
        return solve(problem)
    cap = min(problem.terms.cap, 1.0)
    margins = pairs.margins(problem.mdp.expected(near.value))
    wanted = _below(pairs, margins, _least(pairs, margins, cap) + NEAR * cap, len(margins))
    while True:
        solution = solve(problem._replace(demonstration_pairs=Pairs(*(column[wanted] for column in pairs))))
        margins = pairs.margins(problem.mdp.expected(solution.value))
        kept = np.where(wanted, margins, np.inf)
        missed = _below(pairs, margins, _least(pairs, kept, cap) - MISSED, WORST)
        if not missed.any():
            return solution
        wanted |= missed


def _least(pairs: Pairs, margins: Floats, cap: float) -> Floats:
    """(m,) xi of each row's state: the least of its margins, or the cap."""
    starts = np.flatnonzero(np.diff(pairs.states, prepend=-1))
    least = np.minimum(np.minimum.reduceat(margins, starts), cap)
    return np.repeat(least, np.diff(starts, append=len(margins)))


def _below(pairs: Pairs, margins: Floats, limit: Floats, most: int) -> Bools:
    """The rows below or at their limit, at most so many of a state, lowest first; ties to the first."""
    order = np.lexsort((margins, pairs.states))
    starts = np.flatnonzero(np.diff(pairs.states, prepend=-1))
    rank = np.empty(len(margins), dtype=np.int64)
    rank[order] = np.arange(len(margins)) - np.repeat(starts, np.diff(starts, append=len(margins)))
    chosen: Bools = (margins <= limit) & (rank < most)
    return chosen
