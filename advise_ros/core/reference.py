"""Equation (1) as the paper prints it, dense and by GLPK: the oracle that the sparse form is tested against."""

from __future__ import annotations

from typing import Any

import cvxpy
import numpy as np

from advise_ros.core.errors import InputError
from advise_ros.core.program import Pairs, Problem, Solution
from advise_ros.core.solve import InfeasibleError

cp: Any = cvxpy  # Its names are made at run time.


def solve(problem: Problem) -> Solution:
    """An optimum of the paper's form, v = B r with B = (I - gamma Pbar)^-1.

    Raises:
        InfeasibleError: the advice is strict (slack_cost 0) and contradicts itself.
        InputError: GLPK gives up; its dense program outgrows it at some thousand states.
    """
    terms, n = problem.terms, problem.mdp.n_states
    b = np.linalg.inv(np.eye(n) - problem.mdp.gamma * problem.mixed.toarray())
    r, xi = cp.Variable(n), cp.Variable(n)
    zeta, eta = cp.Variable(n, nonneg=True), cp.Variable(n, nonneg=True)
    cap = terms.margin_cap if terms.margin_cap > 0 else np.inf
    demonstrated, advised = list(problem.demonstrated), list(problem.advised)
    constraints = [
        cp.abs(r) <= terms.r_max,
        *_margins(problem, problem.demonstration_pairs, b @ r, xi),
        *_margins(problem, problem.advice_pairs, b @ r, zeta + terms.delta - eta),
        *([xi <= cap, zeta <= cap] if np.isfinite(cap) else []),
        *([eta == 0] if terms.slack_cost == 0 else []),
    ]
    objective = (
        -cp.norm1(r)
        + terms.lambda_t * cp.sum(xi[demonstrated])
        + terms.lambda_a * cp.sum(zeta[advised])
        - terms.slack_cost * cp.sum(eta[advised])
    )
    program = cp.Problem(cp.Maximize(objective), constraints)
    if (status := _status(program)) in {cp.INFEASIBLE, cp.settings.INFEASIBLE_OR_UNBOUNDED}:
        raise InfeasibleError('no reward satisfies all answers')
    if status != cp.OPTIMAL:
        raise InputError(f"solver 'cvxpy' (dense, GLPK) could not solve {n} states: {status}; use solver 'highs'")
    return Solution(r.value, b @ r.value, eta.value[advised], float(program.value))


def _status(program: Any) -> str:
    """In what state GLPK left the program."""
    try:
        program.solve(solver=cp.GLPK)
    except cp.SolverError as problem:
        return str(problem).split('.', maxsplit=1)[0]
    return str(program.status)


def _margins(problem: Problem, pairs: Pairs, value: Any, least: Any) -> list[Any]:
    """(P_better - P_worse) v >= least, a row a pair."""
    if not len(pairs.states):
        return []
    return [pairs.differences(problem.mdp).toarray() @ value >= least[list(pairs.states)]]
