"""What was learnt of a site, as the learner of another route over it takes it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.site.belief import CELL_PRICE, EDGE_PRICE, SiteAnswer
from advise_ros.core.site.layout import Layout, layout_of
from advise_ros.core.site.prior import UNKNOWN, KeptRoute, SitePrior

# A cell is never believed for certain: the site may have changed, or the model of the pilot was wrong.
LEAST_DOUBT = 0.02


class SiteEvidence(NamedTuple):
    """All that speaks for a map, of this route and of those before.

    Attributes:
        layout: the site with the layers of the earlier routes, then those of this one; its start is of no use.
        taken: (states, 4) moves flown before.
        answers: given before.
        cell_price: (cells,) log odds against each cell before anything was flown; None where nothing is known.
    """

    layout: Layout
    taken: Ints
    answers: tuple[SiteAnswer, ...]
    cell_price: Floats | None

    @property
    def earlier(self) -> int:
        """States of the earlier routes; this one's come after them."""
        return len(self.taken)


def evidence_of(grid: Grid, prior: SitePrior) -> SiteEvidence:
    """What was kept, in the form that a belief is made from.

    Which moves are right depends on the waypoint that is next, and on nothing else of a route: flights of several routes
    over the same cells are flights of one route with all their waypoints.

    Args:
        grid: the site and the new route.
        prior: what was learnt on the same cells.
    """
    layouts = [_layout(grid, route) for route in prior.routes]
    taken = [_taken(route, layout) for route, layout in zip(prior.routes, layouts, strict=True)]
    begins = np.cumsum([0, *(layout.n_states for layout in layouts)])
    answers = tuple(
        SiteAnswer(tuple(int(begin) + state for state in answer.states), answer.preferred, answer.avoided)
        for begin, route in zip(begins, prior.routes, strict=False)
        for answer in route.answers
    )
    price = as_prior(layout_of(grid), np.array(prior.before)) if prior.before else None
    moves = np.concatenate([*taken, np.zeros((0, N_ACTIONS), np.int64)])
    return SiteEvidence(_joined([*layouts, layout_of(grid)]), moves, answers, price)


def _layout(grid: Grid, route: KeptRoute) -> Layout:
    """An earlier route over the cells, without obstacles: new ones may stand in its waypoints."""
    return layout_of(replace(grid, waypoints=route.waypoints, blocked=()))


def _taken(route: KeptRoute, layout: Layout) -> Ints:
    taken = np.zeros((layout.n_states, N_ACTIONS), dtype=np.int64)
    for flight in route.flights:
        np.add.at(taken, (list(flight.states), list(flight.actions)), 1)
    return taken * (layout.acting > 0)[:, None]


def _joined(layouts: list[Layout]) -> Layout:
    """One site with the layers of several routes; cells and moves are those of the last."""
    return layouts[-1]._replace(
        waypoints=np.concatenate([one.waypoints for one in layouts]),
        open_cells=np.maximum.reduce([one.open_cells for one in layouts]),
        acting=np.concatenate([one.acting for one in layouts]),
    )


def as_prior(layout: Layout, keep_out: Ints) -> Floats:
    """(cells,) log odds against each cell, so that maps drawn by them mark it about as often as it was kept.

    Maps whose cells lie together are likelier (EDGE_PRICE); what that adds for or against a cell is in the kept numbers
    already and is taken off, on average over its neighbours (mean field).

    Args:
        layout: the site.
        keep_out: (cells,) per cent, UNKNOWN where nothing is known: such cells have CELL_PRICE.
    """
    known = keep_out != UNKNOWN
    share = np.where(known, np.clip(keep_out / 100.0, LEAST_DOUBT, 1.0 - LEAST_DOUBT), 0.0)
    beside = layout.beside
    together = np.where(beside >= 0, 1.0 - 2.0 * share[beside], 0.0).sum(axis=1)
    logs = np.log1p(-share) - np.log(np.where(known, share, 0.5)) - EDGE_PRICE * together
    return np.where(known, logs, CELL_PRICE)
