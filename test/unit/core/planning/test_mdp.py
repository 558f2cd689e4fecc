"""Transitions and planning against what can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.tables import occurring, successors, terminal
from advise_ros.core.planning.process import boltzmann, greedy, mdp_of, occupancy, plan
from support.learning import CORRIDOR, EAST, ROUND_TRIP, WEST

BLOCKED = Grid(1.0, 3, 3, (0.0, 0.0), 2.0, (2, 6), (4,))


@pytest.mark.parametrize('grid', [CORRIDOR, ROUND_TRIP, BLOCKED])
def test_tables_are_the_grids_own_rules(grid: Grid) -> None:
    table = successors(grid)
    assert [[grid.successor(s, a) for a in range(4)] for s in range(grid.n_states)] == table.tolist()
    assert [grid.is_terminal(s) for s in range(grid.n_states)] == terminal(grid).tolist()


def test_no_flight_acts_at_its_end_or_on_the_waypoint_that_is_next() -> None:
    silent = set(np.flatnonzero(~occurring(BLOCKED)).tolist())
    assert silent == {2, 4, BLOCKED.state(1, 4), BLOCKED.goal_state}


@pytest.mark.parametrize('slip', [0.0, 0.3, 0.9])
def test_transitions_are_distributions(slip: float) -> None:
    mdp = mdp_of(ROUND_TRIP, slip, 0.9)
    assert np.allclose(mdp.stacked.sum(axis=1), 1.0)
    assert mdp.n_actions == 4
    intended = mdp.outcomes(np.array([5]), np.array([EAST])).toarray()[0]
    assert intended[6] == pytest.approx(1.0 - slip)


def test_plan_finds_the_closed_form_of_a_corridor() -> None:
    """Reward 1 at the goal for ever: v = gamma^distance / (1 - gamma)."""
    mdp = mdp_of(CORRIDOR, 0.0, 0.9)
    value, q = plan(mdp, np.array([0.0, 0.0, 0.0, 1.0]))
    assert value == pytest.approx(10.0 * 0.9 ** np.array([3, 2, 1, 0]), rel=1e-8)
    assert greedy(q).tolist() == [EAST, EAST, EAST, 0]
    assert q[1, WEST] == pytest.approx(0.9 * value[0])


def test_a_warm_start_leads_to_the_same_plan() -> None:
    mdp = mdp_of(ROUND_TRIP, 0.1, 0.95)
    reward = np.random.default_rng(0).normal(size=mdp.n_states)
    cold, warm = plan(mdp, reward), plan(mdp, reward, np.random.default_rng(1).normal(size=mdp.n_states))
    assert warm.value == pytest.approx(cold.value, abs=1e-7)


def test_ties_go_to_the_lowest_action_despite_rounding() -> None:
    assert greedy(np.array([[1.0, 1.0 + 1e-9, 0.0, 1.0 + 2e-9], [0.0, 1e-3, 0.0, 0.0]])).tolist() == [0, 1]


def test_boltzmann_follows_equation_3() -> None:
    q = np.array([[0.0, 1.0], [700.0, 0.0]])
    assert boltzmann(q, 2.0)[0] == pytest.approx(np.exp([0.0, 0.5]) / np.exp([0.0, 0.5]).sum())
    assert boltzmann(q, 0.01)[1].tolist() == [1.0, 0.0]


def test_occupancy_counts_discounted_visits() -> None:
    mdp = mdp_of(CORRIDOR, 0.0, 0.5)
    east = np.zeros((4, 4))
    east[:, EAST] = 1.0
    assert occupancy(mdp, east, np.eye(4)[0]) == pytest.approx([1.0, 0.5, 0.25, 0.25])


@pytest.mark.parametrize('gamma', [0.9995, 0.9999, 0.99999])
def test_planning_ends_where_rounding_is_all_that_is_left(gamma: float) -> None:
    grid = Grid(2.0, 6, 6, (-1.0, -1.0), 3.0, (5, 35, 30, 0))
    mdp = mdp_of(grid, 0.1, gamma)
    reward = np.random.default_rng(1).normal(size=mdp.n_states)
    value, q = plan(mdp, reward)
    assert q.max(axis=1) == pytest.approx(value)
    backed_up = (reward[:, None] + gamma * mdp.expected(value).T).max(axis=1)
    assert np.abs(backed_up - value).max() <= 1e-12 * np.abs(value).max()
