"""The program by an interior-point method of its own (Mehrotra 1992): each step solves one n x n system in v.

Of each state the reward, the margin with its rows and cap, and the slack are local: given dv they follow by
themselves, so they are eliminated by hand (`blocks.py`), and what is left is `elimination.System`. A step is
Mehrotra's predictor and corrector, then some of Gondzio's (1996) centrality correctors, each taken with the
weight that lets the step go furthest (Colombo & Gondzio 2008): they cost a solve each, and save factors.

The start needs no solve. Only the dual equation of v is not fulfilled there, and each step shrinks what is left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.irl.certificate import certified
from advise_ros.core.irl.program import EXACT, Problem, Solution
from advise_ros.core.irl.solvers.interior.blocks import Blocks, Direction, Point, Weights
from advise_ros.core.irl.solvers.interior.elimination import structure_of
from advise_ros.core.irl.solvers.interior.factors import QDLDL, factors
from advise_ros.core.numerics import Floats

STEPS = 150
# The products aim at this share of what they are, at most: the correctors lengthen a step that the predictor alone
# would have far shorter, so its reach is no reason to aim at little.
MOST = 0.1
# How far towards the boundary a step goes.
STEP_SHARE = 0.995
# A longer step than LONG needs no more correctors; at most this many are tried.
LONG, CORRECTORS = 0.9, 3
# What a corrector aims at: a longer step by this much, products within these factors of their target.
LONGER, SPREAD = 0.6, 10.0
SHARES_OF_CORRECTOR = (1.0, 0.6, 0.3)
# A corrector that lengthens both steps together by less is the last.
WORTHWHILE = 0.05
# Steps shorter than this lead nowhere any more.
STUCK = 1e-6


class Reach(NamedTuple):
    """How far x and z can go in a direction, at most 1."""

    x: float
    z: float


def solve(problem: Problem, gap: float = EXACT, kind: str = QDLDL) -> Solution:
    """An optimum in the relative interior of all optima, or as near as floating point leads.

    Args:
        problem: with elastic advice, or without advice.
        gap: proven relative gap at which to stop.
        kind: of the factors, a key of `factors.KINDS`.

    Raises:
        InputError: the advice is strict, or the package of the factors is missing.
        AdviseError: not even a first step can be made.
    """
    name = 'interior' if kind == QDLDL else f'interior-{kind}'
    if problem.terms.strict and len(problem.advised):
        raise InputError(f"solver '{name}' needs elastic advice; set slack_cost above 0 or use solver 'highs'")
    with factors(problem.mdp, structure_of(problem.mdp).pattern, kind) as kept:
        return _solve(problem, Blocks(problem, kept), gap, name)


def _solve(problem: Problem, blocks: Blocks, gap: float, name: str) -> Solution:
    point, best = blocks.start(), None
    for _ in range(STEPS):
        moved = _step(blocks, point)
        if moved is None:
            break
        point = moved
        if blocks.estimated_gap(point) <= gap:
            best = _better(best, certified(problem, point.v, blocks.duals(point), name))
            if best.gap <= gap:
                return best
    return _better(best, certified(problem, point.v, blocks.duals(point), name))


def _better(one: Solution | None, other: Solution) -> Solution:
    """The better point with the better bound: each is proven by itself."""
    if one is None:
        return other
    best, tighter = max(one, other, key=lambda found: found.objective), min(one, other, key=lambda found: found.bound)
    return best._replace(bound=tighter.bound, duals=tighter.duals)


def _step(blocks: Blocks, point: Point) -> Point | None:
    """The next point; None when floating point ends the way."""
    try:
        weights = blocks.weigh(point)
    except AdviseError:
        return None
    products = point.x * point.z
    aim, wanted = _aim_of_step(products, blocks.direction(weights, -1.0, weights.residual))
    direction, reach = _centred(blocks, weights, products, blocks.direction(weights, wanted, weights.residual), aim)
    if not np.isfinite(direction.v).all() or max(reach) < STUCK:
        return None
    go_x, go_z = min(1.0, STEP_SHARE * reach.x), min(1.0, STEP_SHARE * reach.z)
    return Point(
        point.v + go_x * direction.v, _scaled(go_x, direction.x, point.x), _scaled(go_z, direction.z, point.z)
    )


def _aim_of_step(products: Floats, predicted: Direction) -> tuple[float, Floats]:
    """What the products aim at, and what they then lack of it in shares of what they are, curvature included."""
    mean = products.mean()
    left = _products_after(products, predicted, _reach(predicted)).mean()
    aim = float(min(MOST, (left / mean) ** 3) * mean)
    second = aim / products
    second -= predicted.x * predicted.z
    second -= 1.0
    return aim, second


def _scaled(go: float, change: Floats, value: Floats) -> Floats:
    """value * (1 + step * relative_change)."""
    after = go * change
    after += 1.0
    after *= value
    return after


def _products_after(products: Floats, direction: Direction, go: Reach) -> Floats:
    """x z after a step."""
    return _scaled(go.x, direction.x, _scaled(go.z, direction.z, products))


def _centred(
    blocks: Blocks, weights: Weights, products: Floats, direction: Direction, aim: float,
) -> tuple[Direction, Reach]:
    """The direction, corrected as long as that lengthens the step."""
    reach = _reach(direction)
    for _ in range(CORRECTORS):
        if min(reach) > LONG:
            break
        corrector = blocks.direction(weights, _aim(products, direction, reach, aim))
        share, further = _best_share(direction, corrector)
        if further.x * further.z <= reach.x * reach.z:
            break
        before, direction, reach = reach, direction.plus(corrector, share), further
        if sum(reach) < sum(before) + WORTHWHILE:
            break
    return direction, reach


def _aim(products: Floats, direction: Direction, reach: Reach, aim: float) -> Floats:
    """What the products then lack of `aim` after a longer step, in shares of what they are."""
    longer = Reach(min(1.0, reach.x + LONGER), min(1.0, reach.z + LONGER))
    after = _products_after(products, direction, longer)
    lacking: Floats = np.clip(after, aim / SPREAD, aim * SPREAD)
    lacking -= after
    np.maximum(lacking, -aim * SPREAD, out=lacking)
    lacking /= products
    return lacking


def _best_share(direction: Direction, corrector: Direction) -> tuple[float, Reach]:
    """How much of the corrector leads furthest."""
    mixed = np.empty_like(direction.x)
    reaches = []
    for share in SHARES_OF_CORRECTOR:
        x, z = (
            _until(np.add(np.multiply(change, share, out=mixed), before, out=mixed))
            for before, change in ((direction.x, corrector.x), (direction.z, corrector.z))
        )
        reaches.append((share, Reach(x, z)))
    return max(reaches, key=lambda one: one[1].x * one[1].z)


def _reach(direction: Direction) -> Reach:
    return Reach(_until(direction.x), _until(direction.z))


def _until(relative: Floats) -> float:
    """The largest step, at most 1, that keeps x * (1 + step * relative_change) >= 0 for all variables."""
    least = float(relative.min())
    return min(1.0, -1.0 / least) if least < 0.0 else 1.0
