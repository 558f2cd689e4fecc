"""Maximum causal entropy inverse reinforcement learning (Ziebart 2010) of the package irl-maxent, on a route.

Features: what a step costs, and what each cell costs beside that, one map shared by the ways to all waypoints; the goal of a
way ends it. The package computes the soft-optimal policy and the visits that it expects; each way to a waypoint is a process
of its own, since what comes after the waypoint does not depend on how it was reached. Its ascent, with a step of fixed
length, takes thousands of steps; here L-BFGS climbs the same likelihood by the same gradient.

irl-maxent 0.1.0 is written for numpy before 1.24 and asks for `numpy.float`, which it is lent while it computes. It keeps
whole (cells, cells, 4) tables: a site of 20 x 20 cells takes minutes, and none of these is tried beyond that.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
from scipy.optimize import minimize

from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import N_ACTIONS
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.site.layout import Layout
from advise_ros.core.site.plan import SCALE, first_of
from advise_ros.core.site.search import all_distances, best_actions

PACKAGE = 'irl_maxent'
MISSING = (
    "way 'maxent' needs the package irl-maxent; install it with "
    './advise python -m pip install --no-deps --require-hashes -r requirements/rivals.txt'
)
# With a dearer step than log(actions) no loop has endless value.
LEAST_STEP, MOST_COST = float(np.log(N_ACTIONS)) + 0.05, 15.0
# Weight of half the squares of the cell costs.
RIDGE = 0.1
CLIMBS = 60
CONVERGED = 1e-4
# What ends a way is worth nothing more, and being there costs so much that nobody stays.
LEAVING = -1000.0


class FlownLeg(NamedTuple):
    """The way to one waypoint in all flights.

    Attributes:
        goal: its cell.
        taken: (cells, 4) moves.
        starts: (cells,) how many flights began it where.
    """

    goal: int
    taken: Floats
    starts: Floats


def is_missing() -> bool:
    """Whether the package is not installed."""
    return find_spec(PACKAGE) is None


def fit(layout: Layout, flights: Sequence[Demonstration]) -> Floats:
    """(cells,) what entering each cell costs to the person who made these flights most likely.

    Raises:
        InputError: the package is not installed.
    """
    if is_missing():
        raise InputError(MISSING)
    legs, free = _legs(layout, flights), layout.open_cells == 0
    moves = _table(layout)
    with mock.patch.object(np, 'float', float, create=True), np.errstate(all='ignore'):
        found = minimize(
            lambda costs: _loss(layout, moves, legs, costs), np.append(np.zeros(layout.n_cells), 2.0), jac=True,
            method='L-BFGS-B', options={'maxiter': CLIMBS},
            bounds=[*((0.0, MOST_COST if one else 0.0) for one in free), (LEAST_STEP, MOST_COST)],
        )
    costs: Floats = found.x[:-1] + found.x[-1]
    return costs


def fly(layout: Layout, costs: Floats) -> Ints:
    """(states,) the actions of the cheapest ways when entering cells costs so much (cells,)."""
    whole = np.round(SCALE * costs).astype(np.int64)
    return first_of(best_actions(layout.moves, whole, all_distances(layout.moves, whole, layout.waypoints)))


def _legs(layout: Layout, flights: Sequence[Demonstration]) -> list[FlownLeg]:
    n = layout.n_cells
    taken, starts = np.zeros((layout.n_layers, n, N_ACTIONS)), np.zeros((layout.n_layers, n))
    for flight in flights:
        layers, cells = np.divmod(np.array(flight.states), n)
        np.add.at(taken, (layers, cells, np.array(flight.actions)), 1.0)
        first = np.flatnonzero(np.diff(layers, prepend=-1))
        np.add.at(starts, (layers[first], cells[first]), 1.0)
    return [FlownLeg(int(goal), *rest) for goal, *rest in zip(layout.waypoints, taken, starts, strict=True)]


def _table(layout: Layout) -> Floats:
    """(cells, cells, 4) as the package wants it: 1 where an action leads; over the border one stays."""
    n = layout.n_cells
    table = np.zeros((n, n, N_ACTIONS))
    here = np.arange(n)[:, None]
    table[here, np.where(layout.moves >= 0, layout.moves, here), np.arange(N_ACTIONS)] = 1.0
    return table


def _loss(layout: Layout, moves: Floats, legs: Sequence[FlownLeg], costs: Floats) -> tuple[float, Floats]:
    """Minus the log likelihood of the moves, and its slopes, at costs (cells + 1,) of cells and, last, of a step."""
    package: Any = __import__(f'{PACKAGE}.maxent', fromlist=['maxent'])
    value, slopes = RIDGE / 2 * float(costs[:-1] @ costs[:-1]), np.append(RIDGE * costs[:-1], 0.0)
    for leg in legs:
        reward = -(costs[:-1] + costs[-1])
        reward[leg.goal] = LEAVING
        policy = package.local_causal_action_probabilities(moves, [leg.goal], reward, 1.0, CONVERGED)
        expected = package.expected_svf_from_policy(moves, leg.starts, [leg.goal], policy, CONVERGED)
        value -= float((leg.taken * np.log(np.maximum(policy, 1e-300))).sum())
        # A likelier move costs less: flown visits pull costs down, expected ones push them up.
        more = leg.taken.sum(axis=1) - expected
        more[leg.goal] = 0.0
        slopes[:-1] += more
        slopes[-1] += more.sum()
    slopes[:-1] *= layout.open_cells == 0
    return value, slopes
