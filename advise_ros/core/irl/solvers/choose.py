"""Every solver of the program behind one call, and which one is taken by default.

    solution = solve(problem)                      # by size; proven to be within 1e-6 of the optimum
    solution = solve(problem, solver='highs')

docs/performance.md has the measurements that the choice by size rests on.
"""

from __future__ import annotations

from collections.abc import Callable

from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.irl.program import EXACT, InfeasibleError, Problem, Solution
from advise_ros.core.irl.solvers import highs, packaged

AUTO = 'auto'
# Up to this many states the simplex method is quicker than a person notices.
SMALL = 256
# Beyond, PIQP takes more than twice as long as the method of our own, if actions have few outcomes each.
LARGE = 2000
FEW_OUTCOMES = 8


def _highs(problem: Problem, gap: float) -> Solution:
    return highs.solve(problem)


def _cvxpy(problem: Problem, gap: float) -> Solution:
    from advise_ros.core.irl.solvers import cvxpy_reference  # noqa: PLC0415 - half a second to import, and seldom wanted

    return cvxpy_reference.solve(problem)


def _interior(problem: Problem, gap: float) -> Solution:
    from advise_ros.core.irl.solvers.interior import method  # noqa: PLC0415 - its package is needed for large programs only

    return method.solve(problem, gap)


def _interior_cholmod(problem: Problem, gap: float) -> Solution:
    from advise_ros.core.irl.solvers.interior import factors, method  # noqa: PLC0415 - as above

    return method.solve(problem, gap, factors.CHOLMOD)


SOLVERS: dict[str, Callable[[Problem, float], Solution]] = {
    'highs': _highs,
    'piqp': packaged.piqp,
    'clarabel': packaged.clarabel,
    'interior': _interior,
    'interior-cholmod': _interior_cholmod,
    'cvxpy': _cvxpy,
}


def solve(problem: Problem, solver: str = AUTO, gap: float = EXACT) -> Solution:
    """An optimum of equation (1), the same bits at every call.

    Args:
        problem: from `program.pose`.
        solver: 'auto' or a key of `SOLVERS`.
        gap: relative distance to the proven bound at which an iterative solver may stop. With 'auto', a solver that
            does not come so near is followed by the next; a named one may end as 'approximate'.

    Raises:
        InfeasibleError: the advice is strict (slack_cost 0) and contradicts itself.
        InputError: the solver is unknown, not installed, or not made for this program.
        AdviseError: no solver finds an optimum.
    """
    if solver == AUTO:
        return _first_that_proves(problem, gap)
    if solver not in SOLVERS:
        raise InputError(f"solver '{solver}' is unknown; choose {AUTO}, {', '.join(SOLVERS)}")
    return SOLVERS[solver](problem, gap)


def order(problem: Problem) -> tuple[str, ...]:
    """The solvers that 'auto' asks, one after the other until one proves its optimum.

    A packaged solver is first wherever it takes at most twice the time of the fastest. HiGHS ends at a vertex, whose
    bits depend on nothing but the program.
    """
    n = problem.mdp.n_states
    if n <= SMALL:
        return ('highs', 'piqp', 'clarabel')
    sparse = problem.mdp.stacked.nnz <= FEW_OUTCOMES * n * problem.mdp.n_actions
    if n > LARGE and sparse and not (problem.terms.strict and len(problem.advised)):
        return ('interior-cholmod', 'interior', 'piqp', 'clarabel')
    return ('piqp', 'clarabel', 'highs')


def _first_that_proves(problem: Problem, gap: float) -> Solution:
    best: Solution | None = None
    ended: AdviseError | None = None
    for name in order(problem):
        try:
            solution = SOLVERS[name](problem, gap)
        except InfeasibleError:
            raise
        except AdviseError as error:
            ended = error
            continue
        if solution.gap <= gap:
            return solution
        best = solution if best is None or solution.gap < best.gap else best
    if best is None:
        raise ended or AdviseError('no solver was asked')
    return best
