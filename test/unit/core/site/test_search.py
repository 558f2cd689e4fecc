"""Ways over a site: the same as by counting moves, and repaired to what a new search gives."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from advise_ros.core.grid.grid import Grid
from advise_ros.core.planning.rollout import optimal_table
from advise_ros.core.site.belief import problem_of
from advise_ros.core.site.chain import flip, new_chain, new_journal, undo
from advise_ros.core.site.layout import Layout, layout_of
from advise_ros.core.site.pilots import IN_SET, PILOTS, moves_of
from advise_ros.core.site.search import best_actions, optimal_sets

SEEDS = st.integers(0, 2**32 - 1)


def grid_of(rng: np.random.Generator) -> Grid:
    """A small site with a few walls that leave every waypoint in reach."""
    while True:
        width, height = (int(edge) for edge in rng.integers(3, 8, 2))
        cells = rng.permutation(width * height)
        try:
            return Grid(1.0, width, height, (0.0, 0.0), 5.0, tuple(cells[:3].tolist()), tuple(cells[3:5].tolist()))
        except ValueError:
            continue


def test_without_wishes_the_best_ways_are_the_shortest() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        grid = grid_of(rng)
        layout = layout_of(grid)
        sets = optimal_sets(layout.moves, np.zeros((1, grid.n_cells), dtype=np.uint8), layout.waypoints, 1001)
        acting = layout.acting > 0
        assert np.array_equal(IN_SET[sets[0]][acting], optimal_table(grid)[acting])


def random_moves(layout: Layout, rng: np.random.Generator) -> np.ndarray:
    return rng.poisson(0.7, (layout.n_states, 4)) * (layout.acting > 0)[:, None]


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.sampled_from(PILOTS))
def test_a_change_is_judged_as_the_whole_map_is_and_can_be_taken_back(seed: int, pilot: object) -> None:
    rng = np.random.default_rng(seed)
    layout = layout_of(grid_of(rng))
    prices = np.full(layout.n_cells, 0.75)
    problem = problem_of(layout, moves_of(layout, random_moves(layout, rng)), pilot, (), prices)
    keep_out = (rng.random(layout.n_cells) < 0.2).astype(np.uint8) * (1 - layout.open_cells)
    chain, journal = new_chain(problem, keep_out), new_journal(layout.n_states, layout.n_cells)
    for _ in range(20):
        before = [part.copy() for part in chain]
        cells = rng.choice(np.flatnonzero(layout.open_cells == 0), int(rng.integers(1, 5)), replace=False)
        flip(problem, chain, journal, cells, len(cells))
        anew = new_chain(problem, chain.keep_out)
        assert np.array_equal(chain.distance, anew.distance)
        assert np.array_equal(chain.best[problem.relevant > 0], anew.best[problem.relevant > 0])
        assert chain.total[1] == anew.total[1]  # to the last bit: all terms are rounded
        if rng.random() < 0.5:
            undo(problem, chain, journal, cells, len(cells))
            assert all(np.array_equal(now, was) for now, was in zip(chain, before, strict=True))


def test_equal_ways_are_all_found() -> None:
    grid = Grid(1.0, 3, 3, (0.0, 0.0), 5.0, (8,))
    layout = layout_of(grid)
    distance = np.array([[4, 3, 2, 3, 2, 1, 2, 1, 0]])
    best = best_actions(layout.moves, np.ones(9, dtype=np.int64), distance)
    assert IN_SET[best[0]].tolist() == [True, True, False, False]
