"""What a person knows of a site beside the map: cells to keep out of, the ways that he would fly, what a policy is worth to him.

What counts: all waypoints in order, in time, and no cell entered that he wants kept out of.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.tables import occurring
from advise_ros.core.numerics import Bools
from advise_ros.core.planning.rollout import optimal_table, rollout, shortest_route
from advise_ros.core.site.layout import Bytes, layout_of

# A flight in time takes at most so many times the steps of the best one.
LONGEST = 2.0


@dataclass(frozen=True, eq=False)
class Site:
    """A route, and what the person knows beside it.

    Attributes:
        grid: what the map says.
        keep_out: (cells,) 1 for cells that the person wants kept out of.
        right: (states, 4) the actions of the ways that he would fly.
        steps: of the best whole route.
    """

    grid: Grid
    keep_out: Bytes
    right: Bools
    steps: int


def site_with(grid: Grid, keep_out: Bytes) -> Site:
    """A site whose person wants some cells (cells,) kept out of, if there is any way round."""
    from advise_ros.core.site.pilots import AVOID_AT_ALL_COST, IN_SET  # noqa: PLC0415 - compiled loops take half a second to import
    from advise_ros.core.site.search import optimal_sets  # noqa: PLC0415

    right = IN_SET[optimal_sets(layout_of(grid).moves, keep_out[None], layout_of(grid).waypoints, 1 + AVOID_AT_ALL_COST)[0]]
    right = right & occurring(grid)[:, None]
    best = rollout(grid, right.argmax(axis=1).tolist(), grid.start_state(), grid.n_states)
    return Site(grid, keep_out, right, best.steps)


def site_of(grid: Grid, cells: Sequence[int]) -> Site:
    """A site whose person wants the cells of these indices kept out of; without any, the shortest ways are right."""
    keep_out = np.zeros(grid.n_cells, dtype=np.uint8)
    if not cells:
        return Site(grid, keep_out, optimal_table(grid), shortest_route(grid, grid.start_state()))
    keep_out[list(cells)] = 1
    return site_with(grid, keep_out)


class Judgement(NamedTuple):
    """What a policy is worth: whether it arrives in time, whether it kept out, and its length against the best."""

    arrives: bool
    keeps_out: bool
    length: float

    @property
    def success(self) -> bool:
        return self.arrives and self.keeps_out


def judge(site: Site, greedy: npt.NDArray[np.integer], longest: float = LONGEST) -> Judgement:
    """Fly greedy actions (states,) from the start; in time is who takes at most `longest` times the best flight's steps."""
    flight = rollout(site.grid, greedy.tolist(), site.grid.start_state(), int(longest * site.steps))
    return Judgement(flight.reached, not entered(site, flight.states), flight.steps / site.steps)


def entered(site: Site, states: Sequence[int]) -> bool:
    """Whether a flight over these states enters a cell to keep out of; where it begins does not count."""
    return bool(site.keep_out[[site.grid.cell_of(state) for state in states[1:]]].any())
