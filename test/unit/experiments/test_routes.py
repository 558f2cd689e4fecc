"""Trials on routes, what is compared there, and the page of their tables."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from advise_ros.commands import experiments
from advise_ros.core.numerics import Floats
from advise_ros.core.people.known_site import judge
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.plan import plan
from advise_ros.experiments.routes import maxent
from advise_ros.experiments.routes.cases import RouteCase, trial_of
from advise_ros.experiments.routes.page import filled
from advise_ros.experiments.routes.tables import cells, in_time
from advise_ros.experiments.routes.ways import SECOND_WAYS, WAYS

CASE = RouteCase('6x6-4')


def outcome(curve: list[bool], beyond: tuple[bool, ...] = ()) -> dict[str, object]:
    seconds = [1.0, *[0.5] * (len(curve) - 1)]
    return {'curve': curve, 'planned': curve, 'beyond': list(beyond), 'seconds': seconds, 'mb': 100.0}


def at_once(way: str, case: RouteCase, seed: int) -> bool:
    """Success of a way that asks nothing."""
    (success,) = WAYS[way](trial_of(case, seed)).curve
    return success


# -- trials -------------------------------------------------------------------------------------------
def test_cases_of_one_seed_share_what_they_have_in_common() -> None:
    usual, again, two = trial_of(CASE, 5), trial_of(CASE._replace(given_up=2), 5), trial_of(CASE._replace(people=2), 5)
    assert np.array_equal(usual.site.keep_out, two.site.keep_out)
    assert usual.flights[:3] == again.flights[:3]
    assert [usual.flights[index] == two.flights[index] for index in range(5)] == [True, False, True, False, True]


def test_a_flight_that_is_given_up_ends_half_way() -> None:
    usual, given_up = (trial_of(CASE._replace(given_up=number), 5).flights[-1] for number in (0, 1))
    assert len(given_up.states) == len(usual.states) // 2
    assert given_up.states == usual.states[: len(given_up.states)]
    assert given_up.window_ns[1] == usual.stamps_ns[len(given_up.states)]


def test_another_person_wants_other_cells_kept_out_of() -> None:
    trial = trial_of(CASE._replace(people=2, noise=0.0), 3)
    entered = [
        trial.site.keep_out[[trial.site.grid.cell_of(state) for state in flight.states]].any() for flight in trial.flights
    ]
    assert entered == [False, True, False, True, False]


# -- ways ---------------------------------------------------------------------------------------------
def test_the_planner_flies_what_the_map_says_and_enters_what_it_does_not() -> None:
    plain, hidden = ([at_once('planner', CASE._replace(hidden=one), seed) for seed in range(6)] for one in (False, True))
    assert all(plain)
    assert sum(hidden) <= 1


def test_cloning_copies_a_pilot_who_never_errs_and_not_a_clumsy_one() -> None:
    right, clumsy = ([at_once('cloning', CASE._replace(noise=noise), seed) for seed in range(6)] for noise in (0.0, 0.4))
    assert all(right)
    assert not all(clumsy)


def test_the_learner_is_asked_on_after_its_stop_to_see_whether_that_would_have_helped() -> None:
    found = WAYS['site'](trial_of(CASE, 2))
    assert found.curve[-1]
    assert len(found.planned) == len(found.seconds) == len(found.curve)
    assert len(found.curve) + len(found.beyond) <= 11


def test_what_was_learnt_flies_a_second_route_that_the_planner_flies_wrongly() -> None:
    trial = trial_of(CASE._replace(second=True), 1)
    assert SECOND_WAYS['site'](trial).curve[0]
    assert SECOND_WAYS['planner'](trial_of(CASE._replace(second=True), 1)).curve == [False]


@pytest.fixture
def package(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in for irl-maxent with the two functions that are used of it."""
    def policy(table: Floats, terminal: list[int], reward: Floats, discount: float, eps: float) -> Floats:
        before, value = np.zeros(len(table)), np.full(len(table), -1e9)
        while np.abs(value - before).max() > eps / 1e4:
            q = np.array([reward + discount * table[:, :, action] @ value for action in range(4)]).T
            before, value = value, np.logaddexp.reduce(q, axis=1)
            value[terminal] = 0.0
        return np.exp(q - np.logaddexp.reduce(q, axis=1)[:, None])

    def visits(table: Floats, starts: Floats, terminal: list[int], shares: Floats, eps: float) -> Floats:
        leads = np.einsum('sta,sa->st', table, shares)
        leads[terminal] = 0.0
        return np.linalg.solve(np.eye(len(table)) - leads.T, starts)

    module, parent = ModuleType('irl_maxent.maxent'), ModuleType('irl_maxent')
    module.local_causal_action_probabilities, module.expected_svf_from_policy = policy, visits  # type: ignore[attr-defined]
    parent.maxent = module  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, 'irl_maxent', parent)
    monkeypatch.setitem(sys.modules, 'irl_maxent.maxent', module)
    monkeypatch.setattr(maxent, 'is_missing', lambda: False)


