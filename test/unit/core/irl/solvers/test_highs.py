"""How the program's solvers end: a second method where the first gives up, and words where none succeeds."""

from __future__ import annotations

import re
from typing import Any

import cvxpy
import pytest

from advise_ros.core.demonstrations.demonstration import count
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.program import Evidence, Problem, pose
from advise_ros.core.irl.settings import Terms
from advise_ros.core.irl.solvers import cvxpy_reference, highs
from advise_ros.core.planning.process import mdp_of
from support.learning import CORRIDOR, EAST, demonstration
from support.walks import walk

GRID_24X24 = Grid(2.0, 24, 24, (-1.0, -1.0), 3.0, (23, 575, 552, 0))


def problem_of(grid: Grid, *flights: Any) -> Problem:
    return pose(mdp_of(grid, 0.0, 0.95), Evidence(count(grid, flights).favourite(), {}), Terms())


@pytest.fixture(scope='module')
def large() -> Problem:
    """2304 states; HiGHS 1.15's dual simplex leaves it with status 'Not Set'."""
    return problem_of(GRID_24X24, *(walk(GRID_24X24, number) for number in range(5)))


@pytest.fixture
def small() -> Problem:
    return problem_of(CORRIDOR, demonstration(CORRIDOR, [(0, EAST), (1, EAST), (2, EAST)]))


@pytest.fixture
def ended(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The status of each method that was tried."""
    tried: list[str] = []
    run = highs._run

    def note(*arguments: Any) -> Any:
        highs = run(*arguments)
        tried.append(highs.modelStatusToString(highs.getModelStatus()))
        return highs

    monkeypatch.setattr(highs, '_run', note)
    return tried


def test_where_the_first_method_gives_up_the_next_one_solves(large: Problem, ended: list[str]) -> None:
    first, again = highs.solve(large), highs.solve(large)
    assert ended[len(ended) // 2 - 1] == 'Optimal'
    assert first.objective == pytest.approx(31561.269161, rel=1e-8)  # As the dense form by GLPK.
    assert (first.reward.tobytes(), first.value.tobytes()) == (again.reward.tobytes(), again.value.tobytes())


@pytest.mark.parametrize('method', highs.METHODS, ids=lambda method: '-'.join(map(str, method.values())))
def test_every_method_finds_the_same_optimum(
    small: Problem, monkeypatch: pytest.MonkeyPatch, method: dict[str, object],
) -> None:
    expected = highs.solve(small).objective
    monkeypatch.setattr(highs, 'METHODS', (method,))
    assert highs.solve(small).objective == pytest.approx(expected)


def test_when_no_method_ends_with_an_optimum_the_last_status_is_told(
    small: Problem, monkeypatch: pytest.MonkeyPatch, ended: list[str],
) -> None:
    monkeypatch.setattr(highs, 'METHODS', tuple({**method, 'time_limit': 0.0, 'presolve': 'off'} for method in highs.METHODS))
    with pytest.raises(AdviseError, match=r"no method of HiGHS solves the program of 13 rows .*'Time limit reached'"):
        highs.solve(small)
    assert len(ended) == len(highs.METHODS)


def test_an_option_that_this_highs_does_not_know_is_named(small: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(highs, 'METHODS', ({'solver': 'abacus'},))
    with pytest.raises(AdviseError, match=r"HiGHS \(\d+.*\) does not know option 'solver' = abacus"):
        highs.solve(small)


def test_a_program_that_highs_refuses_is_told(small: Problem) -> None:
    broken = small._replace(terms=small.terms._replace(slack_cost=float('nan'), delta=float('nan'), r_max=float('nan')))
    with pytest.raises(AdviseError, match='HiGHS refuses the program'):
        highs.solve(broken)


@pytest.mark.parametrize('status', [cvxpy.UNBOUNDED, cvxpy.UNBOUNDED_INACCURATE, None])
def test_the_reference_says_when_it_cannot(small: Problem, monkeypatch: pytest.MonkeyPatch, status: str | None) -> None:
    monkeypatch.setattr(cvxpy.Problem, 'solve', lambda *_, **__: None)
    monkeypatch.setattr(cvxpy.Problem, 'status', status)
    sentence = f"solver 'cvxpy' (dense, GLPK) could not solve 4 states: {status}; use solver 'highs'"
    with pytest.raises(InputError, match=re.escape(sentence)):
        cvxpy_reference.solve(small)


def test_the_reference_passes_a_failure_of_glpk_on_in_words(small: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise cvxpy.SolverError("Solver 'GLPK' failed. Try another solver, or solve with verbose=True.")

    monkeypatch.setattr(cvxpy.Problem, 'solve', fail)
    with pytest.raises(InputError, match="could not solve 4 states: Solver 'GLPK' failed; use solver 'highs'"):
        cvxpy_reference.solve(small)
