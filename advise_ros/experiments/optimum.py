"""Equation (1) solved again and again with little changed: only the margin rows that matter, exact all the same."""

from __future__ import annotations

import numpy as np

from advise_ros.core.irl.program import Pairs, Problem, Solution
from advise_ros.core.irl.solvers.choose import solve
from advise_ros.core.numerics import Bools, Floats

# Below so many margin rows the whole program takes no longer than finding out which of them matter.
FEW = 1000
# A row that is missed by less is satisfied: the solvers' own tolerance.
MISSED = 1e-6
# A row is taken along when its margin is within this share of the cap of its state's least.
NEAR = 0.25
WORST = 4


def optimum(problem: Problem, solver: str, near: Solution | None) -> Solution:
    """An optimum of the whole program.

    Rows that the optimum of a smaller program misses are added until none is missed, which makes it an optimum
    of the whole.

    Args:
        problem: the whole.
        solver: of `core.solve`.
        near: the optimum of a neighbouring problem.
    """
    groups = (problem.demonstration_pairs, problem.advice_pairs)
    if near is None or sum(len(pairs.states) for pairs in groups) < FEW:
        return solve(problem, solver)
    cap = min(problem.terms.cap, 1.0)
    ceilings = (cap, cap + problem.terms.delta)
    expected = problem.mdp.expected(near.value)
    wanted = [_near(pairs, pairs.margins(expected), ceiling, cap) for pairs, ceiling in zip(groups, ceilings, strict=True)]
    while True:
        solution = solve(_restricted(problem, wanted), solver)
        expected = problem.mdp.expected(solution.value)
        missed = [
            _missed(pairs, pairs.margins(expected), kept, ceiling)
            for pairs, kept, ceiling in zip(groups, wanted, ceilings, strict=True)
        ]
        if not any(more.any() for more in missed):
            return solution
        wanted = [kept | more for kept, more in zip(wanted, missed, strict=True)]


def _restricted(problem: Problem, wanted: list[Bools]) -> Problem:
    demonstrations, advice = wanted
    return problem._replace(
        demonstration_pairs=Pairs(*(column[demonstrations] for column in problem.demonstration_pairs)),
        advice_pairs=Pairs(*(column[advice] for column in problem.advice_pairs)),
    )


def _near(pairs: Pairs, margins: Floats, ceiling: float, cap: float) -> Bools:
    return _below(pairs, margins, _least(pairs, margins, ceiling) + NEAR * cap, len(margins))


def _missed(pairs: Pairs, margins: Floats, kept: Bools, ceiling: float) -> Bools:
    """Rows below the margin that the kept ones leave their state, the worst few of each."""
    return _below(pairs, margins, _least(pairs, np.where(kept, margins, np.inf), ceiling) - MISSED, WORST)


def _least(pairs: Pairs, margins: Floats, ceiling: float) -> Floats:
    """(m,) the least margin of each row's state, at most the ceiling beyond which more earns nothing."""
    if not len(margins):
        return margins
    starts = np.flatnonzero(np.diff(pairs.states, prepend=-1))
    least = np.minimum(np.minimum.reduceat(margins, starts), ceiling)
    return np.repeat(least, np.diff(starts, append=len(margins)))


def _below(pairs: Pairs, margins: Floats, limit: Floats, most: int) -> Bools:
    """The rows at or below their limit, at most so many of a state, lowest first."""
    order = np.lexsort((margins, pairs.states))
    starts = np.flatnonzero(np.diff(pairs.states, prepend=-1))
    rank = np.empty(len(margins), dtype=np.int64)
    rank[order] = np.arange(len(margins)) - np.repeat(starts, np.diff(starts, append=len(margins)))
    chosen: Bools = (margins <= limit) & (rank < most)
    return chosen
