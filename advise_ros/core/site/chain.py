"""One map under way: its ways, how likely it makes moves and answers, and a change to a few cells that can be taken back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.site.compiled import compiled
from advise_ros.core.site.layout import Bytes, Int32s, Layout
from advise_ros.core.site.pilots import CompiledMoves
from advise_ros.core.site.search import (
    CELL_BITS,
    CELL_MASK,
    FAR,
    HEAP_PER_CELL,
    HEAP_SPARE,
    all_distances,
    costs_of,
    distances_to,
    next_cost,
    pop,
    push,
)
from advise_ros.core.site.wishes import CompiledWishes

# Indices of a chain's log probabilities.
PRIOR, MOVES, ANSWERS = 0, 1, 2


class CompiledAnswers(NamedTuple):
    """Answers in the form that compiled loops read.

    Attributes:
        first: (k + 1,) where each answer's states begin in `states`.
        states: all states asked about, one answer after the other.
        preferred, avoided: (k,) sums of 1 << action.
        log_by_difference: (9,) log likelihood of an answer that calls so many actions otherwise than the map does.
    """

    first: Int32s
    states: Int32s
    preferred: Bytes
    avoided: Bytes
    log_by_difference: Floats


class Problem(NamedTuple):
    """All that a chain is judged by.

    Attributes:
        layout: site and route.
        moves: the flights' moves under one model of the pilot.
        answers: the answers.
        relevant: (states,) 1 where best actions matter: a move or an answer is there.
        asked: (states,) 1 where an answer is.
        cell_price: (cells,) log odds against a marked cell, before anything was seen.
        edge_price: log odds against each edge between cells of different levels.
        wishes: what cells can be.
    """

    layout: Layout
    moves: CompiledMoves
    answers: CompiledAnswers
    relevant: Bytes
    asked: Bytes
    cell_price: Floats
    edge_price: float
    wishes: CompiledWishes


class Chain(NamedTuple):
    """A map and what follows from it; a change is noted in the journal and can be taken back.

    Attributes:
        levels: (places,) what each cell is, 0 for plain.
        holding: (areas, cells) what each is on the way to each waypoint; one area if they are the same for all.
        price: (areas, cells) of entering.
        distance: (layers, cells) to each layer's waypoint.
        best: (states,) best actions, kept where relevant.
        fit: (states,) log likelihood of the moves in each state.
        total: (3,) log prior, likelihood of all moves, of all answers.
    """

    levels: Bytes
    holding: Bytes
    price: Ints
    distance: Ints
    best: Bytes
    fit: Floats
    total: Floats


class Journal(NamedTuple):
    """What a change overwrote, and scratch space.

    Attributes:
        size: (4,) entries of distances, states, touched states; the number of the change.
        distance_at, distance_was: flat indices and values.
        state_at, best_was, fit_was: states and values.
        touched: states to look at again.
        changed_in, touched_in: (states,) number of the change that last wrote the distance, touched the state.
        heap, costs, cells: scratch.
        total_was: (3,).
        level_was: (places,) of those that were changed, in order.
    """

    size: Ints
    distance_at: Ints
    distance_was: Ints
    state_at: Ints
    best_was: Bytes
    fit_was: Floats
    touched: Ints
    changed_in: Ints
    touched_in: Ints
    heap: Ints
    costs: Ints
    cells: Ints
    total_was: Floats
    level_was: Bytes


@compiled
def new_journal(states: int, cells: int, places: int) -> Journal:
    """An empty journal for a site and maps of so many places."""
    return Journal(
        np.zeros(4, np.int64), np.empty(states, np.int64), np.empty(states, np.int64), np.empty(states, np.int64),
        np.empty(states, np.uint8), np.empty(states, np.float64), np.empty(states, np.int64), np.zeros(states, np.int64),
        np.zeros(states, np.int64), np.empty(HEAP_PER_CELL * cells + HEAP_SPARE, np.int64),
        np.empty(4, np.int64), np.empty(places, np.int64), np.zeros(3, np.float64), np.empty(places, np.uint8),
    )


@compiled
def new_chain(problem: Problem, levels: Bytes) -> Chain:
    """A chain at a map (places,)."""
    layout, wishes = problem.layout, problem.wishes
    n, states, marks = len(layout.beside), len(layout.acting), levels.copy()
    areas = len(layout.waypoints) if wishes.own else 1
    # With one map for all, what holds is the map itself.
    holding = np.empty((areas, n), np.uint8) if wishes.own else marks.reshape((1, n))
    price = np.empty((areas, n), np.int64)
    for area in range(areas):
        for cell in range(n):
            holding[area, cell] = held(marks, wishes.own, n, area, cell)
            price[area, cell] = wishes.price[holding[area, cell]]
    distance = all_distances(layout.moves, price, layout.waypoints)
    chain = Chain(marks, holding, price, distance, np.zeros(states, np.uint8), np.zeros(states), np.zeros(3))
    judge_states(problem, chain, new_journal(states, n, len(levels)), np.arange(states), states)
    chain.total[PRIOR] = log_prior(problem, levels)
    chain.total[ANSWERS] = log_answers(problem.answers, chain.best)
    return chain


@compiled
def held(levels: Bytes, own: int, n: int, area: int, cell: int) -> int:
    """What a cell is on the way to a waypoint: what is said of that way alone, else what is said of all."""
    alone = levels[(1 + area) * n + cell] if own else 0
    return alone if alone > 0 else levels[cell]


@compiled
def judge_soft(
    pull: Floats, total: float, log_normaliser: Floats, most_loss: int, costs: Ints, least: int,
) -> float:
    """Log likelihood of a state's moves by what they lose."""
    lost, digits, place = 0.0, 0, 1
    for action in range(4):
        loss = most_loss + 1
        if costs[action] < FAR:
            loss = min(costs[action] - least, most_loss)
            lost += pull[action] * loss
        digits += loss * place
        place *= most_loss + 2
    return -lost - total * log_normaliser[digits]


