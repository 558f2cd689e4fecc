"""Sites with wishes that are not on the map, and simulated people who know them.

The pilots fly as the product's `SimulatedPilot` does, with ways round what is hidden as the right ones; the expert is the
product's, who knows the same ways.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from advise_ros.core.demonstrations.demonstration import Demonstration, EndReason
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.grid.tables import occurring
from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.people.known_site import Site, judge, site_with
from advise_ros.core.people.simulated_expert import SimulatedExpert
from advise_ros.core.people.simulated_pilot import SimulatedPilot, demonstrate
from advise_ros.core.site.layout import Bytes, layout_of
from advise_ros.core.site.search import FAR, all_distances

# Hidden cells are this share of all, in so many areas on small and on large sites.
SHARE, AREAS, AREAS_LARGE, LARGE = (0.05, 0.15), (1, 3), (2, 5), 200
LEAST_SHARE, MOST_SHARE = 0.04, 0.17
# Waypoints lie at least this share of the width from the next, and this many cells.
APART_SHARE, APART_CELLS = 0.25, 3
# What the softly rational pilot goes round a hidden cell for, in steps.
SOFT_PRICE = 6


class Size(NamedTuple):
    """Cells along each edge and waypoints; `fixed` are these, else they are drawn."""

    edge: int
    waypoints: int
    fixed: tuple[int, ...] = ()


SIZES = {
    '6x6-4': Size(6, 4, (5, 35, 30, 0)),
    '8x8-3': Size(8, 3, (15, 50, 0)),
    '8x8-8': Size(8, 8),
    '12x12-6': Size(12, 6),
    '20x20-8': Size(20, 8),
    '30x30-10': Size(30, 10),
}


def random_site(size: str, rng: np.random.Generator, *, hidden: bool = True) -> Site:
    """A site of one of SIZES; with `hidden`, areas to keep out of lie on its direct ways.

    Raises:
        InputError: no such size.
    """
    if size not in SIZES:
        raise InputError(f"site '{size}' is unknown; known: {', '.join(SIZES)}")
    grid = random_grid(SIZES[size], rng)
    return site_with(grid, hidden_areas(grid, rng) if hidden else np.zeros(grid.n_cells, dtype=np.uint8))


def other_route(site: Site, rng: np.random.Generator, tries: int = 3000) -> Site | None:
    """Other waypoints on the same site whose direct ways cross what is hidden; None where there are none."""
    grid = site.grid
    for _ in range(tries):
        waypoints = rng.choice(np.flatnonzero(site.keep_out == 0), grid.n_layers, replace=False)
        if not _far_apart(grid, waypoints):
            continue
        other = site_with(replace(grid, waypoints=tuple(waypoints.tolist())), site.keep_out)
        direct = site_with(other.grid, np.zeros_like(site.keep_out))
        if reaches(other) and other.steps > direct.steps:
            return other
    return None


def other_wishes(site: Site, rng: np.random.Generator) -> Site:
    """The same route as flown by somebody else, who wants other areas kept out of."""
    return site_with(site.grid, hidden_areas(site.grid, rng))


def given_up(flight: Demonstration) -> Demonstration:
    """The first half of a flight."""
    half = len(flight.states) // 2
    return replace(
        flight, states=flight.states[:half], actions=flight.actions[:half], stamps_ns=flight.stamps_ns[:half],
        window_ns=(flight.window_ns[0], flight.stamps_ns[half]), end_reason=EndReason.STOPPED,
    )


def reaches(site: Site) -> bool:
    """Whether the right ways lead to the end without entering a hidden cell."""
    return judge(site, site.right.argmax(axis=1)).success


def pilot_of(site: Site, kind: str, noise: float, mistakes: float, rng: np.random.Generator) -> SimulatedPilot:
    """A pilot of this site.

    Args:
        site: what he knows.
        kind: 'errs' (whatever it loses), 'shy' (as that one, but never into a hidden cell) or 'soft' (the seldomer the more
            it loses).
        noise: share of wrong moves.
        mistakes: share of the states where he makes the same wrong move again and again; not of 'soft'.
        rng: of every random choice.

    Raises:
        InputError: no such kind.
    """
    kinds = {'errs': None, 'shy': ~_enters(site), 'soft': None}
    if kind not in kinds:
        raise InputError(f"pilot '{kind}' is unknown; known: {', '.join(kinds)}")
    if kind == 'soft':
        return _SoftPilot(site, noise, rng)
    return SimulatedPilot(site.grid, noise, mistakes, rng, right=site.right, possible=kinds[kind])


def flights_of(site: Site, pilot: SimulatedPilot, number: int) -> tuple[Demonstration, ...]:
    """So many flights, each given up after twenty times the best one's moves."""
    longest = max(400, 20 * site.steps)
    return tuple(demonstrate(site.grid, pilot, index, longest) for index in range(number))


def expert_of(site: Site, errors: float, rng: np.random.Generator) -> SimulatedExpert:
    """A person who knows the site and answers wrongly in a share of the questions."""
    return SimulatedExpert(site.grid, rng, error_rate=errors, right=site.right)


