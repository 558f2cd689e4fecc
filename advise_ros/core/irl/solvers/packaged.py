"""The program by general interior-point solvers from packages: PIQP and Clarabel.

They are imported when first asked for, so that neither is needed where it is not used.
"""

from __future__ import annotations

import importlib
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.irl.certificate import certified
from advise_ros.core.irl.program import InfeasibleError, Problem, Solution
from advise_ros.core.irl.solvers.sparse_form import Program, duals, write
from advise_ros.core.numerics import Floats

# Tighter than the gap that is wanted: the certificate counts what is left of each equation, not only the largest.
TOLERANCE = 1e-9


class Ended(NamedTuple):
    """How a solver ended: x, a multiplier of each row (positive where its lower bound binds), and what it calls that."""

    x: Floats
    multipliers: Floats
    status: str


def piqp(problem: Problem, _: float) -> Solution:
    """An optimum by PIQP (proximal interior point).

    Raises:
        InfeasibleError: the advice is strict (slack_cost 0) and contradicts itself.
        InputError: the package is missing.
        AdviseError: it ends without an optimum.
    """
    return _checked(problem, piqp_program(write(problem), problem.mdp.n_states), 'piqp')


def piqp_program(program: Program, n: int, tolerance: float = TOLERANCE) -> Ended:
    """A program whose first n rows are equations, by PIQP.

    Args:
        program: as of `write`.
        n: states, so the number of equations.
        tolerance: absolute and relative, of residuals and gap.

    Raises:
        InputError: the package is missing.
    """
    solver = package('piqp', 'piqp', 'piqp').SparseSolver()
    settings = solver.settings
    settings.eps_abs = settings.eps_rel = settings.eps_duality_gap_abs = settings.eps_duality_gap_rel = tolerance
    rows = sparse.csr_matrix(program.matrix)
    solver.setup(
        _nothing(program), program.cost, rows[:n].tocsc(), program.row_lower[:n],
        rows[n:].tocsc(), program.row_lower[n:], None, program.lower, program.upper,
    )
    status = solver.solve()
    result = solver.result
    multipliers = np.concatenate([-result.y, result.z_l - result.z_u])
    return Ended(np.array(result.x), multipliers, status.name)


def clarabel(problem: Problem, _: float) -> Solution:
    """An optimum by Clarabel, whose own sparse factors are the fastest of those it offers here.

    Raises:
        InfeasibleError, InputError, AdviseError: as `piqp`.
    """
    program, n = write(problem), problem.mdp.n_states
    found = package('clarabel', 'clarabel', 'clarabel')
    settings = found.DefaultSettings()
    settings.verbose, settings.direct_solve_method = False, 'qdldl'
    settings.tol_feas = settings.tol_gap_rel = settings.tol_gap_abs = TOLERANCE
    rows, right, n_rows = _conic(program, n)
    cones = [found.ZeroConeT(n), found.NonnegativeConeT(len(right) - n)]
    ended = found.DefaultSolver(_nothing(program), program.cost, rows, right, cones, settings).solve()
    z = np.array(ended.z)[:n_rows]
    return _checked(
        problem, Ended(np.array(ended.x), np.concatenate([-z[:n], z[n:]]), str(ended.status)), 'clarabel'
    )


def package(name: str, install: str, solver: str) -> Any:
    """Import a package that only some solvers need.

    Args:
        name: of the module.
        install: of what pip installs.
        solver: that needs it.

    Raises:
        InputError: it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(f"solver '{solver}' needs {name}; run 'pip install {install}' or choose solver 'highs'") from None


def _nothing(program: Program) -> sparse.csc_matrix:
    """The quadratic part of a linear program."""
    return sparse.csc_matrix((len(program.cost), len(program.cost)))


def _conic(program: Program, n: int) -> tuple[sparse.csc_matrix, Floats, int]:
    """A and b of A x + s = b, s = 0 for the first n rows and s >= 0 for the others; and how many are no bounds."""
    rows, single = sparse.csr_array(program.matrix), sparse.eye_array(len(program.cost), format='csr')
    above, below = np.isfinite(program.upper), np.isfinite(program.lower)
    matrix = sparse.vstack([rows[:n], -rows[n:], single[above], -single[below]])
    right = [program.row_lower[:n], -program.row_lower[n:], program.upper[above], -program.lower[below]]
    return sparse.csc_matrix(matrix), np.concatenate(right), rows.shape[0]


def _checked(problem: Problem, ended: Ended, solver: str) -> Solution:
    if 'primal_infeasible' in ended.status.lower() or 'primalinfeasible' in ended.status.lower():
        raise InfeasibleError('no reward satisfies all answers')
    n = problem.mdp.n_states
    if len(ended.x) < n or not np.isfinite(ended.x[:n]).all() or not np.isfinite(ended.multipliers).all():
        raise AdviseError(f"solver '{solver}' finds no optimum of {n} states; it ends with '{ended.status}'")
    return certified(problem, ended.x[:n], duals(problem, ended.multipliers), solver)
