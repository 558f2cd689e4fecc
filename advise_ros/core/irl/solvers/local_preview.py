"""A solution near an answer: what changed is solved anew with its surroundings, all else stays, and both are proven.

Of an earlier program and its solution only the states whose rows differ, and a region around them, are looked at.
Two small programs over the region bound what the whole one can be:

- from below, v outside the region stays what it was, and is a constant of the small program: its optimum belongs to
  a point of the whole program;
- from above, the multipliers of the rows outside stay what they were, and pull at the region's v as a linear term:
  its multipliers with those outside are a point of the whole program's dual.

`certificate.py` values both on the whole program, so that a gap is stated as honestly as any solver's. A region grows
until the gap is small enough. What comes of it depends on the earlier solution, so it is good for looking ahead only.
"""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from scipy import sparse

from advise_ros.core.errors import AdviseError
from advise_ros.core.irl.certificate import certified
from advise_ros.core.irl.program import Duals, Pairs, Problem, Solution
from advise_ros.core.irl.solvers.packaged import Ended, piqp_program
from advise_ros.core.irl.solvers.sparse_form import Program, duals, write
from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.planning.process import Mdp

# What a preview may miss the optimum by, relative to it.
ROUGH = 1e-3
# Smallest numbers of states in a region; the next one is tried where the gap is too wide.
REGIONS = (500, 1500, 4500)
NAME = 'local'
# Up to this many states an exact solution is quick enough to wait for.
QUICK = 5000
# Of the small programs: what they leave is part of the gap. Where much is fixed, tighter ones are not to be had.
TOLERANCE = 1e-6


class Solved(NamedTuple):
    """A program and its solution."""

    problem: Problem
    solution: Solution


class Region(NamedTuple):
    """A part of a process.

    Attributes:
        inside: (n,) states with rows in the region.
        states: (t,) those and all that their rows reach, ascending.
        rim: (t,) which of `states` are reached only.
        fixed: (t,) which of them also rows outside reach.
    """

    inside: Bools
    states: Ints
    rim: Bools
    fixed: Bools


def is_large(mdp: Mdp) -> bool:
    """Whether an exact solution takes so long that a preview is worth having."""
    return mdp.n_states > QUICK


def near(problem: Problem, earlier: Solved, gap: float = ROUGH) -> Solution | None:
    """A point of the program within a proven gap, from the solution of one that differs in few states.

    Args:
        problem: of the same process with the same terms.
        earlier: the other one.
        gap: relative.

    Returns:
        None where too much changed, or no region is large enough.

    Raises:
        InputError: PIQP is missing.
    """
    before = earlier.problem
    if problem.mdp is not before.mdp or problem.terms != before.terms:
        return None
    seeds = changed(problem, before)
    if len(seeds) > REGIONS[0]:
        return None
    value, multipliers = earlier.solution.value, _carried(problem, before, earlier.solution.duals)
    best: Solution | None = None
    for size in REGIONS:
        region = _region(problem.mdp, seeds, size)
        part = _part(problem, region)
        try:
            found = certified(
                problem, _value(part, region, value), _multipliers(problem, part, region, multipliers), NAME
            )
        except AdviseError:
            continue
        best = found if best is None else _joined(best, found)
        if best.gap <= gap:
            return best
    return None


def _joined(one: Solution, other: Solution) -> Solution:
    """The better point with the better bound."""
    best, tighter = max(one, other, key=lambda found: found.objective), min(one, other, key=lambda found: found.bound)
    return best._replace(bound=tighter.bound, duals=tighter.duals)


def changed(problem: Problem, before: Problem) -> Ints:
    """The states whose rows or mix of actions differ, ascending."""
    mixed = np.flatnonzero((problem.shares != before.shares).any(axis=1))
    size = problem.mdp.n_actions
    rows = [
        np.setxor1d(_keys(now, size), _keys(then, size), assume_unique=True) // size**2
        for now, then in (
            (problem.demonstration_pairs, before.demonstration_pairs), (problem.advice_pairs, before.advice_pairs),
        )
    ]
    return np.unique(np.concatenate([mixed, *rows]))


def _keys(pairs: Pairs, size: int) -> Ints:
    """One number a row, ascending."""
    return (pairs.states * size + pairs.better) * size + pairs.worse


def _carried(problem: Problem, before: Problem, old: Duals) -> Duals:
    """The multipliers of rows that both programs have, 0 for new ones."""
    size = problem.mdp.n_actions

    def of(now: Pairs, then: Pairs, weights: Floats) -> Floats:
        wanted, known = _keys(now, size), _keys(then, size)
        if not len(known):
            return np.zeros(len(wanted))
        at = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
        return np.where(known[at] == wanted, weights[at], 0.0)

    return Duals(
        old.flow, of(problem.demonstration_pairs, before.demonstration_pairs, old.demonstration),
        of(problem.advice_pairs, before.advice_pairs, old.advice),
    )


# -- the region ------------------------------------------------------------------------------
_arriving: WeakKeyDictionary[Mdp, sparse.csc_array] = WeakKeyDictionary()


