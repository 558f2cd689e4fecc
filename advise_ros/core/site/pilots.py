"""How people fly who want to keep out of some cells: models of their mistakes, and how likely these make the moves seen.

Two kinds. `Mistaken`: where several moves are right, one of them is this person's habit; he slips now and then; and in a
share of the states he makes the same wrong move most of the time. What a wrong move loses does not matter, so one clumsy
entry into an area says little against it. `Soft`: the more a move loses the seldomer he makes it, exp(-loss / temperature)
(Boltzmann-rational; Ramachandran & Amir 2007). Both let at most a few moves of a state count: a pilot who hovers or circles
does not vote each time.

Logarithms are rounded to multiples of 2**-16, so that sums of them are exact in any order and on any machine.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from advise_ros.core.grid.grid import N_ACTIONS
from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.site.layout import Bytes, Int32s, Layout
from advise_ros.core.site.plan import PARTS, PRICE
from advise_ros.core.site.search import FAR, all_distances, cheapest_sets
from advise_ros.core.site.wishes import KEEP_OUT, Wishes

# Moves of a state that count; more are scaled down to so many.
MOST_MOVES = 10.0
# Right moves that follow one habit, and moves that are the mistake in a state that has one.
HABIT, MISTAKE, SLIP_BESIDE_MISTAKE = 0.9, 0.75, 0.02
# What can't be flown or believed is not impossible: logs stay finite.
HARDLY, NEVER = 1e-4, 1e-9
# The price of entering a cell to keep out of for a `Mistaken` person: he goes round if there is any way round.
AVOID_AT_ALL_COST = 1000
# A loss beyond so many steps counts as this one; one part of a step more stands for a move that can't be made.
MOST_LOSS = 12

SETS = 1 << N_ACTIONS
IN_SET = ((np.arange(SETS)[:, None] >> np.arange(N_ACTIONS)) & 1).astype(np.bool_)

SLIPS, SHARES = (0.02, 0.1, 0.2, 0.3, 0.4), (0.02, 0.05, 0.2, 0.35)
TEMPERATURES = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0)
PRICES = (3, 4, 6, 9, 14, 30)


def rounded(logs: Floats, bits: int = 16) -> Floats:
    """To multiples of 2**-bits."""
    return np.round(logs * 2.0**bits) / 2.0**bits


class Moves(NamedTuple):
    """The moves of all flights.

    Attributes:
        states: (k,) visited states in which a move can be chosen, ascending.
        counts: (k, 4) moves that count, at most MOST_MOVES a state.
        flyable: (k, 4) moves that stay on the map.
    """

    states: Ints
    counts: Floats
    flyable: Bools


def moves_of(layout: Layout, taken: Ints) -> Moves:
    """What counts of the moves (states, 4) that were flown."""
    flyable = (layout.moves >= 0)[np.arange(layout.n_states) % layout.n_cells]
    counts = taken * flyable * (layout.acting > 0)[:, None]
    total = counts.sum(axis=1)
    states = np.flatnonzero(total)
    scale = np.minimum(1.0, MOST_MOVES / total[states])
    return Moves(states, rounded(counts[states] * scale[:, None], 10), flyable[states])


class CompiledMoves(NamedTuple):
    """The likelihood of the moves in the form that compiled loops read.

    Attributes:
        soft: 1: by what moves lose; 0: by which are right.
        row: (states,) line of `table`, and of nothing where it is 0.
        table: (k + 1, 256) log likelihood by 16 * best actions + actions that enter a marked cell.
        pull: (states, 4) counts / temperature.
        total: (states,) counts.
        most_loss: that counts, in the parts of a step in which prices are.
        log_normaliser: by the losses of the four actions, as digits to the base most_loss + 2.
    """

    soft: int
    row: Int32s
    table: Floats
    pull: Floats
    total: Floats
    most_loss: int
    log_normaliser: Floats


@dataclass(frozen=True)
class Mistaken:
    """Who errs whatever it loses.

    Attributes:
        name: of the model.
        shyness: how likely a wrong move into a marked cell is, against another wrong move.
        slip: share of wrong moves in states without a mistake.
        share: of the states with a mistake.
    """

    name: str
    shyness: float
    slip: float = 0.3
    share: float = 0.2

    @property
    def entry_price(self) -> int:
        return 1 + AVOID_AT_ALL_COST

    def compiled(self, layout: Layout, moves: Moves, parts: int) -> CompiledMoves:
        """The table of likelihoods; one row for all states in which the same moves were flown."""
        table = np.zeros((len(moves.states) + 1, SETS * SETS))
        for code in np.unique(_code(moves.flyable)):
            rows = np.flatnonzero(_code(moves.flyable) == code)
            counts, which = np.unique(moves.counts[rows], axis=0, return_inverse=True)
            best, entering = _distinct_situations(int(code))
            logs, weights = self._components(IN_SET[np.full(len(best), code)], IN_SET[best], IN_SET[entering])
            terms = counts @ logs.reshape(-1, N_ACTIONS).T + weights.ravel()
            likelihoods = rounded(logsumexp(terms.reshape(len(counts), *weights.shape), axis=2))
            table[1 + rows] = _spread_over_codes(likelihoods, best, entering)[which.ravel()]
        return _compiled(layout, moves, table=table)

    def fitted(self, layout: Layout, moves: Moves, wishes: Wishes, levels: Bytes) -> Mistaken:
        """The slips and the share of mistakes that make the moves likeliest if this map is the true one; the first of equals."""
        best, entering = _situations(layout, moves, wishes, levels, self.entry_price)
        return max(self._others(), key=lambda other: other._log_likelihood(moves, best, entering))

    def _others(self) -> Iterator[Mistaken]:
        return (replace(self, slip=slip, share=share) for slip, share in product(SLIPS, SHARES))

    def _log_likelihood(self, moves: Moves, best: Bools, entering: Bools) -> float:
        logs, weights = self._components(moves.flyable, best, entering)
        return float(rounded(logsumexp((moves.counts[:, None, :] * logs).sum(axis=2) + weights, axis=1)).sum())

    def _components(self, flyable: Bools, best: Bools, entering: Bools) -> tuple[Floats, Floats]:
        """What this person may be like in m states: log probabilities of the actions (m, 20, 4), log weights (m, 20).

        The 20 are the four habits, without a mistake and with each of four.
        """
        wrong = np.where(flyable & ~best, np.where(entering, self.shyness, 1.0), 0.0) + HARDLY
        wrong[best] = 0.0
        wrong /= np.maximum(wrong.sum(axis=1, keepdims=True), NEVER)
        number = np.maximum(best.sum(axis=1), 1)
        every = np.equal(number, N_ACTIONS)[:, None, None]
        right = best[:, None, :] * ((1.0 - HABIT) / number)[:, None, None] + HABIT * np.eye(N_ACTIONS) * best[:, :, None]
        slipping = np.where(every, right, (1.0 - self.slip) * right + self.slip * wrong[:, None, :])
        beside = (1.0 - MISTAKE - SLIP_BESIDE_MISTAKE) * right + SLIP_BESIDE_MISTAKE * wrong[:, None, :]
        mistaken = beside[:, :, None, :] + MISTAKE * np.eye(N_ACTIONS)
        logs = np.concatenate([slipping[:, :, None, :], mistaken], axis=2) + NEVER
        habits = np.where(best, -np.log(number)[:, None], -np.inf)
        with np.errstate(divide='ignore'):
            kinds = np.concatenate([np.full((len(best), 1), np.log1p(-self.share)), np.log(self.share * wrong * ~best)], axis=1)
        weights = habits[:, :, None] + kinds[:, None, :]
        kinds_of_person = N_ACTIONS * (N_ACTIONS + 1)
        return np.log(logs).reshape(len(best), kinds_of_person, N_ACTIONS), weights.reshape(len(best), kinds_of_person)


@dataclass(frozen=True)
class Soft:
    """Who makes a move the seldomer the more it loses.

    Attributes:
        name: of the model.
        temperature: of the losses, in steps.
        price: what a marked cell is worth to go round, in steps.
    """

    name: str = 'soft'
    temperature: float = 1.5
    price: int = 6

    @property
    def entry_price(self) -> int:
        return 1 + self.price

    def compiled(self, layout: Layout, moves: Moves, parts: int) -> CompiledMoves:
        """Counts and normalisers, where prices are in so many parts of a step."""
        pull, total = np.zeros((layout.n_states, N_ACTIONS)), np.zeros(layout.n_states)
        pull[moves.states] = rounded(moves.counts / (self.temperature * parts))
        total[moves.states] = moves.counts.sum(axis=1)
        most = MOST_LOSS * parts
        normaliser = _log_normaliser(_every_loss(most), self.temperature * parts, most)
        return _compiled(layout, moves, pull=pull, total=total, most_loss=most, log_normaliser=normaliser)

    def fitted(self, layout: Layout, moves: Moves, wishes: Wishes, levels: Bytes) -> Soft:
        """The temperature and price that make the moves likeliest if this map is the true one; the first of equals."""
        best, top, most = self, -np.inf, MOST_LOSS * wishes.parts
        total = moves.counts.sum(axis=1)
        for price in PRICES:
            losses = _losses(layout, moves, wishes, levels, 1 + price)
            weighed = (moves.counts * np.where(losses > most, 0, losses)).sum(axis=1)
            for temperature in TEMPERATURES:
                scale = temperature * wishes.parts
                likelihood = float(-rounded(weighed / scale + total * _log_normaliser(losses, scale, most)).sum())
                if likelihood > top:
                    best, top = replace(self, temperature=temperature, price=price), likelihood
        return best


Pilot = Mistaken | Soft
# Apart, because a person who was once taken for shy makes every cell that he entered look free.
PILOTS: tuple[Pilot, ...] = (Mistaken('shy', 0.1), Mistaken('bold', 1.0), Soft())


def _log_normaliser(losses: Ints, temperature: float, most: int) -> Floats:
    """(m,) log sums of exp(-loss / temperature) over the actions (m, 4) that can be made, those that lose at most `most`."""
    weights = np.append(np.exp(-np.arange(most + 1) / temperature), 0.0)
    return rounded(np.log(np.maximum(weights[losses].sum(axis=1), NEVER)), 20)


def _every_loss(most: int) -> Ints:
    """((most + 2)**4, 4) losses of four actions, the first one counting up first."""
    base = most + 2
    return np.arange(base**N_ACTIONS)[:, None] // base ** np.arange(N_ACTIONS) % base


def _compiled(layout: Layout, moves: Moves, **given: object) -> CompiledMoves:
    row = np.zeros(layout.n_states, dtype=np.int32)
    row[moves.states] = 1 + np.arange(len(moves.states))
    empty = CompiledMoves(
        int('pull' in given), row, np.zeros((1, SETS * SETS)), np.zeros((1, N_ACTIONS)), np.zeros(1), 0, np.zeros(1),
    )
    return empty._replace(**given)  # type: ignore[arg-type]


def _code(actions: Bools) -> Ints:
    """(m,) actions (m, 4) as sums of 1 << action."""
    return actions @ (1 << np.arange(N_ACTIONS))


def _distinct_situations(flyable: int) -> tuple[Ints, Ints]:
    """All that can be, 65 of four actions: (m,) best ones and (m,) wrong ones that enter a marked cell, as sums of 1 << action.

    Which best action enters a marked cell does not matter, nor do moves that can't be made.
    """
    pairs = [
        (best, entering) for best, entering in product(range(1, SETS), range(SETS))
        if best & ~flyable == 0 and entering & ~(flyable & ~best) == 0
    ]
    best, entering = np.array(pairs).T
    return best, entering


def _spread_over_codes(likelihoods: Floats, best: Ints, entering: Ints) -> Floats:
    """(k, 256) likelihoods (k, m) of distinct situations (m,), by 16 * best actions + all actions that enter a marked cell."""
    flyable = int(np.bitwise_or.reduce(best))
    known = {pair: at for at, pair in enumerate(zip(best.tolist(), entering.tolist(), strict=True))}
    table = np.zeros((len(likelihoods), SETS * SETS))
    for right, into in product(np.unique(best).tolist(), range(SETS)):
        table[:, SETS * right + into] = likelihoods[:, known[right, into & flyable & ~right]]
    return table


def _costs(layout: Layout, states: Ints, holding: Bytes, prices: Ints) -> Ints:
    """(k, 4) what each action of k states costs to the next waypoint, by levels (areas, cells) and their prices."""
    price = prices[holding]
    distance = all_distances(layout.moves, price, layout.waypoints)
    layer, there = states // layout.n_cells, layout.moves[states % layout.n_cells]
    area = np.minimum(layer, len(price) - 1)
    return np.where(there >= 0, distance[layer[:, None], there] + price[area[:, None], there], FAR)


def _situations(layout: Layout, moves: Moves, wishes: Wishes, levels: Bytes, entry_price: int) -> tuple[Bools, Bools]:
    """Which actions (k, 4) are best in the visited states, and which enter a cell to keep out of from outside."""
    holding = wishes.levels(layout, levels)
    costs = _costs(layout, moves.states, holding, wishes.prices(entry_price))
    layer, cells = np.divmod(moves.states, layout.n_cells)
    barred, area, there = holding == KEEP_OUT, np.minimum(layer, len(holding) - 1), layout.moves[cells]
    entering = (there >= 0) & barred[area[:, None], there] & ~barred[area, cells][:, None]
    return costs == costs.min(axis=1, keepdims=True), entering


def _losses(layout: Layout, moves: Moves, wishes: Wishes, levels: Bytes, entry_price: int) -> Ints:
    """(k, 4) what each action loses against the best, at most MOST_LOSS; one part of a step more where it can't be made."""
    costs = _costs(layout, moves.states, wishes.levels(layout, levels), wishes.prices(entry_price))
    most = MOST_LOSS * wishes.parts
    return np.where(moves.flyable, np.minimum(costs - costs.min(axis=1, keepdims=True), most), most + 1)


def best_sets(layout: Layout, maps: Floats | Bytes) -> Bytes:
    """(m, states) actions of the ways that a person flies who keeps out if there is any way round, for each of m maps.

    Args:
        layout: the site and the route.
        maps: (m, cells) or (m, layers, cells) weights of the cells: 1 for one to keep out of.
    """
    maps = maps.reshape(len(maps), -1, layout.n_cells)
    steps = np.where(maps >= 1.0, 1.0 + AVOID_AT_ALL_COST, 1.0 + PRICE * maps)
    return cheapest_sets(layout.moves, np.round(PARTS * steps).astype(np.int64), layout.waypoints)
