"""One map under way: its ways, how likely it makes moves and answers, and a change to a few cells that can be taken back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.site.layout import Bytes, Int32s, Layout
from advise_ros.core.site.pilots import MOST_LOSS, NO_MOVE, CompiledMoves
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
        edge_price: log odds against each edge between a marked cell and one that is not.
    """

    layout: Layout
    moves: CompiledMoves
    answers: CompiledAnswers
    relevant: Bytes
    asked: Bytes
    cell_price: Floats
    edge_price: float


class Chain(NamedTuple):
    """A map and what follows from it; a change is noted in the journal and can be taken back.

    Attributes:
        keep_out: (cells,) 1 for marked cells.
        price: (cells,) of entering, in steps.
        distance: (layers, cells) to each layer's waypoint.
        best: (states,) best actions, kept where relevant.
        fit: (states,) log likelihood of the moves in each state.
        total: (3,) log prior, likelihood of all moves, of all answers.
    """

    keep_out: Bytes
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
        heap, costs: scratch.
        total_was: (3,).
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
    total_was: Floats


@njit(cache=True)
def new_journal(states: int, cells: int) -> Journal:
    """An empty journal for a site."""
    return Journal(
        np.zeros(4, np.int64), np.empty(states, np.int64), np.empty(states, np.int64), np.empty(states, np.int64),
        np.empty(states, np.uint8), np.empty(states, np.float64), np.empty(states, np.int64), np.zeros(states, np.int64),
        np.zeros(states, np.int64), np.empty(HEAP_PER_CELL * cells + HEAP_SPARE, np.int64),
        np.empty(4, np.int64), np.zeros(3, np.float64),
    )


@njit(cache=True)
def new_chain(problem: Problem, keep_out: Bytes) -> Chain:
    """A chain at a map (cells,)."""
    layout, moves = problem.layout, problem.moves
    price = np.ones(len(keep_out), np.int64)
    for cell in range(len(keep_out)):
        if keep_out[cell]:
            price[cell] = moves.entry_price
    distance = all_distances(layout.moves, price, layout.waypoints)
    states = len(layout.acting)
    chain = Chain(keep_out.copy(), price, distance, np.zeros(states, np.uint8), np.zeros(states), np.zeros(3))
    judge_states(problem, chain, new_journal(states, len(price)), np.arange(states), states)
    chain.total[PRIOR] = log_prior(problem, keep_out)
    chain.total[ANSWERS] = log_answers(problem, chain.best)
    return chain


@njit(cache=True)
def judge_soft(pull: Floats, total: float, log_normaliser: Floats, costs: Ints, least: int) -> float:
    """Log likelihood of a state's moves by what they lose."""
    lost, digits, place = 0.0, 0, 1
    for action in range(4):
        loss = NO_MOVE
        if costs[action] < FAR:
            loss = min(costs[action] - least, MOST_LOSS)
            lost += pull[action] * loss
        digits += loss * place
        place *= NO_MOVE + 1
    return -lost - total * log_normaliser[digits]


@njit(cache=True)
def judge_states(  # noqa: C901 - one hot loop
    problem: Problem, chain: Chain, journal: Journal, states: Ints, count: int,
) -> bool:
    """Best actions and likelihood of the moves in some states, from the distances; what changes is noted in the journal.

    Returns whether an answer is among the states that changed.
    """
    layout, compiled = problem.layout, problem.moves
    moves, keep_out, price, distance = layout.moves, chain.keep_out, chain.price, chain.distance
    relevant, asked, row, table = problem.relevant, problem.asked, compiled.row, compiled.table
    pull, total, log_normaliser, soft = compiled.pull, compiled.total, compiled.log_normaliser, compiled.soft
    best_of, fit_of = chain.best, chain.fit
    state_at, best_was, fit_was = journal.state_at, journal.best_was, journal.fit_was
    n, costs, noted, answered, change = len(price), journal.costs, journal.size[1], False, 0.0
    for at in range(count):
        state = states[at]
        if not relevant[state]:
            continue
        layer = state // n
        cell = state - layer * n
        least = costs_of(moves, price, distance[layer], cell, costs)
        best = 0
        for action in range(4):
            if costs[action] == least and least < FAR:
                best |= 1 << action
        fit = 0.0
        if row[state] and soft:
            fit = judge_soft(pull[state], total[state], log_normaliser, costs, least)
        elif row[state]:
            entering = 0
            if not keep_out[cell]:
                for action in range(4):
                    there = moves[cell, action]
                    if there >= 0 and keep_out[there]:
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


