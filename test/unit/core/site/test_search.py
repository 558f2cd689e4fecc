"""Ways over a site: the same as by counting moves, and repaired to what a new search gives."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.planning.rollout import optimal_table
from advise_ros.core.site.belief import problem_of
from advise_ros.core.site.chain import change, new_chain, new_journal, prior_change, undo
from advise_ros.core.site.layout import Layout, layout_of
from advise_ros.core.site.pilots import IN_SET, PILOTS, best_sets, moves_of
from advise_ros.core.site.search import best_actions
from advise_ros.core.site.wishes import ALIKE, GRADED, ONE_WAYPOINT

SEEDS = st.integers(0, 2**32 - 1)


def grid_of(rng: np.random.Generator) -> Grid:
    """A small site with a few walls that leave every waypoint in reach."""
    while True:
        width, height = (int(edge) for edge in rng.integers(3, 8, 2))
        cells = rng.permutation(width * height)
        try:
            return Grid(1.0, width, height, (0.0, 0.0), 5.0, tuple(cells[:3].tolist()), tuple(cells[3:5].tolist()))
        except InputError:
            continue


def test_without_wishes_the_best_ways_are_the_shortest() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        grid = grid_of(rng)
        layout = layout_of(grid)
        sets = best_sets(layout, np.zeros((1, grid.n_cells)))
        acting = layout.acting > 0
        assert np.array_equal(IN_SET[sets[0]][acting], optimal_table(grid)[acting])


def random_moves(layout: Layout, rng: np.random.Generator) -> np.ndarray:
    return rng.poisson(0.7, (layout.n_states, 4)) * (layout.acting > 0)[:, None]


@settings(max_examples=40, deadline=None)
@given(SEEDS, st.sampled_from(PILOTS), st.sampled_from((ALIKE, GRADED, ONE_WAYPOINT)))
def test_a_change_is_judged_as_the_whole_map_is_and_can_be_taken_back(seed: int, pilot: object, wishes: object) -> None:
    rng = np.random.default_rng(seed)
    layout = layout_of(grid_of(rng))
    prices = np.full(layout.n_cells, 0.75)
    problem = problem_of(layout, moves_of(layout, random_moves(layout, rng)), pilot, (), prices, wishes)
    n_places, kinds = wishes.n_places(layout), len(problem.wishes.price)
    levels = np.where(rng.random(n_places) < 0.2, rng.integers(1, kinds, n_places), 0).astype(np.uint8)
    levels *= np.resize(1 - layout.open_cells, n_places)
    chain, journal = new_chain(problem, levels), new_journal(layout.n_states, layout.n_cells, n_places)
    free = np.flatnonzero(np.resize(layout.open_cells, n_places) == 0)
    for _ in range(20):
        before = [part.copy() for part in chain]
        places = rng.choice(free, int(rng.integers(1, 5)), replace=False)
        one, other = rng.choice(kinds, 2, replace=False)
        places = places[np.isin(chain.levels[places], (one, other))]
        values = (one + other - chain.levels[places]).astype(np.uint8)
        prior = prior_change(problem, chain.levels, places, values, len(places), np.zeros(n_places, dtype=np.uint8))
        change(problem, chain, journal, places, values, len(places))
        anew = new_chain(problem, chain.levels)
        assert np.array_equal(chain.distance, anew.distance)
        assert np.array_equal(chain.price, anew.price)
        assert np.array_equal(chain.best[problem.relevant > 0], anew.best[problem.relevant > 0])
        assert chain.total[1] == anew.total[1]  # to the last bit: all terms are rounded
        assert abs(chain.total[0] + prior - anew.total[0]) < 1e-9
        chain.total[0] = anew.total[0]
        if rng.random() < 0.5:
            undo(problem, chain, journal, places, len(places))
            assert all(np.array_equal(now, was) for now, was in zip(chain, before, strict=True))


def test_equal_ways_are_all_found() -> None:
    grid = Grid(1.0, 3, 3, (0.0, 0.0), 5.0, (8,))
    layout = layout_of(grid)
    distance = np.array([[4, 3, 2, 3, 2, 1, 2, 1, 0]])
    best = best_actions(layout.moves, np.ones(9, dtype=np.int64), distance)
    assert IN_SET[best[0]].tolist() == [True, True, False, False]
