"""The program's default solver: HiGHS called directly, one thread, fixed seed."""

from __future__ import annotations

from typing import Any

import highspy
import numpy as np

from advise_ros.core.errors import AdviseError
from advise_ros.core.numerics import Floats
from advise_ros.core.program import Problem, Program, Solution, write

# The bounds on r bound everything else, so what is not feasible cannot be unbounded instead.
INFEASIBLE = (highspy.HighsModelStatus.kInfeasible, highspy.HighsModelStatus.kUnboundedOrInfeasible)


class InfeasibleError(AdviseError):
    """No reward satisfies the strict advice."""


def solve(problem: Problem) -> Solution:
    """An optimum, the same bits at every call.

    Raises:
        InfeasibleError: the advice is strict (slack_cost 0) and contradicts itself.
    """
    x = _minimise(program := write(problem))
    n, n_s = problem.mdp.n_states, len(problem.advised)
    return Solution(
        reward=x[n : 2 * n] - x[2 * n : 3 * n],
        value=x[:n],
        slack=x[len(x) - n_s :],
        objective=-float(program.cost @ x),
    )


def _minimise(program: Program) -> Floats:
    highs: Any = highspy.Highs()
    for option, value in (('output_flag', False), ('threads', 1), ('random_seed', 0), ('solver', 'simplex')):
        highs.setOptionValue(option, value)
    highs.passModel(_model(program))
    highs.run()
    status = highs.getModelStatus()
    if status in INFEASIBLE:
        raise InfeasibleError('no reward satisfies all answers')
    if status != highspy.HighsModelStatus.kOptimal:
        raise AdviseError(f'the solver ended with: {highs.modelStatusToString(status)}')
    return np.array(highs.getSolution().col_value)


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
