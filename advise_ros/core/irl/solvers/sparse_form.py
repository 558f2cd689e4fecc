"""The program as one sparse matrix, for solvers that take any linear program."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from advise_ros.core.irl.program import Duals, Pairs, Problem
from advise_ros.core.numerics import Floats, Ints


class Program(NamedTuple):
    """Minimise cost x subject to row_lower <= matrix x <= row_upper, lower <= x <= upper.

    x = (v (n), r+ (n), r- (n), xi (|D|), zeta (|S|), eta (|S|)) with r = r+ - r-, so that |r| = r+ + r-; strict
    advice has no eta.
    Rows: v = r + gamma Pbar v (n), the demonstration pairs, the advice pairs; equalities come first.
    """

    cost: Floats
    matrix: sparse.csc_array
    row_lower: Floats
    row_upper: Floats
    lower: Floats
    upper: Floats


def write(problem: Problem) -> Program:
    """The program as one sparse matrix."""
    n, terms = problem.mdp.n_states, problem.terms
    n_d, n_s = len(problem.demonstrated), len(problem.advised)
    identity = sparse.eye_array(n)
    xi = _belongs(problem.demonstration_pairs, problem.demonstrated)
    zeta = _belongs(problem.advice_pairs, problem.advised)
    eta = zeta[:, : 0 if terms.strict else n_s]
    matrix = sparse.block_array([
        [identity - problem.mdp.gamma * problem.mixed, -identity, identity, None, None, None],
        [problem.demonstration_pairs.differences(problem.mdp), None, None, -xi, None, None],
        [problem.advice_pairs.differences(problem.mdp), None, None, None, -zeta, eta],
    ], format='csc')
    sizes = (n, n, n, n_d, n_s, eta.shape[1])
    rows = (n, xi.shape[0], zeta.shape[0])
    upper = np.repeat([np.inf, terms.r_max, terms.r_max, 0.0, terms.cap, np.inf], sizes)
    upper[3 * n : 3 * n + n_d] = problem.caps
    return Program(
        cost=np.repeat([0.0, 1.0, 1.0, -terms.lambda_t, -terms.lambda_a, terms.slack_cost], sizes),
        matrix=matrix,
        row_lower=np.repeat([0.0, 0.0, terms.delta], rows),
        row_upper=np.repeat([0.0, np.inf, np.inf], rows),
        lower=np.repeat([-np.inf, 0.0, 0.0, -np.inf, 0.0, 0.0], sizes),
        upper=upper,
    )


def duals(problem: Problem, multipliers: Floats) -> Duals:
    """What the certificate needs.

    Args:
        problem: equation (1).
        multipliers: (rows,) one a row, positive where its lower bound binds.
    """
    n, m = problem.mdp.n_states, len(problem.demonstration_pairs.states)
    return Duals(multipliers[:n], multipliers[n : n + m], multipliers[n + m :])


def _belongs(pairs: Pairs, owners: Ints) -> sparse.csr_array:
    """(m, len(owners)) ones where a row's state is the column's."""
    m = len(pairs.states)
    return sparse.csr_array((np.ones(m), pairs.of(owners), np.arange(m + 1)), shape=(m, len(owners)))
