"""Equation (1) as the paper prints it, dense and by GLPK: the readable oracle that the sparse form is tested against."""

from __future__ import annotations

import cvxpy as cp
import numpy as np

from advise_ros.core.numerics import Floats
from advise_ros.core.program import Pairs, Problem, Solution
from advise_ros.core.solve import InfeasibleError


def solve(problem: Problem) -> Solution:
    """An optimum of the paper's form, v = B r with B = (I - gamma Pbar)^-1.

    Raises:
        InfeasibleError: the advice is strict (slack_cost 0) and contradicts itself.
    """
    terms, n = problem.terms, problem.mdp.n_states
    b = np.linalg.inv(np.eye(n) - problem.mdp.gamma * problem.mixed.toarray())
    r, xi = cp.Variable(n), cp.Variable(n)
    zeta, eta = cp.Variable(n, nonneg=True), cp.Variable(n, nonneg=True)
    constraints = [cp.abs(r) <= terms.r_max]
    constraints += _margins(problem, problem.demonstration_pairs, b, r, xi)
    constraints += _margins(problem, problem.advice_pairs, b, r, zeta + terms.delta - eta)
    if terms.margin_cap > 0:
        constraints += [xi <= terms.margin_cap, zeta <= terms.margin_cap]
    if terms.slack_cost == 0:
        constraints += [eta == 0]
    d, s = list(problem.demonstrated), list(problem.advised)
    objective = -cp.norm1(r)
    if d:
        objective += terms.lambda_t * cp.sum(xi[d])
    if s:
        objective += terms.lambda_a * cp.sum(zeta[s]) - terms.slack_cost * cp.sum(eta[s])
    program = cp.Problem(cp.Maximize(objective), constraints)
    program.solve(solver=cp.GLPK)
    if program.status == cp.INFEASIBLE:
        raise InfeasibleError('no reward satisfies all answers')
    return Solution(r.value, b @ r.value, eta.value[s], float(program.value))


def _margins(problem: Problem, pairs: Pairs, b: Floats, r: cp.Variable, least: cp.Expression) -> list[cp.Constraint]:
    """(P_better - P_worse) B r >= least, a row a pair."""
    if not len(pairs.states):
        return []
    return [pairs.differences(problem.mdp).toarray() @ b @ r >= least[list(pairs.states)]]
