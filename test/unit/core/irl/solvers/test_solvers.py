"""The solvers behind one call: which is asked, what is proven, and that results are the same by every way to them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
from scipy import sparse

from advise_ros.core.advice.advice import Preference
from advise_ros.core.advice.state import preferences
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.certificate import certified
from advise_ros.core.irl.program import Duals, Evidence, Problem, Solution, favourites, pose
from advise_ros.core.irl.settings import Terms
from advise_ros.core.irl.solvers import choose, highs, packaged
from advise_ros.core.irl.solvers.choose import SOLVERS, order, solve
from advise_ros.core.irl.solvers.interior import elimination, factors
from advise_ros.core.planning.process import Mdp, Transitions, from_transitions, mdp_of
from advise_ros.core.planning.rollout import optimal_table
from support.learning import record

GRID = Grid(1.0, 9, 9, (0.0, 0.0), 3.0, (8, 80, 72, 0), (40, 41, 49))
GENERAL = sorted(SOLVERS.keys() - {'cvxpy'})


def problem_of(answers: Iterable[int] = (0, 1, 2), grid: Grid = GRID, terms: Terms | None = None) -> Problem:
    """Three quarters of the states demonstrated, a fifth of them wrongly; answers about a row of cells each."""
    rng = np.random.default_rng(7)
    right = np.asarray(optimal_table(grid))
    shown = np.where(rng.random(grid.n_states) < 0.2, rng.integers(4, size=grid.n_states), right.argmax(axis=1))
    favourite = np.where((rng.random(grid.n_states) < 0.75) & right.any(axis=1), shown, -1)
    records = [record(1 + row, range(row * 9, row * 9 + 6), [1], [3]) for row in answers]
    return pose(mdp_of(grid, 0.1, 0.95), Evidence(favourite, preferences(records)), terms or Terms())


def forget() -> None:
    """Nothing is remembered of any process."""
    elimination._structures.clear()
    for kept in factors._idle.values():
        kept.clear()


def bytes_of(solution: Solution) -> list[object]:
    return [part.tobytes() if isinstance(part, np.ndarray) else part for part in (*solution[:-1], *solution.duals)]


@pytest.mark.parametrize('name', GENERAL)
def test_every_solver_proves_the_same_optimum_on_a_grid_with_walls(name: str) -> None:
    solution, expected = solve(problem_of(), name), solve(problem_of(), 'highs')
    assert (solution.status, solution.solver) == ('optimal', name)
    assert solution.objective == pytest.approx(expected.objective, rel=1e-6)
    assert solution.bound >= expected.objective * (1 - 1e-9)


@pytest.mark.parametrize('name', GENERAL)
def test_an_answer_taken_back_leaves_no_trace(name: str) -> None:
    """Nor does what was remembered of the process meanwhile."""
    before = bytes_of(solve(problem_of((0, 1)), name))
    solve(problem_of((0, 1, 2)), name)
    assert bytes_of(solve(problem_of((0, 1)), name)) == before
    forget()
    assert bytes_of(solve(problem_of((1, 0)), name)) == before


def test_the_interior_method_stops_at_the_gap_that_is_asked_for() -> None:
    rough, exact = solve(problem_of(), 'interior', gap=1e-2), solve(problem_of(), 'interior')
    assert 1e-6 < rough.gap <= 1e-2
    assert rough.status == 'approximate'
    assert rough.bound >= exact.objective


def test_a_process_of_many_actions_with_several_preferred_ones() -> None:
    """Rows that share no action: the mesh of their star has edges of both signs."""
    rng = np.random.default_rng(3)
    stacked = rng.random((6 * 30, 30)) * (rng.random((6 * 30, 30)) < 0.15) + 1e-3 * np.eye(30)[np.arange(180) % 30]
    mdp = Mdp(sparse.csr_array(stacked / stacked.sum(axis=1, keepdims=True)), 0.9)
    advice = {state: Preference((0, 1, 2), tuple((a, b) for a in (0, 1, 2) for b in (3, 4, 5))) for state in range(12)}
    problem = pose(mdp, Evidence(rng.integers(-1, 6, size=30), advice), Terms())
    found = solve(problem, 'interior')
    assert found.status == 'optimal'
    assert found.objective == pytest.approx(solve(problem, 'highs').objective, rel=1e-6)


def test_size_chooses_the_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    small = problem_of(grid=Grid(1.0, 9, 6, (0.0, 0.0), 3.0, (8, 0)))
    assert order(small)[0] == 'highs'
    assert order(problem_of())[0] == 'piqp'
    monkeypatch.setattr(choose, 'LARGE', 100)
    assert order(problem_of())[:2] == ('interior-cholmod', 'interior')
    assert order(problem_of(terms=Terms(slack_cost=0.0)))[0] == 'piqp'
    monkeypatch.setattr(choose, 'FEW_OUTCOMES', 1)
    assert order(problem_of())[0] == 'piqp'


def test_where_one_solver_proves_nothing_the_next_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    def give_up(problem: Problem, gap: float) -> Solution:
        raise AdviseError('no')

    def badly(problem: Problem, gap: float) -> Solution:
        found = highs.solve(problem)
        return found._replace(bound=found.objective * 1.1)

    monkeypatch.setitem(SOLVERS, 'piqp', give_up)
    assert solve(problem_of()).solver == 'clarabel'
    monkeypatch.setitem(SOLVERS, 'clarabel', badly)
    assert solve(problem_of()).solver == 'highs'
    assert solve(problem_of()).status == 'optimal'
    monkeypatch.setitem(SOLVERS, 'highs', give_up)
    assert solve(problem_of()).status == 'approximate'
    monkeypatch.setitem(SOLVERS, 'clarabel', give_up)
    with pytest.raises(AdviseError, match='no'):
        solve(problem_of())


def test_what_cannot_be_asked_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    strict = problem_of(terms=Terms(slack_cost=0.0))
    for name in ('interior', 'interior-cholmod'):
        with pytest.raises(InputError, match=f"'{name}' needs elastic advice; set slack_cost above 0 or use solver 'highs'"):
            solve(strict, name)
    with pytest.raises(InputError, match="solver 'abacus' is unknown; choose auto, highs, piqp"):
        solve(strict, 'abacus')
    forget()
    monkeypatch.setattr(packaged.importlib, 'import_module', _missing)
    with pytest.raises(InputError, match="solver 'piqp' needs piqp; run 'pip install piqp' or choose solver 'highs'"):
        solve(strict, 'piqp')
    with pytest.raises(InputError, match="solver 'interior' needs qdldl; run 'pip install qdldl' or choose"):
        solve(problem_of(), 'interior')
    with pytest.raises(InputError, match="solver 'interior-cholmod' needs cvxopt; run 'pip install cvxopt' or choose"):
        solve(problem_of(), 'interior-cholmod')


def test_without_cvxopt_auto_takes_the_factors_that_are_there_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choose, 'LARGE', 100)
    assert solve(problem_of()).solver == 'interior-cholmod'
    forget()
    real = factors.importlib.import_module
    monkeypatch.setattr(factors.importlib, 'import_module', lambda name: _missing(name) if 'cvxopt' in name else real(name))
    assert solve(problem_of()).solver == 'interior'


@pytest.mark.parametrize('kind', factors.KINDS)
def test_factors_of_what_is_not_positive_definite_are_refused_and_the_next_are_right(kind: str) -> None:
    pattern = factors.Pattern(np.array([0, 1, 3], dtype=np.int32), np.array([0, 0, 1], dtype=np.int32))
    process = Mdp(sparse.csr_array(np.eye(2)), 0.9)
    with factors.factors(process, pattern, kind) as kept:
        with pytest.raises(AdviseError, match='cannot be factored'):
            kept.factor(np.zeros(3))
        kept.factor(np.array([4.0, 1.0, 2.0]))
        assert kept.solve(np.array([1.0, 2.0])) == pytest.approx([0.0, 1.0])
        # Whoever comes meanwhile has factors of their own.
        with factors.factors(process, pattern, kind) as others:
            others.factor(np.array([1.0, 0.0, 1.0]))
        assert kept.solve(np.array([1.0, 2.0])) == pytest.approx([0.0, 1.0])


def _missing(name: str) -> None:
    raise ImportError(name)


def test_the_certificate_proves_nothing_wrong_from_any_value_and_multipliers() -> None:
    """Whatever point and multipliers come, the point is one of the program and the bound holds."""
    problem, rng = problem_of(), np.random.default_rng(0)
    optimum = solve(problem, 'highs').objective
    n, m, k = problem.mdp.n_states, len(problem.demonstration_pairs.states), len(problem.advice_pairs.states)
    for scale in (0.0, 0.1, 10.0, 1000.0):
        value = rng.normal(size=n) * scale
        multipliers = Duals(rng.normal(size=n), rng.normal(size=m) * scale, rng.normal(size=k) * scale)
        found = certified(problem, value, multipliers, 'any')
        assert found.objective <= optimum * (1 + 1e-9)
        assert found.bound >= optimum * (1 - 1e-9)
        assert np.abs(found.reward).max(initial=0.0) <= 1.0 + 1e-12


@pytest.mark.parametrize('seed', [5, 14, 24, 39])
def test_without_a_cap_the_proof_is_tight_beside_an_action_of_the_same_outcome(seed: int) -> None:
    rng = np.random.default_rng(seed)
    moves = rng.random((12, 3)) * (rng.random((12, 3)) < 0.5)
    moves[np.arange(12), rng.integers(3, size=12)] += 0.5
    mdp = Mdp(sparse.csr_array(moves / moves.sum(axis=1, keepdims=True)), 0.5)
    problem = pose(mdp, Evidence(rng.integers(-1, 4, size=3), {}), Terms(margin_cap=0.0))
    assert (problem.caps == 0.0).any()
    assert solve(problem, 'highs').status == 'optimal'


def test_terms_that_leave_the_program_unbounded_are_refused() -> None:
    with pytest.raises(InputError, match='slack_cost 100 is less than lambda_a 500'):
        problem_of(terms=Terms(slack_cost=100.0, margin_cap=0.0))
    one_action = Mdp(sparse.csr_array(np.eye(3)), 0.9)
    with pytest.raises(InputError, match='one action only'):
        pose(one_action, Evidence(np.full(3, -1), {}), Terms())


def test_a_process_from_its_transitions() -> None:
    listed = Transitions(
        action=np.array([0, 0, 1, 1, 1]), state=np.array([0, 1, 0, 1, 1]), target=np.array([1, 0, 0, 0, 1]),
        probability=np.array([1.0, 1.0, 1.0, 0.25, 0.75]),
    )
    mdp = from_transitions(2, 2, 0.9, listed)
    assert mdp.stacked.toarray().tolist() == [[0, 1], [1, 0], [1, 0], [0.25, 0.75]]
    assert favourites(3, 2, np.array([0, 0, 2, 2, 2]), np.array([1, 0, 1, 1, 0])).tolist() == [0, -1, 1]


@pytest.mark.parametrize(('change', 'sentence'), [
    ({'action': np.array([0, 0, 2])}, 'transitions name action 0 to 2; allowed is 0 to 1'),
    ({'state': np.array([0, -1, 0])}, 'transitions name state -1 to 0; allowed is 0 to 1'),
    ({'target': np.array([0, 5, 0])}, 'transitions name target 0 to 5; allowed is 0 to 1'),
    ({'probability': np.array([1.0, np.nan, 1.0])}, 'negative probability or one that is no number'),
    ({'probability': np.array([1.0, 1.0, 0.5])}, 'transitions of state 0 under action 1 sum to 0.5; they must sum to 1'),
    ({}, 'transitions of state 1 under action 1 sum to 0; they must sum to 1'),
])
def test_transitions_that_make_no_process_are_told(change: dict[str, np.ndarray], sentence: str) -> None:
    listed = Transitions(np.array([0, 0, 1]), np.array([0, 1, 0]), np.array([1, 0, 1]), np.ones(3))
    with pytest.raises(InputError, match=sentence):
        from_transitions(2, 2, 0.9, listed._replace(**change))
