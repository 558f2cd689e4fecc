"""Flights of two people with other wishes are told from those of one person."""

from __future__ import annotations

import numpy as np

from advise_ros.core.demonstrations.demonstration import count
from advise_ros.core.site.agreement import TwoPeople, two_people
from advise_ros.core.site.belief import believe
from advise_ros.core.site.layout import layout_of
from advise_ros.experiments.routes.cases import RouteCase, trial_of


def divided(case: RouteCase, seed: int) -> TwoPeople | None:
    trial = trial_of(case, seed)
    layout, rng = layout_of(trial.site.grid), np.random.default_rng([seed, 9])
    taken = [count(trial.site.grid, [flight]).taken for flight in trial.flights]
    return two_people(layout, taken, believe(layout, np.sum(taken, axis=0), (), rng), rng)


def test_two_people_are_named_and_one_is_not() -> None:
    found = divided(RouteCase('6x6-4', people=2), 41_502)
    assert found is not None
    assert found.flights == (1, 3)
    said = found.sentence(layout_of(trial_of(RouteCase('6x6-4'), 41_502).site.grid), ['1', '2', '3', '4', '5'])
    assert said.startswith('flights 2 and 4 look like those of somebody with other wishes: (')
    assert divided(RouteCase('6x6-4'), 41_502) is None


def test_two_who_never_err_are_told_apart_and_one_who_never_errs_is_one() -> None:
    assert divided(RouteCase('6x6-4', noise=0.0, people=2), 41_501) is not None
    assert divided(RouteCase('6x6-4', noise=0.0), 41_501) is None


def test_few_flights_are_not_divided() -> None:
    assert divided(RouteCase('6x6-4', people=2, flights=3), 41_502) is None
