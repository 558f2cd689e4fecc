"""Whether the flights are those of one person: two people who want different cells kept out of are named, not averaged.

One map explains all flights, or one map a group of them does. The groups come from the maps that are believed anyway: flights
that the same maps explain well belong together. Each group's own best map must be so much likelier than the best common one
that chance in the flights of one person does not do it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.site.belief import CELL_PRICE, SamplerSettings, SiteBelief, problem_of
from advise_ros.core.site.chain import MOVES, Problem, log_prior, new_chain
from advise_ros.core.site.layout import Bytes, Layout
from advise_ros.core.site.pilots import Pilot, moves_of
from advise_ros.core.site.plan import barred
from advise_ros.core.site.tempering import TEMPERATURES, draw
from advise_ros.core.site.wording import listed

# Two maps have to be likelier than one by so much [nat]: 20 to 1.
CLEARLY = 3.0
# Fewer flights can't be told apart.
FEWEST_FLIGHTS = 4
# How often the flights are grouped anew by the maps of the groups.
REGROUPED = 2


class TwoPeople(NamedTuple):
    """Flights that different maps explain.

    Attributes:
        flights: places of those in the smaller group, ascending.
        nats: log odds for two maps against one.
        theirs, others: cells that only the smaller group keeps out of, and only the rest.
    """

    flights: tuple[int, ...]
    nats: float
    theirs: tuple[int, ...]
    others: tuple[int, ...]

    def sentence(self, layout: Layout, names: Sequence[str]) -> str:
        """What the person who learns from the flights should read.

        Args:
            layout: of the flights.
            names: of all flights.
        """
        named, verb = listed([names[flight] for flight in self.flights]), 'look' if len(self.flights) > 1 else 'looks'
        places = [_places(layout, cells) for cells in (self.theirs, self.others)]
        return (
            f'flight{"s" * (len(self.flights) > 1)} {named} {verb} like those of somebody with other wishes: '
            f'{places[0]} kept out of there, {places[1]} in the others; take one of the two back, or answer for both'
        )


def two_people(
    layout: Layout, flights: Sequence[Ints], belief: SiteBelief, rng: np.random.Generator,
    settings: SamplerSettings | None = None,
) -> TwoPeople | None:
    """The best division of the flights in two, if two maps explain them clearly better than one; else None.

    Args:
        layout: the site and the route.
        flights: (states, 4) moves of each.
        belief: what all of them and the answers say.
        rng: of every random choice.
        settings: how long the groups' maps are searched.
    """
    if len(flights) < FEWEST_FLIGHTS:
        return None
    grouping = _Grouping(layout, tuple(flights), belief.pilots[0].pilot, settings or SamplerSettings(), rng)
    believed = np.unique(barred(np.concatenate([belief.maps, belief.doubting])).astype(np.uint8), axis=0)
    each = [grouping.problem([flight]) for flight in range(len(flights))]
    group = _apart(_levels(each, believed))
    for _ in range(REGROUPED):
        if group.all() or not group.any():
            return None
        pair = np.array([grouping.likeliest(np.flatnonzero(side)) for side in (group, ~group)])
        levels = _levels(each, pair)
        before, group = group, levels[:, 0] > levels[:, 1]
        if np.array_equal(before, group):
            return grouping.judged(group, pair, believed)
    return None


class _Grouping(NamedTuple):
    """Flights that are divided."""

    layout: Layout
    flights: tuple[Ints, ...]
    pilot: Pilot
    settings: SamplerSettings
    rng: np.random.Generator

    def problem(self, group: Sequence[int] | Ints) -> Problem:
        """What maps are judged by if only these flights are looked at."""
        taken = np.sum([self.flights[flight] for flight in group], axis=0)
        return problem_of(self.layout, moves_of(self.layout, taken), self.pilot, (), np.full(self.layout.n_cells, CELL_PRICE))

    def likeliest(self, group: Ints) -> Bytes:
        """(cells,) the map that explains these flights best."""
        starts = np.zeros((len(TEMPERATURES), self.layout.n_cells), dtype=np.uint8)
        return draw(self.problem(group), starts, self.settings.steps(self.layout), 1, self.rng, fresh=True).best

    def judged(self, group: Bools, pair: Bytes, believed: Bytes) -> TwoPeople | None:
        """Two maps against the best common one of many."""
        maps = np.concatenate([pair, pair.max(axis=0)[None], pair.min(axis=0)[None], believed])
        problems = [self.problem(np.flatnonzero(side)) for side in (group, ~group)]
        levels, prior = _levels(problems, maps), _priors(problems[0], maps)
        apart = levels[0, 0] + levels[1, 1] + prior[0] + prior[1]
        nats = float(apart - (levels.sum(axis=0) + prior).max() - len(group) * np.log(2.0))
        if nats < CLEARLY:
            return None
        first, second = (np.flatnonzero(one > other).tolist() for one, other in (pair, pair[::-1]))
        smaller = group.sum() * 2 <= len(group)
        members = np.flatnonzero(group if smaller else ~group).tolist()
        theirs, others = (first, second) if smaller else (second, first)
        return TwoPeople(tuple(members), nats, tuple(theirs), tuple(others))


def _places(layout: Layout, cells: Sequence[int]) -> str:
    named = [f'({cell % layout.width}, {cell // layout.width})' for cell in cells]
    return f'{listed(named)} {"are" if len(named) > 1 else "is"}' if named else 'nothing is'


def _levels(problems: Sequence[Problem], maps: Bytes) -> Floats:
    """(problems, maps) log likelihood of the moves of each problem under each map."""
    return np.array([[new_chain(problem, one).total[MOVES] for one in maps] for problem in problems])


def _priors(problem: Problem, maps: Bytes) -> Floats:
    return np.array([log_prior(problem, one) for one in maps])


def _apart(levels: Floats) -> Bools:
    """(flights,) the two groups that the maps (flights, maps) tell apart best: signs of the first principal component."""
    centred = levels - levels.mean(axis=0) - levels.mean(axis=1, keepdims=True) + levels.mean()
    apart: Bools = np.linalg.svd(centred, full_matrices=False)[0][:, 0] > 0.0
    return apart
