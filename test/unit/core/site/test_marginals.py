"""What each cell is given all others, held against judging every level by itself."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.core.grid.grid import Grid
from advise_ros.core.site.belief import SiteAnswer, problem_of
from advise_ros.core.site.chain import MOVES, new_chain
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.marginals import MISJUDGED, MISJUDGED_TEMPERATURE, level_probabilities
from advise_ros.core.site.pilots import PILOTS, Pilot, moves_of
from advise_ros.core.site.wishes import ALIKE, GRADED, Wishes

GRID = Grid(1.0, 4, 3, (0.0, 0.0), 5.0, (3, 8))


@pytest.mark.parametrize('pilot', PILOTS, ids=lambda pilot: pilot.name)
@pytest.mark.parametrize('wishes', [ALIKE, GRADED], ids=lambda wishes: wishes.name)
def test_each_level_is_as_likely_as_its_map_against_those_that_differ_in_this_cell(pilot: Pilot, wishes: Wishes) -> None:
    layout, rng = layout_of(GRID), np.random.default_rng(3)
    moves = moves_of(layout, rng.poisson(1.5, (layout.n_states, 4)) * (layout.acting > 0)[:, None])
    problem = problem_of(layout, moves, pilot, (SiteAnswer((5, 6), (0,), (2,)),), np.full(GRID.n_cells, 0.8), wishes)
    kinds = len(problem.wishes.price)
    maps = rng.integers(0, kinds, (3, GRID.n_cells)).astype(np.uint8) * (layout.open_cells == 0)
    likely = level_probabilities(problem, maps)
    for cell in range(GRID.n_cells):
        if layout.open_cells[cell]:
            assert likely[cell].tolist() == pytest.approx([1.0] + [0.0] * (kinds - 1))
            continue
        each = []
        for drawn in maps:
            others = np.tile(drawn, (kinds, 1))
            others[:, cell] = range(kinds)
            totals = np.array([new_chain(problem, other).total for other in others])
            doubted = totals.sum(axis=1) - totals[:, MOVES] * (1.0 - 1.0 / MISJUDGED_TEMPERATURE)
            sure, unsure = (np.exp(logs - np.logaddexp.reduce(logs)) for logs in (totals.sum(axis=1), doubted))
            each.append((1.0 - MISJUDGED) * sure + MISJUDGED * unsure)
        assert likely[cell].tolist() == pytest.approx(np.mean(each, axis=0).tolist(), abs=1e-9)
