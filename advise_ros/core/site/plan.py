"""Flying by a belief: the cheapest way where each step costs 1 and each cell its probability times the price of a wish broken.

That is the optimal policy of the mean reward (Ramachandran & Amir 2007, theorem 3), with step cost, goal and one map of cells
for all waypoints as its structure. Costs are whole numbers of 1 / SCALE steps, so ties are ties on every machine.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.site.layout import Bytes, Int32s, Layout
from advise_ros.core.site.search import all_distances, best_actions

# A cell that should be kept out of is worth going round for so many steps.
PRICE = 40.0
SCALE = 10_000


class SitePlan(NamedTuple):
    """The cheapest ways of all states.

    Attributes:
        greedy: (states,) the action, ties to the lowest index; 0 where there is no way.
        best: (states,) all actions of a cheapest way, as a sum of 1 << action.
        steps: expected cost of the whole route from its start, in steps.
    """

    greedy: Ints
    best: Bytes
    steps: float


def cell_costs(keep_out: Floats) -> Ints:
    """(..., cells) cost of entering each [1 / SCALE steps]."""
    return np.round(SCALE * (1.0 + PRICE * keep_out)).astype(np.int64)


def plan(layout: Layout, keep_out: Floats) -> SitePlan:
    """The way to fly.

    Args:
        layout: the site and the route.
        keep_out: (cells,) probability that the person wants the cell kept out of.
    """
    costs = cell_costs(keep_out)
    distance = all_distances(layout.moves, costs, layout.waypoints)
    best = best_actions(layout.moves, costs, distance)
    steps = _route_cost(layout.waypoints, distance, layout.start % layout.n_cells, layout.start // layout.n_cells)
    return SitePlan(lowest(best), best, steps / SCALE)


def lowest(best: Bytes) -> Ints:
    """(...) the lowest action of each set; 0 of an empty one."""
    return np.argmax((best[..., None] >> np.arange(4, dtype=np.uint8)) & 1, axis=-1).astype(np.int64)


def highest(best: Bytes) -> Ints:
    """(...) the highest action of each set."""
    return 3 - np.argmax((best[..., None] >> np.arange(3, -1, -1, dtype=np.uint8)) & 1, axis=-1).astype(np.int64)


def route(layout: Layout, greedy: Ints) -> list[int]:
    """States of a flight by greedy actions (states,) from the start to the last waypoint, or until they repeat."""
    n, last = layout.n_cells, layout.n_layers - 1
    state, states, seen = layout.start, list[int](), set[int]()
    while state not in seen and not (state // n == last and state % n == layout.waypoints[last]):
        seen.add(state)
        states.append(state)
        state = after(layout, state, int(greedy[state]))
    return states


def after(layout: Layout, state: int, action: int) -> int:
    """The state that an action leads to."""
    layer, cell = divmod(state, layout.n_cells)
    there = int(layout.moves[cell, action])
    if there < 0:
        return state
    reached = there == layout.waypoints[layer] and layer < layout.n_layers - 1
    return (layer + reached) * layout.n_cells + there


@njit(cache=True)
def _route_cost(waypoints: Int32s, distance: Ints, cell: int, layer: int) -> int:
    """Cost from a cell over all waypoints that are left."""
    total = distance[layer, cell]
    for ahead in range(layer + 1, len(waypoints)):
        total += distance[ahead, waypoints[ahead - 1]]
    return total


def least_steps(layout: Layout, keep_outs: Floats) -> Floats:
    """(m,) expected cost of the whole route, in steps, for each of m maps of probabilities (m, cells)."""
    costs = cell_costs(keep_outs)
    return _least(layout.moves, costs, layout.waypoints, layout.start % layout.n_cells, layout.start // layout.n_cells) / SCALE


@njit(cache=True)
def _least(moves: Int32s, costs: Ints, waypoints: Int32s, cell: int, layer: int) -> Ints:
    values = np.empty(len(costs), np.int64)
    for row in range(len(costs)):
        values[row] = _route_cost(waypoints, all_distances(moves, costs[row], waypoints), cell, layer)
    return values
