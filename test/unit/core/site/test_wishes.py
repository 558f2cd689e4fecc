"""Kinds of wishes: which of them flights tell apart, and that a plain one is not taken for another."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.core.demonstrations.demonstration import count
from advise_ros.core.errors import InputError
from advise_ros.core.site.belief import SiteBelief, believe
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.plan import plan
from advise_ros.core.site.wishes import ALIKE, GRADED, ONE_WAYPOINT
from advise_ros.experiments.sites import flights_of, pilot_of
from advise_ros.experiments.wished_sites import NEARLY, extra_steps, wished_site


def learnt(wish: str, seed: int) -> tuple[SiteBelief, float]:
    """What is believed after five flights, and what its way costs more than the best."""
    site, weights = wished_site(wish, np.random.default_rng([seed, 0]))
    pilot = pilot_of(site, 'errs', 0.4, 0.2, np.random.default_rng([seed, 1]))
    layout = layout_of(site.grid)
    belief = believe(layout, count(site.grid, flights_of(site, pilot, 5)).taken, (), np.random.default_rng(seed))
    return belief, extra_steps(site, weights, plan(layout, belief.expected).greedy)


@pytest.mark.parametrize('seed', [42004, 42005])
def test_a_corridor_is_recognised_from_clumsy_flights_and_followed(seed: int) -> None:
    belief, extra = learnt('corridor', seed)
    assert belief.pilots[0].wishes == GRADED
    assert extra <= NEARLY


@pytest.mark.parametrize('wish', ['nothing', 'keep-out'])
def test_what_one_map_of_cells_to_keep_out_of_explains_is_not_taken_for_more(wish: str) -> None:
    belief, extra = learnt(wish, 42003)
    assert all(one.wishes == ALIKE for one in belief.pilots)
    assert belief.maps.ndim == 2
    assert extra <= NEARLY


def test_what_is_said_of_one_way_alone_holds_there() -> None:
    site, _ = wished_site('nothing', np.random.default_rng(0))
    layout = layout_of(site.grid)
    n = layout.n_cells
    maps = np.zeros((1, ONE_WAYPOINT.n_places(layout)), dtype=np.uint8)
    maps[0, [3, 2 * n + 7]] = 1
    weights = ONE_WAYPOINT.weights(layout, maps)
    assert weights.shape == (1, layout.n_layers, n)
    assert weights[0, :, 3].tolist() == [1.0] * layout.n_layers
    assert weights[0, :, 7].tolist() == [0.0, 1.0, *[0.0] * (layout.n_layers - 2)]


def test_an_unknown_wish_is_refused() -> None:
    with pytest.raises(InputError, match="'garden' is unknown; known: nothing, keep-out"):
        wished_site('garden', np.random.default_rng(0))
