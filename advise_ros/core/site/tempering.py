"""Maps drawn from what moves, answers and prior make likely: Metropolis steps in several copies, from cold to hot.

Parallel tempering (Swendsen & Wang 1986; Geyer 1991): each copy weighs the moves by one over its temperature; neighbours are
exchanged now and then, so that the coldest one does not stay on one hill. Proposals are symmetric: they flip a rectangle or a
cell at a border between two levels, exchange two cells near each other, move a whole area by one cell, give it another level,
or make an area of the way to one waypoint one of all ways and back.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.site.chain import (
    ANSWERS,
    MOVES,
    PRIOR,
    Chain,
    Journal,
    Problem,
    change,
    new_chain,
    new_journal,
    prior_change,
    undo,
)
from advise_ros.core.site.compiled import compiled
from advise_ros.core.site.layout import Bytes, Layout

# The first is what is wanted, DOUBTING supplies maps that doubt the model of the pilot.
TEMPERATURES = (1.0, 1.7, 3.0, 9.0)
DOUBTING = 2
# Shares of the proposals, added up; what is left moves an area.
RECTANGLE, BORDER, EXCHANGE = 0.55, 0.75, 0.9
# Shares where there are several levels or maps: of proposals that give a whole area another, of those in the map of one
# waypoint, and of levels that are exchanged with plain.
WHOLE_AREA, ONE_WAYPOINT, WITH_PLAIN = 0.1, 0.5, 0.6
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
        maps: (k, places) at temperature 1.
        doubting: (k, places) at the temperature of doubt.
        best: (places,) the likeliest map met.
        last: (copies, places) where the copies ended: the next run may begin there.
        fit: (copies,) mean log likelihood of the moves at each temperature.
        answers: mean log likelihood of the answers at temperature 1.
    """

    maps: Bytes
    doubting: Bytes
    best: Bytes
    last: Bytes
    fit: Floats
    answers: float


def draw(problem: Problem, starts: Bytes, steps: int, keep: int, rng: np.random.Generator, *, fresh: bool) -> Draws:
    """Draw maps.

    Args:
        problem: what they are judged by.
        starts: (copies, places) where the copies begin, as many as TEMPERATURES.
        steps: proposals in all copies together.
        keep: maps to draw.
        rng: of every random choice.
        fresh: the starts are no draws of a similar problem: begin hotter.
    """
    temperatures = np.array(TEMPERATURES)
    return Draws(*_draw(problem, np.ascontiguousarray(starts), temperatures, steps, keep, BEGIN_HOTTER if fresh else 0.0, rng))


@compiled
def _draw(  # noqa: PLR0913, PLR0917 - what `draw` is given
    problem: Problem, starts: Bytes, temperatures: Floats, steps: int, keep: int, hotter: float, rng: np.random.Generator,
) -> tuple[Bytes, Bytes, Bytes, Bytes, Floats, float]:
    copies, n = starts.shape
    chains = [new_chain(problem, starts[copy]) for copy in range(copies)]
    journal = new_journal(len(problem.layout.acting), len(problem.layout.beside), n)
    scratch = Scratch(np.empty(n, np.int64), np.empty(n, np.uint8), np.zeros(n, np.uint8), np.empty(n, np.int64))
    place = np.arange(copies)
    maps, doubting = np.zeros((keep, n), np.uint8), np.zeros((keep, n), np.uint8)
    best, best_level, fit, answers = starts[0].copy(), np.array([-np.inf]), np.zeros(copies), 0.0
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
        if turn >= burn_in:
            for copy in range(copies):
                fit[copy] += chains[place[copy]].total[MOVES] / (rounds - burn_in)
            answers += chains[place[0]].total[ANSWERS] / (rounds - burn_in)
        while kept < keep and (turn - burn_in + 1) * keep >= (kept + 1) * (rounds - burn_in):
            maps[kept] = chains[place[0]].levels
            doubting[kept] = chains[place[DOUBTING]].levels
            kept += 1
    last = np.empty_like(starts)
    for copy in range(copies):
        last[copy] = chains[place[copy]].levels
    return maps, doubting, best, last, fit, answers


class Scratch(NamedTuple):
    """What a proposal writes.

    Attributes:
        places, values: (places,) that change, and their new levels.
        marked, stack: (places,) scratch; `marked` is all zero before and after.
    """

    places: Ints
    values: Bytes
    marked: Bytes
    stack: Ints


