"""Every solver and the paper's dense form by GLPK have the same optimum on random decision processes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings
from scipy import sparse

from advise_ros.core.advice.advice import Preference
from advise_ros.core.irl.program import Evidence, InfeasibleError, Problem, Solution, pose
from advise_ros.core.irl.settings import Terms
from advise_ros.core.irl.solvers import cvxpy_reference
from advise_ros.core.irl.solvers.choose import SOLVERS, solve
from advise_ros.core.planning.process import Mdp

RELATIVE = 1e-6
ELASTIC_ONLY = {'interior', 'interior-cholmod'}
# Made for large programs; of these tiny ones it leaves one in some hundreds unproven and says so, and 'auto' asks on.
MAY_STAY_UNPROVEN = {'interior-cholmod'}
Solver = Callable[[Problem], Solution]


class Case(NamedTuple):
    """A random process and its evidence."""

    mdp: Mdp
    evidence: Evidence


@st.composite
def cases(draw: st.DrawFn, *, contradictory: bool) -> Case:
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n, n_actions = draw(st.integers(2, 8)), draw(st.integers(2, 4))
    transitions = rng.random((n_actions * n, n)) * (rng.random((n_actions * n, n)) < 0.5)
    transitions[np.arange(n_actions * n), rng.integers(n, size=n_actions * n)] += 0.5
    gamma = draw(st.sampled_from([0.5, 0.9, 0.95]))
    mdp = Mdp(sparse.csr_array(transitions / transitions.sum(axis=1, keepdims=True)), gamma)
    favourite = rng.integers(-1, n_actions, size=n)
    advised = rng.choice(n, size=draw(st.integers(0, n)), replace=False)
    return Case(mdp, Evidence(favourite, {int(s): _preference(rng, n_actions, contradictory) for s in advised}))


def _preference(rng: np.random.Generator, n_actions: int, contradictory: bool) -> Preference:
    order = rng.permutation(n_actions)
    cut = int(rng.integers(1, n_actions))
    pairs = {(int(a), int(b)) for a in order[:cut] for b in order[cut:]}
    if contradictory:
        pairs |= {(b, a) for a, b in pairs}
    return Preference(tuple(sorted({a for a, _ in pairs})), tuple(sorted(pairs)))


@st.composite
def terms(draw: st.DrawFn) -> Terms:
    return Terms(
        reading=draw(st.sampled_from(['replace', 'literal'])),
        delta=draw(st.sampled_from([0.0, 0.01, 0.1])),
        margin_cap=draw(st.sampled_from([0.0, 0.1, 0.2])),
        slack_cost=draw(st.sampled_from([0.0, 1000.0])),
    )


def _solved(solver: Solver, problem: Problem) -> Solution | None:
    try:
        return solver(problem)
    except InfeasibleError:
        return None


def _check(case: Case, constants: Terms) -> None:
    problem = pose(case.mdp, case.evidence, constants)
    dense = _solved(cvxpy_reference.solve, problem)
    if dense is not None:
        _satisfies(problem, dense)
    for name in SOLVERS.keys() - {'cvxpy'} - (ELASTIC_ONLY if constants.strict else set()):
        found = _solved(lambda posed, name=name: solve(posed, name), problem)  # type: ignore[misc]
        assert (found is None) == (dense is None), name
        if found is not None and found.status != 'optimal' and name in MAY_STAY_UNPROVEN:
            assert found.gap < 100 * RELATIVE, name
        elif found is not None and dense is not None:
            assert found.objective == pytest.approx(dense.objective, rel=RELATIVE, abs=RELATIVE), name
            _satisfies(problem, found)


def _satisfies(problem: Problem, solution: Solution) -> None:
    """The reward is within its bounds, the value belongs to it, and the proof of optimality is its own."""
    assert solution.status == 'optimal'
    assert solution.bound >= solution.objective - 1e-6 * max(1.0, abs(solution.objective))
    backed_up = solution.reward + problem.mdp.gamma * (problem.mixed @ solution.value)
    assert solution.value == pytest.approx(backed_up, abs=1e-6)
    assert np.abs(solution.reward).max() <= problem.terms.r_max + 1e-7
    assert (solution.slack >= -1e-9).all()


@settings(max_examples=150, deadline=None, derandomize=True)
@given(cases(contradictory=False), terms())
def test_the_forms_agree(case: Case, constants: Terms) -> None:
    _check(case, constants)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(cases(contradictory=True), terms())
def test_the_forms_agree_on_contradictory_advice(case: Case, constants: Terms) -> None:
    _check(case, constants)
