"""Equation (1) on problems small enough to solve by hand, and its readings."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from advise_ros.core.advice.advice import Preference
from advise_ros.core.irl.program import Evidence, InfeasibleError, Problem, Solution, pose
from advise_ros.core.irl.settings import Terms
from advise_ros.core.irl.solvers import cvxpy_reference, highs
from advise_ros.core.planning.process import Mdp, mdp_of
from support.learning import CORRIDOR, EAST, NORTH, SOUTH, WEST

Solver = Callable[[Problem], Solution]
SOLVERS = [highs.solve, cvxpy_reference.solve]
NOTHING = np.full(4, -1)
GO_EAST = Preference((EAST,), ((EAST, WEST),))
GO_WEST = Preference((WEST,), ((WEST, EAST),))
BOTH = Preference((EAST, WEST), ((EAST, WEST), (WEST, EAST)))


@pytest.fixture
def corridor() -> Mdp:
    return mdp_of(CORRIDOR, 0.0, 0.9)


@pytest.mark.parametrize('solver', SOLVERS)
def test_without_evidence_the_reward_is_zero(corridor: Mdp, solver: Solver) -> None:
    solution = solver(pose(corridor, Evidence(NOTHING, {}), Terms()))
    assert solution.reward == pytest.approx(np.zeros(4), abs=1e-7)
    assert solution.objective == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize('solver', SOLVERS)
def test_one_demonstrated_move_gets_the_capped_margin(corridor: Mdp, solver: Solver) -> None:
    """East in cell 2: v(3) must exceed v(2) and v(1) by the cap. Cheapest is a reward of the goal.

    v(3) = 10 r(3), v(2) = 0.9 v(3), and NORTH stays in 2: the margin 0.2 = 0.1 v(3) needs v(3) = 2, r(3) = 0.2;
    cell 1 and 0 mix all actions, which leaves v(1) below v(2).
    """
    favourite = np.array([-1, -1, EAST, -1])
    solution = solver(pose(corridor, Evidence(favourite, {}), Terms(margin_cap=0.2)))
    assert solution.objective == pytest.approx(1000.0 * 0.2 - 0.2)
    assert solution.value[3] - solution.value[2] == pytest.approx(0.2)


@pytest.mark.parametrize('solver', SOLVERS)
def test_advice_has_its_margin_and_cap(corridor: Mdp, solver: Solver) -> None:
    solution = solver(pose(corridor, Evidence(NOTHING, {1: GO_EAST}), Terms(delta=0.1, margin_cap=0.2)))
    assert solution.value[2] - solution.value[0] >= 0.3 - 1e-7
    assert solution.slack == pytest.approx([0.0], abs=1e-7)


@pytest.mark.parametrize('solver', SOLVERS)
def test_contradictory_advice_costs_slack_or_is_infeasible(corridor: Mdp, solver: Solver) -> None:
    """East over west and west over east: the larger miss is delta at least."""
    evidence = Evidence(NOTHING, {1: BOTH})
    elastic = solver(pose(corridor, evidence, Terms(delta=0.1)))
    assert elastic.slack == pytest.approx([0.1])
    with pytest.raises(InfeasibleError):
        solver(pose(corridor, evidence, Terms(delta=0.1, slack_cost=0.0)))


def test_replace_drops_the_demonstration_of_an_advised_state(corridor: Mdp) -> None:
    favourite = np.array([-1, WEST, EAST, -1])
    replaced = pose(corridor, Evidence(favourite, {1: GO_EAST}), Terms(reading='replace'))
    assert replaced.demonstrated.tolist() == [2]
    assert replaced.mixed.toarray()[1].tolist() == [0, 0, 1, 0]
    literal = pose(corridor, Evidence(favourite, {1: GO_EAST}), Terms(reading='literal'))
    assert literal.demonstrated.tolist() == [1, 2]
    assert literal.mixed.toarray()[1].tolist() == [1, 0, 0, 0]


def test_pbar_mixes_where_nothing_is_known_and_over_preferred_actions(corridor: Mdp) -> None:
    problem = pose(corridor, Evidence(NOTHING, {1: Preference((EAST, WEST), ((EAST, NORTH), (WEST, NORTH)))}), Terms())
    assert problem.mixed.toarray()[1].tolist() == [0.5, 0, 0.5, 0]
    assert problem.mixed.toarray()[2].tolist() == [0, 0.25, 0.5, 0.25]


def test_advice_between_moves_with_one_outcome_makes_no_row(corridor: Mdp) -> None:
    wall = Preference((NORTH,), ((NORTH, SOUTH),))
    problem = pose(corridor, Evidence(NOTHING, {1: wall}), Terms(slack_cost=0.0))
    assert len(problem.advised) == 0
    assert highs.solve(problem).objective == pytest.approx(0.0, abs=1e-7)


def test_the_paper_bounds_hold(corridor: Mdp) -> None:
    """Uncapped margins press the reward to its bound, and no further."""
    favourite = np.array([EAST, EAST, EAST, -1])
    solution = highs.solve(pose(corridor, Evidence(favourite, {}), Terms(margin_cap=0.0, r_max=0.5)))
    assert np.abs(solution.reward).max() == pytest.approx(0.5)
