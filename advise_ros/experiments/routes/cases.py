"""A trial: a site, the flights of people over it, and one of them who answers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.people.known_site import Site
from advise_ros.core.people.simulated_expert import SimulatedExpert
from advise_ros.experiments.sites import (
    expert_of,
    flights_of,
    given_up,
    other_route,
    other_wishes,
    pilot_of,
    random_site,
)

# Share of the states in which a pilot makes the same wrong move again and again.
MISTAKES = 0.2


class RouteCase(NamedTuple):
    """Who flies and answers where.

    Attributes:
        size: of SIZES.
        hidden: whether areas that the map does not tell of are to be kept out of.
        pilot: 'errs', 'shy' or 'soft'.
        noise: share of wrong moves.
        errors: share of wrong answers.
        flights: how many.
        given_up: how many of these end half-way, the last ones.
        people: who fly in turn; the second has other wishes, and the first one answers.
        second: whether it is another route over the site that counts, without a flight of its own.
    """

    size: str
    hidden: bool = True
    pilot: str = 'errs'
    noise: float = 0.4
    errors: float = 0.0
    flights: int = 5
    given_up: int = 0
    people: int = 1
    second: bool = False


class RouteTrial(NamedTuple):
    """The same site, flights and person for every way.

    Attributes:
        site: as the person who answers wants it.
        other: the second route; None where there is none that crosses what is hidden.
        rng: of whatever a way draws.
    """

    site: Site
    flights: tuple[Demonstration, ...]
    expert: SimulatedExpert
    other: Site | None
    rng: np.random.Generator
    seed: int


def trial_of(case: RouteCase, seed: int) -> RouteTrial:
    """Every draw of a purpose has a generator of its own, so cases of one seed share what they have in common.

    Raises:
        InputError: no such size or pilot.
    """
    purposes = [np.random.default_rng([seed, purpose]) for purpose in range(5)]
    site = random_site(case.size, purposes[0], hidden=case.hidden)
    flights = flights_of(site, pilot_of(site, case.pilot, case.noise, MISTAKES, purposes[1]), case.flights)
    expert = expert_of(site, case.errors, purposes[1])
    if case.people > 1:
        flights = _in_turn(flights, _flown_by_another(case, site, purposes[3]))
    whole = case.flights - case.given_up
    flights = (*flights[:whole], *(given_up(flight) for flight in flights[whole:]))
    other = other_route(site, purposes[4]) if case.second else None
    return RouteTrial(site, flights, expert, other, purposes[2], seed)


def _flown_by_another(case: RouteCase, site: Site, rng: np.random.Generator) -> tuple[Demonstration, ...]:
    other = other_wishes(site, rng)
    return flights_of(other, pilot_of(other, case.pilot, case.noise, MISTAKES, rng), case.flights)


def _in_turn(ones: tuple[Demonstration, ...], others: tuple[Demonstration, ...]) -> tuple[Demonstration, ...]:
    """The first of one, the second of the other, and so on."""
    return tuple(one if index % 2 == 0 else other for index, (one, other) in enumerate(zip(ones, others, strict=True)))