@njit(cache=True)
def log_prior(problem: Problem, keep_out: Bytes) -> float:
    """Few marked cells, and those together."""
    beside = problem.layout.beside
    value = 0.0
    for cell in range(len(keep_out)):
        if keep_out[cell]:
            value -= problem.cell_price[cell]
            for action in range(4):
                there = beside[cell, action]
                if there >= 0 and not keep_out[there]:
                    value -= problem.edge_price
    return value


@njit(cache=True)
def prior_change(problem: Problem, keep_out: Bytes, cells: Ints, count: int, marked: Bytes) -> float:
    """By how much flipping `count` cells changes the log prior; `marked` (cells,) is scratch, all zero."""
    beside = problem.layout.beside
    for at in range(count):
        marked[cells[at]] = 1
    value = 0.0
    for at in range(count):
        cell = cells[at]
        value += problem.cell_price[cell] if keep_out[cell] else -problem.cell_price[cell]
        for action in range(4):
            there = beside[cell, action]
            if there >= 0 and not marked[there]:
                value += problem.edge_price if keep_out[there] != keep_out[cell] else -problem.edge_price
    for at in range(count):
        marked[cells[at]] = 0
    return value


@njit(cache=True)
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


@njit(cache=True)
def log_answers(problem: Problem, best: Bytes) -> float:
    """Log likelihood of all answers."""
    answers = problem.answers
    value = 0.0
    for k in range(len(answers.preferred)):
        preferred, avoided = answer_code(best, answers.states, answers.first[k], answers.first[k + 1])
        difference = 0
        for action in range(4):
            difference += ((preferred ^ answers.preferred[k]) >> action) & 1
            difference += ((avoided ^ answers.avoided[k]) >> action) & 1
        value += answers.log_by_difference[difference]
    return value


@njit(cache=True)
def flip(problem: Problem, chain: Chain, journal: Journal, cells: Ints, count: int) -> None:
    """Mark or free `count` cells and bring all that follows up to date; `undo` takes it back."""
    moves, waypoints, price, keep_out = problem.layout.moves, problem.layout.waypoints, chain.price, chain.keep_out
    n = len(price)
    journal.size[:3] = 0
    journal.size[3] += 1
    journal.total_was[:] = chain.total
    for at in range(count):
        cell = cells[at]
        keep_out[cell] ^= 1
        price[cell] = problem.moves.entry_price if keep_out[cell] else 1
    for layer in range(len(waypoints)):
        _repair(moves, price, chain.distance[layer], waypoints[layer], cells, count, layer * n, journal)
    if judge_states(problem, chain, journal, journal.touched, journal.size[2]):
        chain.total[ANSWERS] = log_answers(problem, chain.best)


@njit(cache=True)
def undo(problem: Problem, chain: Chain, journal: Journal, cells: Ints, count: int) -> None:
    """Take the last flip back."""
    n = len(chain.price)
    for at in range(count):
        cell = cells[at]
        chain.keep_out[cell] ^= 1
        chain.price[cell] = problem.moves.entry_price if chain.keep_out[cell] else 1
    for at in range(journal.size[0]):
        state = journal.distance_at[at]
        chain.distance[state // n, state % n] = journal.distance_was[at]
    for at in range(journal.size[1]):
        state = journal.state_at[at]
        chain.best[state], chain.fit[state] = journal.best_was[at], journal.fit_was[at]
    chain.total[:] = journal.total_was


@njit(cache=True)
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


@njit(cache=True)
def queue(moves: Int32s, price: Ints, distance: Ints, cell: int, heap: Ints, size: int) -> int:
    """Put a cell on the heap if its distance is not what the cells beside it say."""
    wanted, now = next_cost(moves, price, distance, cell), distance[cell]
    return push(heap, size, min(wanted, now), cell) if wanted != now else size


@njit(cache=True)
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


@njit(cache=True)
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
