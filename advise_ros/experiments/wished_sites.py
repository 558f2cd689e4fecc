"""Sites whose person wishes more than to keep out of some cells: dear areas, corridors, areas on the way to one waypoint.

What counts: the way costs at most NEARLY more than the best one by what each cell is truly worth to the person.
"""

from __future__ import annotations

import numpy as np

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.tables import occurring
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.people.known_site import Site
from advise_ros.core.planning.rollout import Rollout, rollout
from advise_ros.core.site.layout import Bytes, layout_of
from advise_ros.core.site.pilots import AVOID_AT_ALL_COST, IN_SET, best_sets
from advise_ros.core.site.plan import PRICE, highest, lowest
from advise_ros.core.site.wishes import CORRIDOR_SAVES
from advise_ros.experiments.sites import Size, hidden_areas, random_grid

WISHES = ('nothing', 'keep-out', 'dear', 'corridor', 'one-waypoint')
SIZE = Size(10, 5)
# Steps that a cell of a dear area costs more, and that a way may cost more than the best one.
DEAR, NEARLY = 3, 0.6
# Whoever does not know the wish pays so many steps more at least.
AT_STAKE = 1.0
TRIES = 500


def wished_site(wish: str, rng: np.random.Generator, size: Size = SIZE) -> tuple[Site, Floats]:
    """A site, and what entering each cell is worth, (layers, cells) as of `SiteBelief.maps`.

    Args:
        wish: one of WISHES.
        rng: of every random choice.
        size: of the site.

    Raises:
        InputError: no such wish.
    """
    if wish not in WISHES:
        raise InputError(f"wish '{wish}' is unknown; known: {', '.join(WISHES)}")
    grid = random_grid(size, rng)
    for _ in range(TRIES):
        weights = _weights(grid, wish, rng)
        site = _site(grid, weights)
        if wish == 'nothing' or _at_stake(site, weights):
            return site, weights
    return wished_site(wish, rng, size)


def extra_steps(site: Site, weights: Floats, greedy: Ints) -> float:
    """What a flight by greedy actions (states,) costs more than the best one; infinite where it does not arrive."""
    flight, best = _flown(site.grid, greedy), _flown(site.grid, site.right.argmax(axis=1))
    return _cost(site.grid, weights, flight) - _cost(site.grid, weights, best) if flight.reached else np.inf


def _flown(grid: Grid, greedy: Ints) -> Rollout:
    return rollout(grid, greedy.tolist(), grid.start_state(), grid.n_states)


def _cost(grid: Grid, weights: Floats, flight: Rollout) -> float:
    """Steps, and what the cells that are entered are worth on the way to the waypoint that is then next."""
    states = np.array(flight.states)
    entered = weights[states[:-1] // grid.n_cells, states[1:] % grid.n_cells]
    return float(np.where(entered >= 1.0, 1.0 + AVOID_AT_ALL_COST, 1.0 + PRICE * entered).sum())


def _site(grid: Grid, weights: Floats) -> Site:
    right = IN_SET[best_sets(layout_of(grid), weights[None])[0]] & occurring(grid)[:, None]
    keep_out: Bytes = np.any(weights >= 1.0, axis=0).astype(np.uint8)
    return Site(grid, keep_out, right, _flown(grid, right.argmax(axis=1)).steps)


def _at_stake(site: Site, weights: Floats) -> bool:
    """Whether the right way enters nothing that is forbidden, and neither of two shortest ways is good."""
    right = _cost(site.grid, weights, _flown(site.grid, site.right.argmax(axis=1)))
    direct = best_sets(layout_of(site.grid), np.zeros((1, site.grid.n_cells)))[0]
    return right < AVOID_AT_ALL_COST and all(extra_steps(site, weights, way(direct)) >= AT_STAKE for way in (lowest, highest))


def _weights(grid: Grid, wish: str, rng: np.random.Generator) -> Floats:
    weights = np.zeros((grid.n_layers, grid.n_cells))
    if wish in {'keep-out', 'dear'}:
        weights[:] = hidden_areas(grid, rng) * (1.0 if wish == 'keep-out' else DEAR / PRICE)
    if wish == 'one-waypoint':
        weights[rng.integers(grid.n_layers)] = hidden_areas(grid, rng)
    if wish == 'corridor':
        weights[:, _corridors(grid, rng)] = -CORRIDOR_SAVES / PRICE
        weights[:, [*grid.waypoints, grid.cell_of(grid.start_state())]] = 0.0
    return weights


def _corridors(grid: Grid, rng: np.random.Generator) -> list[int]:
    """Two straight lines of cells."""
    cells = list[int]()
    for _ in range(2):
        long = int(rng.integers(grid.width // 2, grid.width))
        begin, beside = int(rng.integers(grid.width - long + 1)), int(rng.integers(grid.height))
        line = [(begin + at, beside) for at in range(long)]
        cells += [grid.cell(x, y) for x, y in (line if rng.random() < 0.5 else [(y, x) for x, y in line])]
    return cells
