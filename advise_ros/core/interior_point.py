"""The program by an interior-point method of its own (Mehrotra 1992), whose every step is one n x n system in v.

Of each state the reward, the margin with its rows and cap, and the slack are local: given dv they follow by
themselves, so they are eliminated by hand (`blocks.py`), and what is left is `elimination.System`. A step is
Mehrotra's predictor and corrector, then some of Gondzio's (1996) centrality correctors, each taken with the
weight that lets the step go furthest (Colombo & Gondzio 2008): they cost a solve, and save factors.

The start needs no solve. Only the dual equation of v is not fulfilled there, and each step shrinks what is left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.blocks import Blocks, Direction, Point, Weights
from advise_ros.core.certificate import certified
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.numerics import Floats
from advise_ros.core.program import EXACT, Problem, Solution

STEPS = 150
# How far towards the boundary a step goes.
STEP_SHARE = 0.995
# A longer step than this needs no more correctors, of which there are at most so many.
LONG, CORRECTORS = 0.9, 3
# What a corrector aims at: a longer step by this much, products within these factors of their target.
LONGER, SPREAD = 0.4, 10.0
SHARES_OF_CORRECTOR = (1.0, 0.6, 0.3)
# A corrector that lengthens both steps together by less is the last.
WORTHWHILE = 0.05
# Steps shorter than this lead nowhere any more.
STUCK = 1e-6


class Reach(NamedTuple):
    """How far x and z can go in a direction, at most 1."""

    x: float
    z: float


def solve(problem: Problem, gap: float = EXACT) -> Solution:
    """An optimum in the relative interior of all optima, or as near as floating point leads.

    Args:
        problem: with elastic advice, or without advice.
        gap: proven relative gap at which to stop.

    Raises:
        InputError: the advice is strict.
        AdviseError: not even a first step can be made.
    """
    if problem.terms.strict and len(problem.advised):
        raise InputError("solver 'interior' needs elastic advice; set slack_cost above 0 or use solver 'highs'")
    blocks = Blocks(problem)
    point, best = blocks.start(), None
    for _ in range(STEPS):
        moved = _step(blocks, point)
        if moved is None:
            break
        point = moved
        if blocks.estimated_gap(point) <= gap:
            best = _better(best, certified(problem, point.v, blocks.duals(point), 'interior'))
            if best.gap <= gap:
                return best
    return _better(best, certified(problem, point.v, blocks.duals(point), 'interior'))


def _better(one: Solution | None, other: Solution) -> Solution:
    """The better point with the better bound: each is proven by itself."""
    if one is None:
        return other
    best = one if one.objective > other.objective else other
    return best._replace(bound=min(one.bound, other.bound))


def _step(blocks: Blocks, point: Point) -> Point | None:
    """The next point; None when floating point ends the way."""
    try:
        weights = blocks.weigh(point)
    except AdviseError:
        return None
    mean = _mean(point.x, point.z)
    predicted = blocks.direction(weights, -point.z, weights.residual)
    reach = _reach(point, predicted)
    left = _mean(point.x + reach.x * predicted.x, point.z + reach.z * predicted.z)
    aim = (left / mean) ** 3 * mean
    second = (aim - predicted.x * predicted.z) / point.x - point.z
    direction = blocks.direction(weights, second, weights.residual)
    direction, reach = _centred(blocks, weights, point, direction, aim)
    if not np.isfinite(direction.v).all() or max(reach) < STUCK:
        return None
    go_x, go_z = min(1.0, STEP_SHARE * reach.x), min(1.0, STEP_SHARE * reach.z)
    return Point(point.v + go_x * direction.v, point.x + go_x * direction.x, point.z + go_z * direction.z)


def _centred(
    blocks: Blocks, weights: Weights, point: Point, direction: Direction, aim: float,
) -> tuple[Direction, Reach]:
    """The direction, corrected as long as that lengthens the step."""
    reach = _reach(point, direction)
    for _ in range(CORRECTORS):
        if min(reach) > LONG:
            break
        corrector = blocks.direction(weights, _aim(point, direction, reach, aim), np.zeros_like(point.v))
        share, further = _best_share(point, direction, corrector)
        if further.x * further.z <= reach.x * reach.z:
            break
        before, direction, reach = reach, direction.plus(corrector, share), further
        if sum(reach) < sum(before) + WORTHWHILE:
            break
    return direction, reach


def _aim(point: Point, direction: Direction, reach: Reach, aim: float) -> Floats:
    """What the products x z then lack of `aim` after a longer step, divided by x."""
    x = point.x + min(1.0, reach.x + LONGER) * direction.x
    products = x * (point.z + min(1.0, reach.z + LONGER) * direction.z)
    lacking: Floats = np.clip(products, aim / SPREAD, aim * SPREAD)
    lacking -= products
    np.maximum(lacking, -aim * SPREAD, out=lacking)
    lacking /= point.x
    return lacking


def _best_share(point: Point, direction: Direction, corrector: Direction) -> tuple[float, Reach]:
    """How much of the corrector leads furthest."""
    x, z = direction.x / point.x, direction.z / point.z
    more_x, more_z = corrector.x / point.x, corrector.z / point.z
    reaches = [
        (share, Reach(_until(x + share * more_x), _until(z + share * more_z))) for share in SHARES_OF_CORRECTOR
    ]
    return max(reaches, key=lambda one: one[1].x * one[1].z)


def _reach(point: Point, direction: Direction) -> Reach:
    return Reach(_until(direction.x / point.x), _until(direction.z / point.z))


def _until(relative: Floats) -> float:
    """The step, at most 1, at which the first of the variables that change by so much of themselves is 0."""
    least = float(relative.min())
    return min(1.0, -1.0 / least) if least < 0.0 else 1.0


def _mean(x: Floats, z: Floats) -> float:
    # Not by BLAS, whose threads cost more here than they save.
    return float(np.einsum('i,i', x, z)) / len(x)
