"""The program solved by HiGHS called directly, one thread, fixed seed: the same bits at every call."""

from __future__ import annotations

from typing import Any

import highspy
import numpy as np

from advise_ros.core.errors import AdviseError
from advise_ros.core.irl.certificate import certified
from advise_ros.core.irl.program import InfeasibleError, Problem, Solution
from advise_ros.core.irl.solvers.sparse_form import Program, duals, write

# The bounds on r bound everything else, so what is not feasible cannot be unbounded instead.
INFEASIBLE = (highspy.HighsModelStatus.kInfeasible, highspy.HighsModelStatus.kUnboundedOrInfeasible)
SHARED_OPTIONS: dict[str, object] = {'output_flag': False, 'threads': 1, 'random_seed': 0}
# Tried in this order. HiGHS's dual simplex, the fastest here, gives some larger programs up at its first iteration
# without a status; interior point with crossover and the primal simplex have their own ways to the same optimum.
METHODS: tuple[dict[str, object], ...] = (
    {'solver': 'simplex'},
    {'solver': 'ipx'},
    {'solver': 'simplex', 'simplex_strategy': 4},
)


def solve(problem: Problem) -> Solution:
    """An optimum at a vertex of the program.

    Raises:
        InfeasibleError: the advice is strict (slack_cost 0) and contradicts itself.
        AdviseError: no method of HiGHS finds an optimum.
    """
    solution = _minimise(write(problem))
    value = np.array(solution.col_value[: problem.mdp.n_states])
    return certified(problem, value, duals(problem, np.array(solution.row_dual)), 'highs')


def _minimise(program: Program) -> Any:
    """The optimum found by the first method that ends with one."""
    ended = ''
    for method in METHODS:
        highs = _run(program, method)
        status = highs.getModelStatus()
        if status in INFEASIBLE:
            raise InfeasibleError('no reward satisfies all answers')
        if status == highspy.HighsModelStatus.kOptimal:
            return highs.getSolution()
        ended = highs.modelStatusToString(status)
    n_rows, n_columns = program.matrix.shape
    raise AdviseError(
        f"no method of HiGHS solves the program of {n_rows} rows and {n_columns} columns; the last ended with '{ended}'"
    )


def _run(program: Program, method: dict[str, object]) -> Any:
    """A fresh solver after its run: nothing of one method or of an earlier call is left to the next."""
    highs: Any = highspy.Highs()
    for option, value in {**SHARED_OPTIONS, **method}.items():
        if highs.setOptionValue(option, value) != highspy.HighsStatus.kOk:
            raise AdviseError(f"this version of HiGHS ({highs.version()}) does not know option '{option}' = {value}")
    if highs.passModel(_model(program)) == highspy.HighsStatus.kError:
        raise AdviseError('HiGHS refuses the program; a constant is too large or not a number')
    highs.run()
    return highs


def _model(program: Program) -> highspy.HighsLp:
    model = highspy.HighsLp()
    model.num_row_, model.num_col_ = program.matrix.shape
    model.col_cost_, model.col_lower_, model.col_upper_ = program.cost, program.lower, program.upper
    model.row_lower_, model.row_upper_ = program.row_lower, program.row_upper
    model.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    model.a_matrix_.start_ = program.matrix.indptr
    model.a_matrix_.index_ = program.matrix.indices
    model.a_matrix_.value_ = program.matrix.data
    return model
