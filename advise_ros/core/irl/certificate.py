"""What a solution is worth, checked on the program itself: no solver's word is taken for it.

From below: any value v, scaled until |r| <= r_max, with the best xi, zeta and eta that it allows, is a point of
the program. From above, by duality: for weights w >= 0 of the demonstration rows G, z >= 0 of the advice rows H
and any flow y of the states the optimum is at most

    r_max sum (|y_i| - 1)+  +  sum_i (lambda_t - w_i) cap_i  +  sum_j ((lambda_a - z_j)+ cap - delta z_j)

with w_i, z_j the sums over a state's rows, w_i <= lambda_t and z_j <= M, where (I - gamma Pbar)' y + G' w + H' z = 0.
A residual of that equation costs at most r_max / (1 - gamma) times its sum of magnitudes, because no column of
the inverse of (I - gamma Pbar)' sums to more than 1 / (1 - gamma). So neither bound needs a solve.
"""

from __future__ import annotations

import numpy as np

from advise_ros.core.irl.program import Duals, Pairs, Problem, Solution
from advise_ros.core.numerics import Floats, Ints

# Strict advice may be missed by this much, as every solver in floating point does.
STRICT_TOLERANCE = 1e-6


def certified(problem: Problem, value: Floats, duals: Duals, solver: str) -> Solution:
    """The solution that a value makes, with a proven bound.

    Args:
        problem: equation (1).
        value: (n,) v; the reward and the slacks follow from it.
        duals: multipliers that the bound is made of.
        solver: its name.
    """
    point = _point(problem, value)
    objective, bound = _objective(problem, *point), upper_bound(problem, duals)
    return Solution(*point, objective=objective, bound=bound, solver=solver, duals=duals)


def _point(problem: Problem, value: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Reward, value, xi, zeta and eta: the best that go with a value."""
    terms, reward = problem.terms, problem.backup(value)
    excess = max(1.0, float(np.abs(reward).max(initial=0.0)) / terms.r_max)
    reward, value = reward / excess, value / excess
    expected = problem.mdp.expected(value)
    xi = np.minimum(_least(problem.demonstration_pairs, problem.demonstrated, expected), problem.caps)
    met = _least(problem.advice_pairs, problem.advised, expected) - terms.delta
    # Slack that costs less than it lets margin earn is bought up to the cap.
    wanted = 0.0 if terms.strict or terms.slack_cost >= terms.lambda_a else terms.cap
    zeta = np.clip(met, wanted, terms.cap)
    return reward, value, xi, zeta, np.maximum(zeta - met, 0.0)


def _least(pairs: Pairs, owners: Ints, expected: Floats) -> Floats:
    """(len(owners),) the smallest margin of each state's rows, infinite without a row."""
    least = np.full(len(owners), np.inf)
    if len(pairs.states):
        starts = np.flatnonzero(np.diff(pairs.states, prepend=-1))
        least[np.searchsorted(owners, pairs.states[starts])] = np.minimum.reduceat(pairs.margins(expected), starts)
    return least


def _objective(problem: Problem, reward: Floats, _: Floats, xi: Floats, zeta: Floats, slack: Floats) -> float:
    terms = problem.terms
    if terms.strict and slack.max(initial=0.0) > STRICT_TOLERANCE * max(1.0, terms.delta):
        return -np.inf
    return float(
        -np.abs(reward).sum() + terms.lambda_t * xi.sum() + terms.lambda_a * zeta.sum() - terms.slack_cost * slack.sum()
    )


def upper_bound(problem: Problem, duals: Duals) -> float:
    """What no point of the program exceeds; the multipliers are first made to fit their bounds."""
    terms = problem.terms
    w, of_state = _fitted(duals.demonstration, problem.demonstration_pairs, problem.demonstrated, _range_of_w(problem))
    most = np.inf if terms.strict else terms.slack_cost
    least = 0.0 if np.isfinite(terms.cap) else terms.lambda_a
    z, asked = _fitted(duals.advice, problem.advice_pairs, problem.advised, (np.full(len(problem.advised), least), most))
    residual = (
        problem.backup_transposed(duals.flow)
        + problem.demonstration_pairs.weighted(problem.mdp, w)
        + problem.advice_pairs.weighted(problem.mdp, z)
    )
    cap = terms.cap if np.isfinite(terms.cap) else 0.0
    return float(
        terms.r_max * np.maximum(np.abs(duals.flow) - 1.0, 0.0).sum()
        + terms.r_max * np.abs(residual).sum() / (1.0 - problem.mdp.gamma)
        + (_finite(problem.caps) * (terms.lambda_t - of_state)).sum()
        + cap * np.maximum(terms.lambda_a - asked, 0.0).sum()
        - terms.delta * asked.sum()
    )


def _range_of_w(problem: Problem) -> tuple[Floats, float]:
    """Between what the weights of a demonstrated state must sum to: all of lambda_t where no cap takes the rest."""
    return np.where(np.isfinite(problem.caps), 0.0, problem.terms.lambda_t), problem.terms.lambda_t


def _finite(caps: Floats) -> Floats:
    return np.where(np.isfinite(caps), caps, 0.0)


def _fitted(weights: Floats, pairs: Pairs, owners: Ints, allowed: tuple[Floats, float]) -> tuple[Floats, Floats]:
    """Weights without a negative one, whose sum in each state is as allowed, and those sums."""
    least, most = allowed
    owner, weights = pairs.of(owners), np.maximum(weights, 0.0)
    sums = np.bincount(owner, weights, len(owners)).astype(np.float64)
    empty = (least > 0.0) & (sums <= 0.0)
    if empty.any():  # Where nothing weighs what something must, all rows share alike.
        weights = weights + empty[owner]
        sums = np.bincount(owner, weights, len(owners)).astype(np.float64)
    wanted = np.clip(sums, least, most)
    scale = np.divide(wanted, sums, out=np.ones_like(sums), where=sums > 0.0)
    return weights * scale[owner], sums * scale
