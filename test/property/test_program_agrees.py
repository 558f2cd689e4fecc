"""The sparse program and the paper's dense one have the same optimum on random decision processes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings
from scipy import sparse

from advise_ros.core import highs, reference
from advise_ros.core.mdp import Mdp
from advise_ros.core.program import Evidence, InfeasibleError, Preference, Problem, Solution, Terms, pose

RELATIVE = 1e-6
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
    sparse_form, dense_form = _solved(highs.solve, problem), _solved(reference.solve, problem)
    assert (sparse_form is None) == (dense_form is None)
    if sparse_form is not None and dense_form is not None:
        assert sparse_form.objective == pytest.approx(dense_form.objective, rel=RELATIVE, abs=RELATIVE)
        _satisfies(problem, sparse_form)
        _satisfies(problem, dense_form)


def _satisfies(problem: Problem, solution: Solution) -> None:
    """The reward is within its bounds, the value belongs to it, and the proof of optimality is its own."""
    assert solution.status == 'optimal'
    assert solution.bound >= solution.objective - 1e-6 * max(1.0, abs(solution.objective))
    backed_up = solution.reward + problem.mdp.gamma * (problem.mixed @ solution.value)
    assert solution.value == pytest.approx(backed_up, abs=1e-6)
    assert np.abs(solution.reward).max() <= problem.terms.r_max + 1e-7
    assert (solution.slack >= -1e-9).all()


@settings(max_examples=60, deadline=None, derandomize=True)
@given(cases(contradictory=False), terms())
def test_the_forms_agree(case: Case, constants: Terms) -> None:
    _check(case, constants)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(cases(contradictory=True), terms())
def test_the_forms_agree_on_contradictory_advice(case: Case, constants: Terms) -> None:
    _check(case, constants)
