"""Equation (1) as the paper prints it, dense and by GLPK: the oracle that the sparse form is tested against."""

from __future__ import annotations

from typing import Any, NamedTuple

import cvxpy
import numpy as np

from advise_ros.core.errors import InputError
from advise_ros.core.irl.certificate import certified
from advise_ros.core.irl.program import Duals, InfeasibleError, Pairs, Problem, Solution
from advise_ros.core.numerics import Floats

cp: Any = cvxpy  # Its names are made at run time.


class Form(NamedTuple):
    """How the program is written for cvxpy.

    Attributes:
        dense: v = (I - gamma Pbar)^-1 r in every row, as printed; otherwise v is a variable and rows are sparse.
        backend: cvxpy's name of the solver.
    """

    dense: bool = True
    backend: str = 'GLPK'


PRINTED = Form()


def solve(problem: Problem, form: Form = PRINTED) -> Solution:
    """An optimum of the paper's form, v = B r with B = (I - gamma Pbar)^-1.

    Raises:
        InfeasibleError: the advice is strict (slack_cost 0) and contradicts itself.
        InputError: the backend gives up; the dense program outgrows GLPK at some thousand states.
    """
    terms, n = problem.terms, problem.mdp.n_states
    r, v, definition = _variables(problem, form)
    xi, zeta, eta = cp.Variable(n), cp.Variable(n, nonneg=True), cp.Variable(n, nonneg=True)
    demonstrated, advised = list(problem.demonstrated), list(problem.advised)
    shown = _margins(problem, form, problem.demonstration_pairs, v, xi)
    answered = _margins(problem, form, problem.advice_pairs, v, zeta + terms.delta - eta)
    constraints = [
        *definition, cp.abs(r) <= terms.r_max, *shown, *answered,
        *([xi <= terms.cap, zeta <= terms.cap] if np.isfinite(terms.cap) else []),
        *([eta == 0] if terms.strict else []),
    ]
    objective = (
        -cp.norm1(r)
        + terms.lambda_t * cp.sum(xi[demonstrated])
        + terms.lambda_a * cp.sum(zeta[advised])
        - terms.slack_cost * cp.sum(eta[advised])
    )
    program = cp.Problem(cp.Maximize(objective), constraints)
    _run(program, form, n)
    value = v.value if form.dense else np.linalg.solve(_system(problem), r.value)
    return certified(problem, value, _duals(problem, shown, answered), f'cvxpy {form.backend}')


def _variables(problem: Problem, form: Form) -> tuple[Any, Any, list[Any]]:
    """Reward, value, and what ties them."""
    r = cp.Variable(problem.mdp.n_states)
    if form.dense:
        return r, np.linalg.inv(_system(problem)) @ r, []
    v = cp.Variable(problem.mdp.n_states)
    return r, v, [v == r + problem.mdp.gamma * (problem.mixed @ v)]


def _system(problem: Problem) -> Floats:
    return np.eye(problem.mdp.n_states) - problem.mdp.gamma * problem.mixed.toarray()


def _margins(problem: Problem, form: Form, pairs: Pairs, value: Any, least: Any) -> list[Any]:
    """(P_better - P_worse) v >= least, a row a pair."""
    if not len(pairs.states):
        return []
    rows = pairs.differences(problem.mdp)
    return [(rows.toarray() if form.dense else rows) @ value >= least[list(pairs.states)]]


def _run(program: Any, form: Form, n: int) -> None:
    status = _status(program, form)
    if status in {cp.INFEASIBLE, cp.settings.INFEASIBLE_OR_UNBOUNDED}:
        raise InfeasibleError('no reward satisfies all answers')
    if status != cp.OPTIMAL:
        written = 'dense' if form.dense else 'sparse'
        raise InputError(
            f"solver 'cvxpy' ({written}, {form.backend}) could not solve {n} states: {status}; use solver 'highs'"
        )


def _status(program: Any, form: Form) -> str:
    """In what state the backend left the program."""
    try:
        program.solve(solver=form.backend)
    except cp.SolverError as problem:
        return str(problem).split('.', maxsplit=1)[0]
    return str(program.status)


def _duals(problem: Problem, shown: list[Any], answered: list[Any]) -> Duals:
    """The weights that cvxpy reports, with the flow that belongs to them."""
    w = shown[0].dual_value if shown else np.zeros(0)
    z = answered[0].dual_value if answered else np.zeros(0)
    owed = problem.demonstration_pairs.weighted(problem.mdp, w) + problem.advice_pairs.weighted(problem.mdp, z)
    return Duals(np.linalg.solve(_system(problem).T, -owed).astype(np.float64), w, z)