@compiled
def judge_states(  # noqa: C901 - one hot loop
    problem: Problem, chain: Chain, journal: Journal, states: Ints, count: int,
) -> bool:
    """Best actions and likelihood of the moves in some states, from the distances; what changes is noted in the journal.

    Returns whether an answer is among the states that changed.
    """
    layout, compiled = problem.layout, problem.moves
    moves, holding, prices, distance = layout.moves, chain.holding, chain.price, chain.distance
    barred, own = problem.wishes.barred, problem.wishes.own
    relevant, asked, row, table = problem.relevant, problem.asked, compiled.row, compiled.table
    pull, total, log_normaliser, soft = compiled.pull, compiled.total, compiled.log_normaliser, compiled.soft
    best_of, fit_of = chain.best, chain.fit
    state_at, best_was, fit_was = journal.state_at, journal.best_was, journal.fit_was
    n, costs, noted, answered, change = prices.shape[1], journal.costs, journal.size[1], False, 0.0
    for at in range(count):
        state = states[at]
        if not relevant[state]:
            continue
        layer = state // n
        cell = state - layer * n
        area = layer if own else 0
        least = costs_of(moves, prices[area], distance[layer], cell, costs)
        best = 0
        for action in range(4):
            if costs[action] == least and least < FAR:
                best |= 1 << action
        fit = 0.0
        if row[state] and soft:
            fit = judge_soft(pull[state], total[state], log_normaliser, compiled.most_loss, costs, least)
        elif row[state]:
            entering = 0
            if not barred[holding[area, cell]]:
                for action in range(4):
                    there = moves[cell, action]
                    if there >= 0 and barred[holding[area, there]]:
                        entering |= 1 << action
            fit = table[row[state], 16 * best + entering]
        if best_of[state] == best and fit_of[state] == fit:
            continue
        state_at[noted], best_was[noted], fit_was[noted] = state, best_of[state], fit_of[state]
        noted += 1
        change += fit - fit_of[state]
        best_of[state], fit_of[state] = best, fit
        answered = answered or asked[state] > 0
    journal.size[1] = noted
    chain.total[MOVES] += change
    return answered


@compiled
def log_prior(problem: Problem, levels: Bytes) -> float:
    """Few marked cells, and those of a level together."""
    beside = problem.layout.beside
    n, value = len(beside), 0.0
    for place in range(len(levels)):
        level, first, cell = levels[place], place - place % n, place % n
        value -= mark_odds(problem, place, level)
        for action in range(2):
            there = beside[cell, action]
            if there >= 0 and levels[first + there] != level:
                value -= problem.edge_price
    return value