@compiled
def _walk(  # noqa: PLR0913, PLR0917 - one inner loop
    problem: Problem, chain: Chain, journal: Journal, scratch: Scratch, temperature: float, best: Bytes,
    best_level: Floats, rng: np.random.Generator,
) -> None:
    """A round of Metropolis steps of one copy; the likeliest map met is kept in `best`."""
    places, values, total, was = scratch.places, scratch.values, chain.total, journal.total_was
    for _ in range(ROUND):
        count = propose(problem, chain.levels, scratch, rng)
        if count == 0:
            continue
        difference = prior_change(problem, chain.levels, places, values, count, scratch.marked)
        threshold = np.log(1.0 - rng.random())
        if difference <= HOPELESS:
            continue
        change(problem, chain, journal, places, values, count)
        total[PRIOR] += difference
        if threshold >= difference + (total[MOVES] - was[MOVES]) / temperature + total[ANSWERS] - was[ANSWERS]:
            undo(problem, chain, journal, places, count)
        elif total.sum() > best_level[0]:
            best_level[0] = total.sum()
            best[:] = chain.levels


@compiled
def propose(problem: Problem, levels: Bytes, scratch: Scratch, rng: np.random.Generator) -> int:
    """Choose places and new levels for them; returns how many, 0 for none.

    Args:
        problem: the site, whose open cells are never chosen, and what its cells can be.
        levels: (places,) the map now.
        scratch: is written.
        rng: of every choice.
    """
    layout, wishes = problem.layout, problem.wishes
    n, kinds, first, one, other = len(layout.beside), len(wishes.price), 0, 0, 1
    if wishes.own:
        if rng.random() < WHOLE_AREA:
            return _hand_over(layout, levels, scratch, rng)
        if rng.random() < ONE_WAYPOINT:
            first = n * (1 + int(rng.random() * len(layout.waypoints)))
    if kinds > 2:
        if rng.random() < WHOLE_AREA:
            return _recolour(layout, levels, kinds, scratch, rng)
        one = 0 if rng.random() < WITH_PLAIN else int(rng.random() * kinds)
        other = (one + 1 + int(rng.random() * (kinds - 1))) % kinds
    kind = rng.random()
    if kind < RECTANGLE:
        return _rectangle(layout, levels, first, one, other, scratch, rng)
    if kind < BORDER:
        return _border(layout, levels, first, one, other, scratch, rng)
    if kind < EXCHANGE:
        return _exchange(layout, levels, first, scratch, rng)
    return _shift(layout, levels, first, scratch, rng)


@compiled
def _rectangle(  # noqa: PLR0913, PLR0917 - plain arrays are fast
    layout: Layout, levels: Bytes, first: int, one: int, other: int, scratch: Scratch, rng: np.random.Generator,
) -> int:
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
            level = levels[first + cell]
            if not layout.open_cells[cell] and level in (one, other):
                scratch.places[count], scratch.values[count] = first + cell, one + other - level
                count += 1
    return count


@compiled
def _border(  # noqa: PLR0913, PLR0917 - plain arrays are fast
    layout: Layout, levels: Bytes, first: int, one: int, other: int, scratch: Scratch, rng: np.random.Generator,
) -> int:
    cell = int(rng.random() * len(layout.beside))
    level = levels[first + cell]
    if layout.open_cells[cell] or level not in (one, other):
        return 0
    for action in range(4):
        there = layout.beside[cell, action]
        if there >= 0 and levels[first + there]:
            scratch.places[0], scratch.values[0] = first + cell, one + other - level
            return 1
    return 0


@compiled
def _exchange(layout: Layout, levels: Bytes, first: int, scratch: Scratch, rng: np.random.Generator) -> int:
    cell = int(rng.random() * len(layout.beside))
    x = cell % layout.width + int(rng.random() * (2 * NEAR + 1)) - NEAR
    y = cell // layout.width + int(rng.random() * (2 * NEAR + 1)) - NEAR
    if not (0 <= x < layout.width and 0 <= y < layout.height):
        return 0
    there = y * layout.width + x
    if layout.open_cells[cell] or layout.open_cells[there] or levels[first + cell] == levels[first + there]:
        return 0
    scratch.places[0], scratch.values[0] = first + cell, levels[first + there]
    scratch.places[1], scratch.values[1] = first + there, levels[first + cell]
    return 2


