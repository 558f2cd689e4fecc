"""Looking ahead near an answer: the certified bounds contain the exact optimum, and what is no preview is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from advise_ros.core.advice.advice import Preference
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.program import EXACT, Evidence, Problem, pose
from advise_ros.core.irl.settings import Terms
from advise_ros.core.irl.solvers import local_preview
from advise_ros.core.irl.solvers.choose import solve
from advise_ros.core.irl.solvers.local_preview import Solved, changed, near
from advise_ros.core.irl.solvers.packaged import Ended
from advise_ros.core.irl.solvers.sparse_form import Program
from advise_ros.core.learning.session import Work
from advise_ros.core.numerics import Ints
from advise_ros.core.planning.process import mdp_of
from advise_ros.core.planning.rollout import optimal_table
from support.learning import answer, ready

SIDE = 16
PLAIN = Grid(1.0, SIDE, SIDE, (0.0, 0.0), 3.0, (30, 250))
WALLED = Grid(1.0, SIDE, SIDE, (0.0, 0.0), 3.0, (30, 250), tuple(range(SIDE * 7 + 3, SIDE * 7 + 12)))
NORTH = Preference((1,), ((1, 3),))
SOUTH = Preference((3,), ((3, 0), (3, 1), (3, 2)))


def square(x: int, y: int, layer: int = 0) -> list[int]:
    """States of 3 x 3 cells."""
    return [layer * SIDE * SIDE + (y + j) * SIDE + x + i for j in range(3) for i in range(3)]


def favourite_of(grid: Grid, seed: int) -> Ints:
    rng = np.random.default_rng(seed)
    right = np.asarray(optimal_table(grid))
    shown = np.where(rng.random(grid.n_states) < 0.2, rng.integers(4, size=grid.n_states), right.argmax(axis=1))
    return np.where((rng.random(grid.n_states) < 0.8) & right.any(axis=1), shown, -1)


def posed(grid: Grid, seed: int, advice: dict[int, Preference], terms: Terms | None = None) -> Problem:
    return pose(mdp_of(grid, 0.1, 0.95), Evidence(favourite_of(grid, seed), advice), terms or Terms())


FIRST = dict.fromkeys(square(3, 3), NORTH)
SECOND = {**FIRST, **dict.fromkeys(square(10, 10, 1), SOUTH)}
AGAINST = {**FIRST, **dict.fromkeys(square(3, 3)[:4], Preference((1, 3), ((1, 3), (3, 1))))}


@pytest.mark.parametrize('grid', [PLAIN, WALLED], ids=['plain', 'walled'])
@pytest.mark.parametrize('size', [20, 200])
@pytest.mark.parametrize(('before', 'after'), [
    (FIRST, SECOND), (SECOND, FIRST), (FIRST, AGAINST), (AGAINST, FIRST), ({}, FIRST), (FIRST, {}),
], ids=['answer', 'undo', 'contradiction', 'its end', 'first', 'none left'])
def test_the_bounds_contain_the_exact_optimum(
    monkeypatch: pytest.MonkeyPatch, grid: Grid, size: int, before: dict[int, Preference], after: dict[int, Preference],
) -> None:
    monkeypatch.setattr(local_preview, 'REGIONS', (size,))
    problem, earlier = posed(grid, size, after), posed(grid, size, before)
    found = near(problem, Solved(earlier, solve(earlier)), gap=np.inf)
    exact = solve(problem)
    assert found is not None
    assert found.solver == 'local'
    assert found.objective <= exact.bound * (1 + 1e-9)
    assert found.bound >= exact.objective * (1 - 1e-9)
    assert np.abs(found.reward).max() <= 1.0 + 1e-12
    backed_up = found.reward + problem.mdp.gamma * (problem.mixed @ found.value)
    assert found.value == pytest.approx(backed_up, abs=1e-9)


@pytest.mark.parametrize('terms', [Terms(reading='literal'), Terms(margin_cap=0.0), Terms(lambda_t=0.0)])
def test_other_readings_have_bounds_too(terms: Terms) -> None:
    problem, earlier = posed(PLAIN, 1, SECOND, terms), posed(PLAIN, 1, FIRST, terms)
    found, exact = near(problem, Solved(earlier, solve(earlier)), gap=np.inf), solve(problem)
    assert found is not None
    assert found.objective <= exact.bound + 1e-6
    assert found.bound >= exact.objective - 1e-6


def test_a_region_grows_until_the_gap_is_as_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, earlier = posed(PLAIN, 2, SECOND), posed(PLAIN, 2, FIRST)
    solved = Solved(earlier, solve(earlier))
    monkeypatch.setattr(local_preview, 'REGIONS', (15,))
    small = near(problem, solved, gap=np.inf)
    assert small is not None
    assert near(problem, solved, gap=small.gap / 10.0) is None
    monkeypatch.setattr(local_preview, 'REGIONS', (15, 10_000))
    whole = near(problem, solved, gap=small.gap / 10.0)
    assert whole is not None
    assert whole.gap <= small.gap / 10.0
    assert whole.objective == pytest.approx(solve(problem).objective, rel=1e-5)


def test_what_is_no_neighbour_is_not_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another process, other terms, too much that changed, a local program that ends without numbers."""
    problem, earlier = posed(PLAIN, 3, SECOND), posed(PLAIN, 3, FIRST)
    solved = Solved(earlier, solve(earlier))
    assert near(posed(WALLED, 3, SECOND), solved) is None
    assert near(posed(PLAIN, 3, SECOND, Terms(delta=0.2)), solved) is None
    monkeypatch.setattr(local_preview, 'REGIONS', (5,))
    assert near(problem, solved) is None
    monkeypatch.setattr(local_preview, 'REGIONS', (50,))

    def without_numbers(program: Program, n: int, tolerance: float) -> Ended:
        return Ended(np.full(len(program.cost), np.nan), np.zeros(program.matrix.shape[0]), 'PIQP_NUMERICS')

    monkeypatch.setattr(local_preview, 'piqp_program', without_numbers)
    assert near(problem, solved) is None


def test_what_changed_is_named() -> None:
    first, second = posed(PLAIN, 4, FIRST), posed(PLAIN, 4, SECOND)
    assert set(changed(second, first).tolist()) == SECOND.keys() - FIRST.keys()
    assert len(changed(first, first)) == 0
    demonstrated = favourite_of(PLAIN, 4)
    state = int(np.flatnonzero(demonstrated >= 0)[-1])
    demonstrated[state] = -1
    fewer = pose(first.mdp, Evidence(demonstrated, FIRST), Terms())
    assert changed(fewer, first).tolist() == [state]


def test_a_session_previews_roughly_where_that_is_quicker_and_learns_exactly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local_preview, 'QUICK', 1)
    session = ready()
    work = session.preview(answer(session))
    assert isinstance(work, Work)
    rough = work.run()
    assert rough.solver == 'local'
    assert rough.gap <= local_preview.ROUGH
    work = replace(work, settings=replace(work.settings, solver='highs'))
    assert work.run().solver == 'highs', 'a solver that was named is the one that is asked'
    assert session.submit(answer(session)).accepted
    learned = session.learn()
    assert (learned.solver, learned.gap <= EXACT) == ('highs', True)
    assert rough.objective <= learned.objective * (1 + 1e-9)
    monkeypatch.setattr(local_preview, 'QUICK', learned.grid.n_states)
    fresh = ready()
    assert fresh.submit(answer(fresh)).accepted
    again = fresh.learn()
    assert (again.digest, again.value.tobytes()) == (learned.digest, learned.value.tobytes())
    assert again.solved is None