@compiled
def mark_odds(problem: Problem, place: int, level: int) -> float:
    """Log odds against a level of a place, before anything was seen."""
    n = len(problem.cell_price)
    if level == 0:
        return 0.0
    return problem.cell_price[place % n] + problem.wishes.odds[level] + (problem.wishes.own_odds if place >= n else 0.0)


@compiled
def prior_change(
    problem: Problem, levels: Bytes, places: Ints, values: Bytes, count: int, marked: Bytes,
) -> float:
    """By how much giving `count` places other levels changes the log prior; `marked` (places,) is scratch, all zero.

    Places that change and are beside each other must stay different, or alike.
    """
    beside = problem.layout.beside
    n, value = len(beside), 0.0
    for at in range(count):
        marked[places[at]] = 1
    for at in range(count):
        place = places[at]
        was, wanted, first = levels[place], values[at], place - place % n
        value += mark_odds(problem, place, was) - mark_odds(problem, place, wanted)
        for action in range(4):
            there = beside[place % n, action]
            if there >= 0 and not marked[first + there]:
                level = levels[first + there]
                value += problem.edge_price * ((level != was) - 1.0 * (level != wanted))
    for at in range(count):
        marked[places[at]] = 0
    return value


@compiled
def answer_code(best: Bytes, states: Int32s, first: int, after: int) -> tuple[int, int]:
    """(preferred, avoided) that a person who knows a map would name for states[first:after], as sums of 1 << action.

    Preferred is what is best in at least half of them, or in most; avoided is what is best in none, or else all others.
    """
    votes = np.zeros(4, np.int64)
    for at in range(first, after):
        for action in range(4):
            votes[action] += (best[states[at]] >> action) & 1
    needed = max(min(2.0 * votes.max(), 1.0 * (after - first)), 2.0)
    preferred, never = 0, 0
    for action in range(4):
        if 2.0 * votes[action] >= needed:
            preferred |= 1 << action
        if votes[action] == 0:
            never |= 1 << action
    return preferred, never or 15 & ~preferred


@compiled
def log_answers(answers: CompiledAnswers, best: Bytes) -> float:
    """Log likelihood of all answers under best actions (states,)."""
    value = 0.0
    for k in range(len(answers.preferred)):
        preferred, avoided = answer_code(best, answers.states, answers.first[k], answers.first[k + 1])
        difference = 0
        for action in range(4):
            difference += ((preferred ^ answers.preferred[k]) >> action) & 1
            difference += ((avoided ^ answers.avoided[k]) >> action) & 1
        value += answers.log_by_difference[difference]
    return value


@compiled
def change(problem: Problem, chain: Chain, journal: Journal, places: Ints, values: Bytes, count: int) -> None:
    """Give `count` places other levels (count,) and bring all that follows up to date; `undo` takes it back."""
    moves, waypoints, own = problem.layout.moves, problem.layout.waypoints, problem.wishes.own
    n, changed = chain.price.shape[1], 0
    journal.size[:3] = 0
    journal.size[3] += 1
    journal.total_was[:] = chain.total
    for at in range(count):
        journal.level_was[at] = chain.levels[places[at]]
        chain.levels[places[at]] = values[at]
    for layer in range(len(waypoints)):
        area = layer if own else 0
        if own or layer == 0:
            changed = _price_again(problem, chain, area, places, count, journal.cells)
        if changed:
            distance, goal = chain.distance[layer], waypoints[layer]
            _repair(moves, chain.price[area], distance, goal, journal.cells, changed, layer * n, journal)
    if judge_states(problem, chain, journal, journal.touched, journal.size[2]):
        chain.total[ANSWERS] = log_answers(problem.answers, chain.best)


@compiled
def _price_again(
    problem: Problem, chain: Chain, area: int, places: Ints, count: int, cells: Ints,
) -> int:
    """What holds on the way to a waypoint after some levels changed; lists the cells whose price did, returns how many."""
    wishes, n, changed = problem.wishes, chain.price.shape[1], 0
    for at in range(count):
        slot, cell = places[at] // n, places[at] % n
        if slot != 0 and slot != area + 1:
            continue
        level = held(chain.levels, wishes.own, n, area, cell)
        if chain.price[area, cell] != wishes.price[level]:
            chain.holding[area, cell], chain.price[area, cell] = level, wishes.price[level]
            cells[changed] = cell
            changed += 1
    return changed