@pytest.mark.usefixtures('package')
def test_maximum_entropy_climbs_along_its_slopes() -> None:
    trial = trial_of(CASE, 4)
    layout = layout_of(trial.site.grid)
    legs, table = maxent._legs(layout, trial.flights), maxent._table(layout)
    costs = np.append(np.random.default_rng(0).uniform(0.1, 1.0, layout.n_cells) * (layout.open_cells == 0), 1.8)
    _, slopes = maxent._loss(layout, table, legs, costs)
    for at in (*np.flatnonzero(layout.open_cells == 0)[:4], layout.n_cells):
        step = np.zeros_like(costs)
        step[at] = 1e-5
        up, down = (maxent._loss(layout, table, legs, costs + sign * step)[0] for sign in (1, -1))
        assert (up - down) / 2e-5 == pytest.approx(slopes[at], rel=1e-3, abs=1e-3)


@pytest.mark.usefixtures('package')
def test_maximum_entropy_charges_more_for_what_a_pilot_who_never_errs_goes_round() -> None:
    trial = trial_of(CASE._replace(noise=0.0, flights=10), 1)
    layout = layout_of(trial.site.grid)
    costs = maxent.fit(layout, trial.flights)
    free = (layout.open_cells == 0) & (trial.site.keep_out == 0)
    assert costs[trial.site.keep_out > 0].mean() > costs[free].mean()


def test_cell_costs_of_nothing_are_the_planner() -> None:
    trial = trial_of(CASE, 0)
    layout = layout_of(trial.site.grid)
    assert np.array_equal(maxent.fly(layout, np.full(layout.n_cells, 2.0)), plan(layout, np.zeros(layout.n_cells)).greedy)
    assert not judge(trial.site, maxent.fly(layout, np.full(layout.n_cells, 2.0))).success


# -- tables and page ----------------------------------------------------------------------------------
@pytest.mark.parametrize(('curve', 'beyond', 'well'), [
    ([True, True], (), True), ([True, True, True], (), False), ([False, False, True], (), True),
    ([False, False], (True,), True), ([False, False], (False, True), False), ([False], (False, False), True),
])
def test_in_time_is_within_one_answer_of_the_best_point(curve: list[bool], beyond: tuple[bool, ...], *, well: bool) -> None:
    assert in_time(outcome(curve, beyond)) is well


def test_a_line_counts_what_asked_less_as_it_ended() -> None:
    found = cells([outcome([False, True]), outcome([True])])
    assert found[:6] == ['2', '50 (9-91)', '100 (34-100)', '100 (34-100)', '100 (34-100)', '100 (34-100)']
    assert found[6:] == ['0.5', '100', '1.00', '0.50', '100']


def test_a_page_keeps_its_text_and_gets_new_tables() -> None:
    page = filled('# Title\n\nBefore.\n', {'hidden': '| old |'}) + '\nAfter.\n'
    renewed = filled(page, {'hidden': '| new |', 'plain': '| more |'})
    assert '| old |' not in renewed
    assert renewed.index('Before.') < renewed.index('| new |') < renewed.index('After.') < renewed.index('| more |')


# -- the command --------------------------------------------------------------------------------------
def routes(out: Path, *more: str) -> int:
    return experiments.run(['routes', '--out', str(out), '--sizes', '6x6-4', '--trials', '2', *more])


def test_the_command_writes_page_and_picture_and_goes_on_where_it_was(tmp_path: Path) -> None:
    tables = ('--tables', 'hidden', 'second', '--ways', 'planner', 'cloning')
    assert routes(tmp_path, *tables) == 0
    page, trials = (tmp_path / 'routes.md').read_text(), (tmp_path / 'trials.jsonl').read_text()
    assert page.count('| 6x6-4 | planner | 2 |') == 2
    assert page.count('| 6x6-4 | cloning | 2 |') == 1
    assert 'Seeds 700000 to 700001.' in page
    assert '<svg' in (tmp_path / 'routes.svg').read_text()
    assert routes(tmp_path, *tables) == 0
    assert (tmp_path / 'trials.jsonl').read_text() == trials
    assert (tmp_path / 'routes.md').read_text() == page


def test_without_its_package_a_way_is_left_out_and_refused_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(maxent, 'is_missing', lambda: True)
    assert routes(tmp_path, '--tables', 'hidden', '--ways', 'planner', 'maxent') == 2
    assert 'requirements/rivals.txt' in capsys.readouterr().err
    assert routes(tmp_path, '--tables', 'recordings', '--recordings', str(tmp_path / 'none')) == 2
    said = capsys.readouterr().err
    assert "left out: way 'maxent' needs the package irl-maxent" in said
    assert 'none is no directory of recordings' in said