class _SoftPilot(SimulatedPilot):
    """Makes a move the seldomer the more it loses; his temperature makes `noise` of the moves wrong in an average state."""

    def __init__(self, site: Site, noise: float, rng: np.random.Generator) -> None:
        super().__init__(site.grid, 0.0, 0.0, rng, right=site.right)
        losses = _losses(site)
        acting = occurring(site.grid)
        wrong = ~site.right[acting]
        for temperature in np.geomspace(0.2, 8.0, 40):
            shares = np.exp(-losses / temperature)
            shares /= shares.sum(axis=1, keepdims=True)
            if (shares[acting] * wrong).sum(axis=1).mean() >= noise:
                break
        self._cumulated: Floats = shares.cumsum(axis=1)

    def action(self, state: int) -> int:
        return int(min((self._cumulated[state] < self._rng.random()).sum(), N_ACTIONS - 1))


def _losses(site: Site) -> Floats:
    """(states, 4) what each action costs more than the best one when a hidden cell is worth SOFT_PRICE steps."""
    layout = layout_of(site.grid)
    price = np.where(site.keep_out > 0, 1 + SOFT_PRICE, 1).astype(np.int64)
    distance = all_distances(layout.moves, price[None], layout.waypoints)
    there = layout.moves
    costs = np.where(there >= 0, distance[:, there] + price[there], FAR).reshape(-1, N_ACTIONS)
    return np.minimum(costs - costs.min(axis=1, keepdims=True), 1e6)


def _enters(site: Site) -> Bools:
    """(states, 4) actions that enter a hidden cell from outside."""
    there = layout_of(site.grid).moves
    entering = (there >= 0) & (site.keep_out[there] > 0) & (site.keep_out == 0)[:, None]
    return np.tile(entering, (site.grid.n_layers, 1))


def random_grid(size: Size, rng: np.random.Generator) -> Grid:
    blank = Grid(2.0, size.edge, size.edge, (-1.0, -1.0), 5.0, size.fixed or (0,))
    if size.fixed:
        return blank
    while True:
        waypoints = rng.choice(blank.n_cells, size.waypoints, replace=False)
        if _far_apart(blank, waypoints):
            return replace(blank, waypoints=tuple(waypoints.tolist()))


def _far_apart(grid: Grid, waypoints: Ints) -> bool:
    columns, rows = waypoints % grid.width, waypoints // grid.width
    apart = abs(columns - np.roll(columns, 1)) + abs(rows - np.roll(rows, 1))
    return bool(apart.min() >= max(APART_CELLS, int(APART_SHARE * grid.width)))


def hidden_areas(grid: Grid, rng: np.random.Generator) -> Bytes:
    """(cells,) rectangles or irregular areas on the direct ways that leave a way round."""
    free = [*grid.waypoints, grid.cell_of(grid.start_state())]
    direct = site_with(grid, np.zeros(grid.n_cells, dtype=np.uint8)).right
    while True:
        keep_out = np.zeros(grid.n_cells, dtype=np.uint8)
        wanted, rectangles = max(2, round(rng.uniform(*SHARE) * grid.n_cells)), rng.random() < 0.5
        areas = int(rng.integers(*(AREAS if grid.n_cells < LARGE else AREAS_LARGE), endpoint=True))
        for _ in range(areas):
            middle = _on_a_way(grid, direct, rng)
            size = max(2, wanted // areas)
            keep_out[_rectangle(grid, middle, size, rng) if rectangles else _irregular(grid, middle, size, rng)] = 1
        keep_out[free] = 0
        if LEAST_SHARE <= keep_out.mean() <= MOST_SHARE and reaches(site_with(grid, keep_out)):
            return keep_out


def _on_a_way(grid: Grid, direct: Bools, rng: np.random.Generator) -> int:
    """A cell of a random direct way, not its ends."""
    states = [grid.start_state()]
    while not grid.is_terminal(states[-1]):
        states.append(grid.successor(states[-1], int(rng.choice(np.flatnonzero(direct[states[-1]])))))
    return grid.cell_of(states[int(rng.integers(1, len(states) - 1))])


def _rectangle(grid: Grid, middle: int, size: int, rng: np.random.Generator) -> list[int]:
    x, y = grid.xy(middle)
    wide = int(rng.integers(1, max(2, min(grid.width // 2, size) + 1)))
    high = max(1, round(size / wide))
    west, south = x - int(rng.integers(wide)), y - int(rng.integers(high))
    cells = [(i, j) for i in range(west, west + wide) for j in range(south, south + high)]
    return [grid.cell(i, j) for i, j in cells if grid.contains(i, j)]


def _irregular(grid: Grid, middle: int, size: int, rng: np.random.Generator) -> list[int]:
    area = [middle]
    while len(area) < size:
        there = grid.neighbour(area[int(rng.integers(len(area)))], int(rng.integers(N_ACTIONS)))
        if there not in area:
            area.append(there)
    return area