@compiled
def _shift(layout: Layout, levels: Bytes, first: int, scratch: Scratch, rng: np.random.Generator) -> int:
    """Move the area around a random cell by one cell, if it then lies on plain cells and touches no other of its level."""
    begin, action = int(rng.random() * len(layout.beside)), int(rng.random() * 4)
    level, marked, stack = levels[first + begin], scratch.marked, scratch.stack
    if not level:
        return 0
    size = _area(layout, levels, first, begin, marked, stack)
    fits = 4 * size <= len(layout.beside)
    count = 0
    for at in range(size):
        there = layout.beside[stack[at], action]
        if there < 0 or layout.open_cells[there] or not _alone(layout, levels, first, 0, level, marked, there):
            fits = False
            break
    if fits:
        back = action ^ 2
        for at in range(size):
            cell = stack[at]
            there, behind = layout.beside[cell, action], layout.beside[cell, back]
            if not marked[there]:
                scratch.places[count], scratch.values[count] = first + there, level
                count += 1
            if behind < 0 or not marked[behind]:
                scratch.places[count], scratch.values[count] = first + cell, 0
                count += 1
    for at in range(size):
        marked[stack[at]] = 0
    return count


@compiled
def _recolour(layout: Layout, levels: Bytes, kinds: int, scratch: Scratch, rng: np.random.Generator) -> int:
    """Give the area around a random cell another level, if it then touches no other of that level."""
    begin, further = int(rng.random() * len(layout.beside)), 1 + int(rng.random() * (kinds - 2))
    if not levels[begin]:
        return 0
    wanted = 1 + (levels[begin] - 1 + further) % (kinds - 1)
    size, fits = _area(layout, levels, 0, begin, scratch.marked, scratch.stack), True
    for at in range(size):
        cell = scratch.stack[at]
        fits = fits and _alone(layout, levels, 0, levels[begin], wanted, scratch.marked, cell)
        scratch.places[at], scratch.values[at] = cell, wanted
    for at in range(size):
        scratch.marked[scratch.stack[at]] = 0
    return size if fits else 0


@compiled
def _hand_over(layout: Layout, levels: Bytes, scratch: Scratch, rng: np.random.Generator) -> int:
    """Make an area of all ways one of the way to one waypoint, or back, if it then touches no other there."""
    n = len(layout.beside)
    giver, taker = 0, n * (1 + int(rng.random() * len(layout.waypoints)))
    if rng.random() < 0.5:
        giver, taker = taker, giver
    begin = int(rng.random() * n)
    if not levels[giver + begin]:
        return 0
    level, count, fits = levels[giver + begin], 0, True
    size = _area(layout, levels, giver, begin, scratch.marked, scratch.stack)
    for at in range(size):
        scratch.marked[scratch.stack[at]] = 0
    for at in range(size):
        cell = scratch.stack[at]
        fits = fits and _alone(layout, levels, taker, 0, level, scratch.marked, cell)
        scratch.places[count], scratch.values[count] = giver + cell, 0
        scratch.places[count + 1], scratch.values[count + 1] = taker + cell, level
        count += 2
    return count if fits else 0


@compiled
def _area(
    layout: Layout, levels: Bytes, first: int, begin: int, marked: Bytes, stack: Ints,
) -> int:
    """Cells of one level connected with one of them: marks them, lists them in `stack`, returns how many."""
    stack[0], size, looked, level = begin, 1, 0, levels[first + begin]
    marked[begin] = 1
    while looked < size:
        cell = stack[looked]
        looked += 1
        for action in range(4):
            there = layout.beside[cell, action]
            if there >= 0 and levels[first + there] == level and not marked[there]:
                marked[there] = 1
                stack[size] = there
                size += 1
    return size


@compiled
def _alone(  # noqa: PLR0913, PLR0917 - plain arrays are fast
    layout: Layout, levels: Bytes, first: int, under: int, level: int, marked: Bytes, cell: int,
) -> bool:
    """Whether a cell of an area that is given a place or level touches no other of that level, and lies on `under` only."""
    if marked[cell] and under == 0:
        return True
    if levels[first + cell] != under:
        return False
    for action in range(4):
        there = layout.beside[cell, action]
        if there >= 0 and levels[first + there] == level and not marked[there]:
            return False
    return True