def _into(mdp: Mdp, states: Ints) -> sparse.csc_array:
    """(n_actions * n, k) the moves that reach states; made once for a process."""
    if mdp not in _arriving:
        _arriving[mdp] = mdp.stacked.tocsc()
    return _arriving[mdp][:, states]


def _region(mdp: Mdp, seeds: Ints, size: int) -> Region:
    """The states so few moves before or after the seeds that they are at least `size`, or all there are."""
    n = mdp.n_states
    inside, ring = np.zeros(n, dtype=np.bool_), seeds
    inside[seeds] = True
    while len(ring) and inside.sum() < size:
        near_by = np.union1d(_reached(mdp, ring), _into(mdp, ring).indices % n)
        ring = near_by[~inside[near_by]]
        inside[ring] = True
    states = np.union1d(np.flatnonzero(inside), _reached(mdp, np.flatnonzero(inside)))
    rim = ~inside[states]
    into = _into(mdp, states)
    outside = ~inside[into.indices % n]
    fixed = rim.copy()
    fixed[np.repeat(np.arange(len(states)), np.diff(into.indptr))[outside]] = True
    return Region(inside, states, rim, fixed)


def _reached(mdp: Mdp, states: Ints) -> Ints:
    """All that any action in some states can lead to."""
    rows = (np.arange(mdp.n_actions)[:, None] * mdp.n_states + states).ravel()
    return np.unique(mdp.stacked[rows].indices)


def _part(problem: Problem, region: Region) -> Problem:
    """The region as a problem of its own, in which the rim stays where it is."""
    mdp = _process(problem.mdp, region)
    inside, states = region.inside, region.states
    shown, advised = inside[problem.demonstrated], inside[problem.advised]
    return Problem(
        mdp, problem.terms, problem.shares[states], mdp.under(problem.shares[states]),
        np.searchsorted(states, problem.demonstrated[shown]), problem.caps[shown],
        np.searchsorted(states, problem.advised[advised]),
        _pairs(problem.demonstration_pairs, region), _pairs(problem.advice_pairs, region),
    )


def _process(mdp: Mdp, region: Region) -> Mdp:
    t = len(region.states)
    rows = (np.arange(mdp.n_actions)[:, None] * mdp.n_states + region.states).ravel()
    moves = mdp.stacked[rows].tocoo()
    kept = ~region.rim[moves.row % t]
    stay = np.flatnonzero(np.tile(region.rim, mdp.n_actions))
    row = np.concatenate([moves.row[kept], stay])
    column = np.concatenate([np.searchsorted(region.states, moves.col[kept]), stay % t])
    entries = np.concatenate([moves.data[kept], np.ones(len(stay))])
    return Mdp(sparse.coo_array((entries, (row, column)), shape=(len(rows), t)).tocsr(), mdp.gamma)


def _pairs(pairs: Pairs, region: Region) -> Pairs:
    kept = region.inside[pairs.states]
    return Pairs(np.searchsorted(region.states, pairs.states[kept]), pairs.better[kept], pairs.worse[kept])


# -- the two small programs ------------------------------------------------------------------
def _value(part: Problem, region: Region, value: Floats) -> Floats:
    """v with the region's best, beside what stays."""
    program, t = write(part), len(region.states)
    here = value[region.states]
    kept = np.ones(len(program.cost), dtype=np.bool_)
    kept[:t] = ~region.fixed
    constant = program.matrix[:, np.flatnonzero(~kept)] @ here[region.fixed]
    found = _solved(Program(
        program.cost[kept], program.matrix[:, np.flatnonzero(kept)], program.row_lower - constant,
        program.row_upper - constant, program.lower[kept], program.upper[kept],
    ), t).x
    free = region.states[~region.fixed]
    result = value.copy()
    result[free] = found[: len(free)]
    return result


def _multipliers(problem: Problem, part: Problem, region: Region, old: Duals) -> Duals:
    """The multipliers with the region's best, beside what stays."""
    shown, advised = region.inside[problem.demonstration_pairs.states], region.inside[problem.advice_pairs.states]
    outside = Duals(
        np.where(region.inside, 0.0, old.flow), np.where(shown, 0.0, old.demonstration), np.where(advised, 0.0, old.advice)
    )
    pull = (
        problem.backup_transposed(outside.flow)
        + problem.demonstration_pairs.weighted(problem.mdp, outside.demonstration)
        + problem.advice_pairs.weighted(problem.mdp, outside.advice)
    )
    program, t = write(part), len(region.states)
    program.cost[:t] = -pull[region.states]
    # Of the rim only the bounds of v are left, |v| <= r_max / (1 - gamma), without which v might be unbounded.
    program.cost[t : 3 * t][np.tile(region.rim, 2)] = 0.0
    found = duals(part, _solved(program, t).multipliers)
    outside.flow[region.inside] = found.flow[~region.rim]
    outside.demonstration[shown] = found.demonstration
    outside.advice[advised] = found.advice
    return outside


def _solved(program: Program, n: int) -> Ended:
    """How PIQP ends.

    Raises:
        AdviseError: without numbers.
    """
    ended = piqp_program(program, n, TOLERANCE)
    if not np.isfinite(ended.x).all() or not np.isfinite(ended.multipliers).all():
        raise AdviseError(f"a local program ends with '{ended.status}'")
    return ended
