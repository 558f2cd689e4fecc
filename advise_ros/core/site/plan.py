"""Flying by a belief: the cheapest way where each step costs 1 and each cell its probability times the price of a wish broken.

That is the optimal policy of the mean reward (Ramachandran & Amir 2007, theorem 3), with step cost, goal and maps of cells
as its structure: one for all waypoints, or one for each. Costs are whole numbers of 1 / SCALE steps, so
ties are ties on every machine.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.site.compiled import compiled
from advise_ros.core.site.layout import Bytes, Int32s, Layout
from advise_ros.core.site.search import FAR, all_distances, best_actions

# A cell that should be kept out of is worth going round for so many steps.
PRICE = 40.0
SCALE = 10_000
# Steps are told apart to so many parts where people choose.
PARTS = 2
# Of equally good actions the one flown: that to the cell with the highest index. An order of cells is what rewards of cells can
# express; "the lowest action" is none, and then no reward makes just these actions the best ones in every state.
TIES = (0, 1, 3, 2)
# In wind costs are known to this [1 / SCALE steps] after at most so many sweeps over all cells.
CLOSE, MOST_SWEEPS = 0.01, 10_000


class SitePlan(NamedTuple):
    """The cheapest ways of all states.

    Attributes:
        greedy: (states,) the action, ties in the order of TIES; 0 where there is no way.
        best: (states,) all actions of a cheapest way, as a sum of 1 << action.
        steps: expected cost of the whole route from its start, in steps.
    """

    greedy: Ints
    best: Bytes
    steps: float


def barred(maps: Floats | Bytes) -> Bools:
    """(m, cells) what is to be kept out of, on the way to one waypoint at least, in maps (m, cells) or (m, layers, cells)."""
    marks: Bools = np.greater_equal(maps, 1.0)
    return np.any(marks, axis=1) if marks.ndim > 2 else marks


def cell_costs(weights: Floats) -> Ints:
    """(..., cells) cost of entering each [1 / SCALE steps]."""
    return np.round(SCALE * (1.0 + PRICE * weights)).astype(np.int64)


def plan(layout: Layout, weights: Floats, slip: float = 0.0) -> SitePlan:
    """The way to fly.

    Args:
        layout: the site and the route.
        weights: (cells,) or (layers, cells) what entering a cell is expected to cost, in wishes broken: the probability that
            the person wants it kept out of, if that is all that he can wish.
        slip: probability that wind makes another move than the one chosen; a way then keeps off what it could be blown into.
    """
    costs = cell_costs(np.atleast_2d(weights))
    if slip > 0.0:
        return _in_wind(layout, costs, slip)
    distance = all_distances(layout.moves, costs, layout.waypoints)
    best = best_actions(layout.moves, costs, distance)
    steps = _route_cost(layout.waypoints, distance, layout.start % layout.n_cells, layout.start // layout.n_cells)
    return SitePlan(first_of(best), best, steps / SCALE)


def _in_wind(layout: Layout, costs: Ints, slip: float) -> SitePlan:
    """The same where moves go wrong; a blocked cell that a flight is blown against costs a wish broken."""
    calm = all_distances(layout.moves, costs, layout.waypoints)
    distance = calm.astype(np.float64)
    expected = _expected_costs(layout, costs, distance, slip)
    rounded = np.round(expected).reshape(-1, 4)
    rounded[(layout.moves < 0)[np.arange(len(rounded)) % layout.n_cells]] = np.inf
    least = rounded.min(axis=1, keepdims=True)
    known = (calm < FAR).ravel() & np.isfinite(least[:, 0])
    best = (((rounded == least) & known[:, None]) @ (1 << np.arange(4))).astype(np.uint8)
    whole = np.where(calm < FAR, np.round(distance), FAR).astype(np.int64)
    steps = _route_cost(layout.waypoints, whole, layout.start % layout.n_cells, layout.start // layout.n_cells)
    return SitePlan(first_of(best), best, steps / SCALE)


@compiled
def _expected_costs(layout: Layout, costs: Ints, distance: Floats, slip: float) -> Floats:
    """(layers, cells, 4) expected cost of each action to the next waypoint; `distance` (layers, cells), without wind, is made
    that with it (value iteration, Gauss-Seidel)."""
    layers, n = distance.shape
    expected, outcome = np.zeros((layers, n, 4)), np.empty(4)
    for layer in range(layers):
        price, value, goal = costs[layer if len(costs) > 1 else 0], distance[layer], layout.waypoints[layer]
        for sweep in range(MOST_SWEEPS):
            moved = 0.0
            for at in range(n):
                cell = at if sweep % 2 else n - 1 - at
                if cell == goal or value[cell] >= FAR:
                    continue
                for action in range(4):
                    there, beside = layout.moves[cell, action], layout.beside[cell, action]
                    if there >= 0:
                        outcome[action] = price[there] + value[there]
                    else:
                        outcome[action] = value[cell] + SCALE * (1.0 + (PRICE if beside >= 0 else 0.0))
                every, least = outcome.sum() * slip / 3.0, np.inf
                for action in range(4):
                    expected[layer, cell, action] = every + (1.0 - slip - slip / 3.0) * outcome[action]
                    if layout.moves[cell, action] >= 0:
                        least = min(least, expected[layer, cell, action])
                moved = max(moved, abs(least - value[cell]))
                value[cell] = least
            if moved < CLOSE:
                break
    return expected


def first_of(actions: Bytes) -> Ints:
    """(...) of each set of actions, as sums of 1 << action, the first in the order of TIES; 0 of an empty one."""
    order = np.array(TIES)
    first: Ints = order[np.argmax((actions[..., None] >> order.astype(np.uint8)) & 1, axis=-1)]
    return first


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


@compiled
def _route_cost(waypoints: Int32s, distance: Ints, cell: int, layer: int) -> int:
    """Cost from a cell over all waypoints that are left."""
    total = distance[layer, cell]
    for ahead in range(layer + 1, len(waypoints)):
        total += distance[ahead, waypoints[ahead - 1]]
    return total


def least_steps(layout: Layout, weights: Floats) -> Floats:
    """(m,) expected cost of the whole route, in steps, for each of m expected weights (m, cells) or (m, layers, cells)."""
    costs = cell_costs(weights.reshape(len(weights), -1, layout.n_cells))
    return _least(layout.moves, costs, layout.waypoints, layout.start % layout.n_cells, layout.start // layout.n_cells) / SCALE


@compiled
def _least(moves: Int32s, costs: Ints, waypoints: Int32s, cell: int, layer: int) -> Ints:
    values = np.empty(len(costs), np.int64)
    for row in range(len(costs)):
        values[row] = _route_cost(waypoints, all_distances(moves, costs[row], waypoints), cell, layer)
    return values