@compiled
def undo(problem: Problem, chain: Chain, journal: Journal, places: Ints, count: int) -> None:
    """Take the last change back."""
    n = chain.price.shape[1]
    for at in range(count):
        chain.levels[places[at]] = journal.level_was[at]
    for area in range(len(chain.price)):
        _price_again(problem, chain, area, places, count, journal.cells)
    for at in range(journal.size[0]):
        state = journal.distance_at[at]
        chain.distance[state // n, state % n] = journal.distance_was[at]
    for at in range(journal.size[1]):
        state = journal.state_at[at]
        chain.best[state], chain.fit[state] = journal.best_was[at], journal.fit_was[at]
    chain.total[:] = journal.total_was


@compiled
def _repair(  # noqa: C901, PLR0913, PLR0917 - one hot loop over plain arrays
    moves: Int32s, price: Ints, distance: Ints, goal: int, cells: Ints, count: int, offset: int, journal: Journal,
) -> None:
    """Bring one layer's distances (cells,) up to date after the prices of some cells changed; note and touch what changes.

    `offset` is the number of the layer's first state.
    """
    heap, touched, touched_in, number = journal.heap, journal.touched, journal.touched_in, journal.size[3]
    distance_at, distance_was, changed_in = journal.distance_at, journal.distance_was, journal.changed_in
    changes, touches, size, room = journal.size[0], journal.size[2], 0, len(heap) - 10
    for at in range(count):
        touches = touch(moves, cells[at], offset, touched, touched_in, number, touches)
        for action in range(4):
            there = moves[cells[at], action]
            if there >= 0 and there != goal and size < room:
                size = queue(moves, price, distance, there, heap, size)
    while 0 < size < room:
        entry = pop(heap, size)
        size -= 1
        cell, key = entry & CELL_MASK, entry >> CELL_BITS
        wanted, now = next_cost(moves, price, distance, cell), distance[cell]
        if wanted == now:
            continue
        if key != min(wanted, now):
            size = push(heap, size, min(wanted, now), cell)
            continue
        if changed_in[offset + cell] != number:
            changed_in[offset + cell] = number
            distance_at[changes], distance_was[changes] = offset + cell, now
            changes += 1
            touches = touch(moves, cell, offset, touched, touched_in, number, touches)
        if wanted < now:
            distance[cell] = wanted
        else:
            distance[cell] = FAR
            size = queue(moves, price, distance, cell, heap, size)
        for action in range(4):
            there = moves[cell, action]
            if there >= 0 and there != goal:
                size = queue(moves, price, distance, there, heap, size)
    journal.size[0], journal.size[2] = changes, touches
    if size >= room:
        _start_over(moves, price, distance, goal, offset, journal)


@compiled
def queue(moves: Int32s, price: Ints, distance: Ints, cell: int, heap: Ints, size: int) -> int:
    """Put a cell on the heap if its distance is not what the cells beside it say."""
    wanted, now = next_cost(moves, price, distance, cell), distance[cell]
    return push(heap, size, min(wanted, now), cell) if wanted != now else size


@compiled
def touch(  # noqa: PLR0913, PLR0917 - plain arrays are fast
    moves: Int32s, cell: int, offset: int, touched: Ints, touched_in: Ints, number: int, touches: int,
) -> int:
    """List the state of a cell and those beside it as to be judged again, once a change."""
    if touched_in[offset + cell] != number:
        touched_in[offset + cell] = number
        touched[touches] = offset + cell
        touches += 1
    for action in range(4):
        there = moves[cell, action]
        if there >= 0 and touched_in[offset + there] != number:
            touched_in[offset + there] = number
            touched[touches] = offset + there
            touches += 1
    return touches


@compiled
def _start_over(moves: Int32s, price: Ints, distance: Ints, goal: int, offset: int, journal: Journal) -> None:
    """Search a layer anew: the repair took more room than the search does."""
    fresh = np.empty(len(price), np.int64)
    distances_to(moves, price, goal, fresh, journal.heap)
    for cell in range(len(fresh)):
        if fresh[cell] == distance[cell]:
            continue
        if journal.changed_in[offset + cell] != journal.size[3]:
            journal.changed_in[offset + cell] = journal.size[3]
            journal.distance_at[journal.size[0]], journal.distance_was[journal.size[0]] = offset + cell, distance[cell]
            journal.size[0] += 1
        distance[cell] = fresh[cell]
        journal.size[2] = touch(moves, cell, offset, journal.touched, journal.touched_in, journal.size[3], journal.size[2])
