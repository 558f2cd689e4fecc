"""Maps drawn from what moves, answers and prior make likely: Metropolis steps in several copies, from cold to hot.

Parallel tempering (Swendsen & Wang 1986; Geyer 1991): each copy weighs the moves by one over its temperature; neighbours are
exchanged now and then, so that the coldest one does not stay on one hill. Proposals are symmetric: they flip a rectangle or a
cell at a border, exchange two cells near each other, or move a whole area by one cell.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.site.chain import (
    ANSWERS,
    MOVES,
    PRIOR,
    Chain,
    Journal,
    Problem,
    flip,
    new_chain,
    new_journal,
    prior_change,
    undo,
)
from advise_ros.core.site.layout import Bytes, Layout

# The first is what is wanted, DOUBTING supplies maps that doubt the model of the pilot.
TEMPERATURES = (1.0, 1.4, 2.0, 3.0, 5.0, 9.0)
DOUBTING = 3
# Shares of the proposals, added up; what is left moves an area.
RECTANGLE, BORDER, EXCHANGE = 0.55, 0.75, 0.9
# A side of a rectangle grows by another cell with this probability; two cells this far apart are near.
LONGER, NEAR = 0.45, 2
# Each copy makes so many steps in a row; then two neighbouring ones may be exchanged.
ROUND = 10
# A change whose prior falls by more is not worth a look.
HOPELESS = -60.0
# The first of so many parts only looks for a good place, and begins hotter.
BURN_IN, BEGIN_HOTTER = 3, 1.0


class Draws(NamedTuple):
    """What was drawn.

    Attributes:
        maps: (k, cells) at temperature 1.
        log_posterior: (k,) of these.
        doubting: (k, cells) at the temperature of doubt.
        best: (cells,) the likeliest map met.
        last: (copies, cells) where the copies ended: the next run may begin there.
    """

    maps: Bytes
    log_posterior: Floats
    doubting: Bytes
    best: Bytes
    last: Bytes


def draw(problem: Problem, starts: Bytes, steps: int, keep: int, rng: np.random.Generator, *, fresh: bool) -> Draws:
    """Draw maps.

    Args:
        problem: what they are judged by.
        starts: (copies, cells) where the copies begin, as many as TEMPERATURES.
        steps: proposals in all copies together.
        keep: maps to draw.
        rng: of every random choice.
        fresh: the starts are no draws of a similar problem: begin hotter.
    """
    temperatures = np.array(TEMPERATURES)
    return Draws(*_draw(problem, np.ascontiguousarray(starts), temperatures, steps, keep, BEGIN_HOTTER if fresh else 0.0, rng))


@njit(cache=True)
def _draw(  # noqa: PLR0913, PLR0917 - what `draw` is given
    problem: Problem, starts: Bytes, temperatures: Floats, steps: int, keep: int, hotter: float, rng: np.random.Generator,
) -> tuple[Bytes, Floats, Bytes, Bytes, Bytes]:
    copies, n = starts.shape
    chains = [new_chain(problem, starts[copy]) for copy in range(copies)]
    journal = new_journal(len(problem.layout.acting), n)
    scratch = np.empty(n, np.int64), np.zeros(n, np.uint8), np.empty(n, np.int64)
    place = np.arange(copies)
    maps, doubting, levels = np.zeros((keep, n), np.uint8), np.zeros((keep, n), np.uint8), np.zeros(keep)
    best, best_level = starts[0].copy(), np.array([-np.inf])
    rounds = max(steps // (copies * ROUND), BURN_IN + 1)
    burn_in, kept = rounds // BURN_IN, 0
    for turn in range(rounds):
        heat = 1.0 + hotter * max(0.0, 1.0 - turn / burn_in)
        for copy in range(copies):
            _walk(problem, chains[place[copy]], journal, scratch, heat * temperatures[copy], best, best_level, rng)
        at = int(rng.random() * (copies - 1))
        moves_apart = chains[place[at + 1]].total[MOVES] - chains[place[at]].total[MOVES]
        if np.log(1.0 - rng.random()) < (1.0 / temperatures[at] - 1.0 / temperatures[at + 1]) * moves_apart:
            place[at], place[at + 1] = place[at + 1], place[at]
        while kept < keep and (turn - burn_in + 1) * keep >= (kept + 1) * (rounds - burn_in):
            maps[kept] = chains[place[0]].keep_out
            doubting[kept] = chains[place[DOUBTING]].keep_out
            levels[kept] = chains[place[0]].total.sum()
            kept += 1
    last = np.empty_like(starts)
    for copy in range(copies):
        last[copy] = chains[place[copy]].keep_out
    return maps, levels, doubting, best, last


@njit(cache=True)
def _walk(  # noqa: PLR0913, PLR0917 - one inner loop
    problem: Problem, chain: Chain, journal: Journal, scratch: tuple[Ints, Bytes, Ints], temperature: float, best: Bytes,
    best_level: Floats, rng: np.random.Generator,
) -> None:
    """A round of Metropolis steps of one copy; the likeliest map met is kept in `best`."""
    cells, marked, stack = scratch
    total, was = chain.total, journal.total_was
    for _ in range(ROUND):
        count = propose(problem.layout, chain.keep_out, cells, marked, stack, rng)
        if count == 0:
            continue
        change = prior_change(problem, chain.keep_out, cells, count, marked)
        threshold = np.log(1.0 - rng.random())
        if change <= HOPELESS:
            continue
        flip(problem, chain, journal, cells, count)
        total[PRIOR] += change
        if threshold >= change + (total[MOVES] - was[MOVES]) / temperature + total[ANSWERS] - was[ANSWERS]:
            undo(problem, chain, journal, cells, count)
        elif total.sum() > best_level[0]:
            best_level[0] = total.sum()
            best[:] = chain.keep_out


@njit(cache=True)
def propose(
    layout: Layout, keep_out: Bytes, cells: Ints, marked: Bytes, stack: Ints, rng: np.random.Generator,
) -> int:
    """Choose cells to flip; returns how many, 0 for none.

    Args:
        layout: the site; its open cells are never chosen.
        keep_out: (cells,) the map now.
        cells: (cells,) is written.
        marked, stack: (cells,) scratch; `marked` is all zero before and after.
        rng: of every choice.
    """
    kind = rng.random()
    if kind < RECTANGLE:
        return _rectangle(layout, cells, rng)
    if kind < BORDER:
        return _border(layout, keep_out, cells, rng)
    if kind < EXCHANGE:
        return _exchange(layout, keep_out, cells, rng)
    return _shift(layout, keep_out, cells, marked, stack, rng)


@njit(cache=True)
def _rectangle(layout: Layout, cells: Ints, rng: np.random.Generator) -> int:
    wide, high = 1, 1
    while wide < layout.width and rng.random() < LONGER:
        wide += 1
    while high < layout.height and rng.random() < LONGER:
        high += 1
    west, south = int(rng.random() * (layout.width - wide + 1)), int(rng.random() * (layout.height - high + 1))
    count = 0
    for y in range(south, south + high):
        for x in range(west, west + wide):
            cell = y * layout.width + x
            if not layout.open_cells[cell]:
                cells[count] = cell
                count += 1
    return count


@njit(cache=True)
def _border(layout: Layout, keep_out: Bytes, cells: Ints, rng: np.random.Generator) -> int:
    cell = int(rng.random() * len(keep_out))
    if layout.open_cells[cell]:
        return 0
    for action in range(4):
        there = layout.beside[cell, action]
        if there >= 0 and keep_out[there]:
            cells[0] = cell
            return 1
    return 0


@njit(cache=True)
def _exchange(layout: Layout, keep_out: Bytes, cells: Ints, rng: np.random.Generator) -> int:
    cell = int(rng.random() * len(keep_out))
    x = cell % layout.width + int(rng.random() * (2 * NEAR + 1)) - NEAR
    y = cell // layout.width + int(rng.random() * (2 * NEAR + 1)) - NEAR
    if not (0 <= x < layout.width and 0 <= y < layout.height):
        return 0
    other = y * layout.width + x
    if layout.open_cells[cell] or layout.open_cells[other] or keep_out[cell] == keep_out[other]:
        return 0
    cells[0], cells[1] = cell, other
    return 2


@njit(cache=True)
def _shift(
    layout: Layout, keep_out: Bytes, cells: Ints, marked: Bytes, stack: Ints, rng: np.random.Generator,
) -> int:
    """Move the area around a random cell by one cell, if it then lies free and touches no other."""
    begin, action = int(rng.random() * len(keep_out)), int(rng.random() * 4)
    if not keep_out[begin]:
        return 0
    size = _area(layout, keep_out, begin, marked, stack)
    fits = 4 * size <= len(keep_out)
    count = 0
    for at in range(size):
        there = layout.beside[stack[at], action]
        if there < 0 or layout.open_cells[there] or not _alone(layout, keep_out, marked, there):
            fits = False
            break
    if fits:
        back = action ^ 2
        for at in range(size):
            cell = stack[at]
            there, behind = layout.beside[cell, action], layout.beside[cell, back]
            if not marked[there]:
                cells[count] = there
                count += 1
            if behind < 0 or not marked[behind]:
                cells[count] = cell
                count += 1
    for at in range(size):
        marked[stack[at]] = 0
    return count


@njit(cache=True)
def _area(layout: Layout, keep_out: Bytes, begin: int, marked: Bytes, stack: Ints) -> int:
    """Marked cells connected with one of them: marks them, lists them in `stack`, returns how many."""
    stack[0], size, looked = begin, 1, 0
    marked[begin] = 1
    while looked < size:
        cell = stack[looked]
        looked += 1
        for action in range(4):
            there = layout.beside[cell, action]
            if there >= 0 and keep_out[there] and not marked[there]:
                marked[there] = 1
                stack[size] = there
                size += 1
    return size


@njit(cache=True)
def _alone(layout: Layout, keep_out: Bytes, marked: Bytes, cell: int) -> bool:
    """Whether a cell of the moved area would touch no other area."""
    if marked[cell]:
        return True
    for action in range(4):
        there = layout.beside[cell, action]
        if there >= 0 and keep_out[there] and not marked[there]:
            return False
    return True
