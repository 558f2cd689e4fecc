"""What was learnt of a site, for another route over it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from advise_ros.core.advice.state import advice_state
from advise_ros.core.demonstrations.demonstration import Counts, count
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.session import Session
from advise_ros.core.site.belief import CELL_PRICE, SamplerSettings, believe
from advise_ros.core.site.keep import as_prior, evidence_of
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.plan import plan
from advise_ros.core.site.prior import UNKNOWN, KeptAnswer, KeptFlight, KeptRoute, SitePrior
from advise_ros.core.site.within_advise import belief_of
from advise_ros.experiments.sites import Site, flights_of, judge, other_route, pilot_of, random_site

SETTINGS = LearnSettings(acquisition='site')
GRID = Grid(1.0, 4, 4, (0.0, 0.0), 5.0, (3, 15))
FLIGHT = KeptFlight('flight-001', (0, 9), (0, 1), (1, 1))
ANSWER = KeptAnswer((2,), (1,), (3,), 'anna', '')


def learnt(seed: int) -> tuple[Site, Site, SitePrior, np.ndarray]:
    """A site, another route over it, and what five flights on the first say."""
    site = random_site('6x6-4', np.random.default_rng([seed, 0]))
    other = other_route(site, np.random.default_rng([seed, 3]))
    assert other is not None
    session = Session(site.grid, SETTINGS)
    for flight in flights_of(site, pilot_of(site, 'errs', 0.4, 0.2, np.random.default_rng([seed, 1])), 5):
        session.add(flight)
    learned = session.learn()
    assert learned.keep_out is not None
    return site, other, session.kept(learned), learned.keep_out


def test_another_route_over_a_learnt_site_needs_no_flight() -> None:
    successes = 0
    for seed in range(4):
        _, other, known, _ = learnt(seed)
        session = Session(other.grid, SETTINGS, prior=known)
        learned = session.snapshot().run()
        assert learned.n_demonstrations == 0 and session.adopt(learned)
        successes += judge(other, learned.greedy).success
    assert successes == 4


def test_what_is_believed_is_the_same_whether_flights_come_now_or_were_kept() -> None:
    """On the same route, up to what drawing maps leaves to chance."""
    site, _, known, now = learnt(1)
    counts = Counts(np.zeros((site.grid.n_states, 4), dtype=np.int64))
    kept = belief_of(site.grid, counts, advice_state(()), 5, known).keep_out
    assert abs(kept - now).max() < 0.25 and abs(kept - now).mean() < 0.05


def test_probabilities_alone_are_drawn_as_they_were_kept() -> None:
    keep_out = np.zeros(36, dtype=np.int64)
    keep_out[[8, 9, 14, 15]] = 100
    keep_out[[20, 21]] = 50
    keep_out[[30, 35]] = UNKNOWN
    layout = layout_of(Grid(1.0, 6, 6, (0.0, 0.0), 5.0, (5, 0)))
    price = as_prior(layout, keep_out)
    assert price[30] == price[35] == CELL_PRICE
    nothing = np.zeros((layout.n_states, 4), dtype=np.int64)
    drawn = believe(layout, nothing, (), np.random.default_rng(0), SamplerSettings(maps=300), price).keep_out
    assert drawn[[8, 9, 14, 15]].min() > 0.9
    assert 0.25 < drawn[[20, 21]].mean() < 0.75
    assert drawn[[1, 2, 3, 24, 25, 26]].max() < 0.12


def test_flights_of_two_routes_are_evidence_together() -> None:
    """Layers of the earlier route come first, and its waypoints are free on the new one, too."""
    earlier = KeptRoute((12, 6), (FLIGHT,), (ANSWER,))
    evidence = evidence_of(GRID, SitePrior((), (earlier,)))
    assert evidence.layout.waypoints.tolist() == [12, 6, 3, 15] and evidence.layout.n_states == 64 and evidence.earlier == 32
    assert evidence.layout.open_cells[[12, 6, 3, 15]].all()
    assert evidence.taken.sum() == 2 and evidence.taken[0, 1] == evidence.taken[1, 1] == 1
    assert evidence.answers == ((ANSWER[:3]),)
    assert evidence.cell_price is None


def test_an_obstacle_in_an_earlier_waypoint_does_not_stop_it() -> None:
    blocked = replace(GRID, blocked=(6,))
    counts = Counts(np.zeros((GRID.n_states, 4), dtype=np.int64))
    prior = SitePrior((), (KeptRoute((12, 6), (FLIGHT,), ()),))
    belief = belief_of(blocked, counts, advice_state(()), 0, prior)
    assert plan(layout_of(blocked), belief.keep_out).best[0] > 0


def test_what_is_known_already_counts_once() -> None:
    route = KeptRoute((3, 15), (FLIGHT, FLIGHT._replace(demonstration_id='flight-002')), (ANSWER,))
    known = SitePrior((), (route,))
    own = KeptRoute((3, 15), (FLIGHT,), (ANSWER._replace(comment='the same'),))
    assert known.without(own).routes == (KeptRoute((3, 15), route.flights[1:], ()),)
    assert known.with_route(own).routes == (KeptRoute((3, 15), (*route.flights[1:], FLIGHT), own.answers),)
    assert known.with_route(KeptRoute((1,), (), ())) == known
    other = KeptRoute((12,), (FLIGHT._replace(window_ns=(10, 20)),), (ANSWER,))
    assert known.with_route(other).routes == (route, other)


def test_it_says_how_much_it_knows() -> None:
    assert SitePrior().in_words == 'nothing' and not SitePrior()
    assert SitePrior((UNKNOWN, 3), (KeptRoute((1,), (FLIGHT,), ()),)).in_words == (
        'probabilities of 1 of 2 cells, 1 route, 1 flight, 0 answers'
    )


def test_another_acquisition_has_no_use_for_it() -> None:
    with pytest.raises(InputError, match="a site's map is of use with acquisition 'site' only, and it is 'occupancy'"):
        Session(GRID, LearnSettings(acquisition='occupancy'), prior=SitePrior((0,) * 16))


def test_flights_on_the_new_route_add_to_what_was_known() -> None:
    _, other, known, _ = learnt(2)
    session = Session(other.grid, SETTINGS, prior=known)
    flights = flights_of(other, pilot_of(other, 'errs', 0.4, 0.2, np.random.default_rng(9)), 2)
    for flight in flights:
        session.add(flight)
    learned = session.snapshot().run()
    assert judge(other, learned.greedy).success
    kept = session.kept(learned)
    assert [len(route.flights) for route in kept.routes] == [5, 2]
    assert count(other.grid, flights).taken.sum() > 0
