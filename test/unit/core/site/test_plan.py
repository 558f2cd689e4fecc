"""Plans by a belief, in calm and in wind."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve

from advise_ros.core.grid.grid import Grid
from advise_ros.core.planning.process import mdp_of
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.pilots import best_sets
from advise_ros.core.site.plan import PRICE, plan
from advise_ros.experiments.sites import pilot_of, random_site
from advise_ros.experiments.wind import BlownPilot, success_in_wind

GRID = Grid(1.0, 5, 4, (0.0, 0.0), 5.0, (4, 15, 0))


@pytest.mark.parametrize('slip', [0.1, 0.3])
def test_the_cost_in_wind_is_that_of_the_process(slip: float) -> None:
    layout = layout_of(GRID)
    way = plan(layout, np.zeros(GRID.n_cells), slip)
    outcomes = mdp_of(GRID, slip, 0.0).outcomes(np.arange(GRID.n_states), way.greedy)
    flying = np.arange(GRID.n_states) != GRID.goal_state
    steps = spsolve(sparse.csc_array(sparse.eye_array(flying.sum()) - outcomes[flying][:, flying]), np.ones(flying.sum()))
    assert way.steps == pytest.approx(steps[np.flatnonzero(flying) == layout.start][0], abs=1e-3)


def test_a_plan_in_wind_is_not_blown_into_what_it_keeps_out_of_as_often() -> None:
    with_wind, without = [], []
    for seed in range(6):
        site = random_site('8x8-8', np.random.default_rng([seed, 0]))
        layout, weights = layout_of(site.grid), site.keep_out.astype(float)
        without.append(success_in_wind(site, plan(layout, weights).greedy, 0.1))
        with_wind.append(success_in_wind(site, plan(layout, weights, 0.1).greedy, 0.1))
    assert np.mean(with_wind) > np.mean(without)


def test_next_to_no_wind_changes_no_step() -> None:
    layout, weights = layout_of(GRID), np.random.default_rng(0).random(GRID.n_cells)
    assert plan(layout, weights, 1e-9).steps == pytest.approx(plan(layout, weights).steps, abs=1e-3)


def test_an_area_on_the_way_to_one_waypoint_lets_the_other_ways_through() -> None:
    layout, weights = layout_of(GRID), np.zeros((3, GRID.n_cells))
    weights[1, [6, 7, 8, 11, 12, 13]] = 1.0
    assert plan(layout, weights).steps == plan(layout, np.zeros(GRID.n_cells)).steps
    assert plan(layout, np.full((3, GRID.n_cells), -0.5 / PRICE)).steps == plan(layout, np.zeros(GRID.n_cells)).steps / 2
    sets = best_sets(layout, weights[None]).reshape(3, -1)
    assert np.array_equal(sets[[0, 2]], best_sets(layout, np.zeros((1, GRID.n_cells))).reshape(3, -1)[[0, 2]])
    assert sets[1, 9] != best_sets(layout, np.zeros((1, GRID.n_cells))).reshape(3, -1)[1, 9]


def test_the_wind_makes_its_share_of_the_moves_and_none_over_the_border() -> None:
    site = random_site('6x6-4', np.random.default_rng(0))
    right = pilot_of(site, 'errs', 0.0, 0.0, np.random.default_rng(1))
    blown = BlownPilot(right, 0.3, np.random.default_rng(2))
    state, layout = site.grid.start_state(), layout_of(site.grid)
    moves = [blown.action(state) for _ in range(1000)]
    assert all(layout.moves[state, move] >= 0 for move in moves)
    assert 0.25 < np.mean([move != right.action(state) for move in moves]) < 0.35
