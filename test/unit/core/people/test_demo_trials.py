"""The demo's figures come from whoever answered: the simulated expert, or the person."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from advise_ros.commands import demo
from advise_ros.core.advice.advice import AdviceRecord, Verdict
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.people import trial
from advise_ros.core.people.known_site import Judgement, site_of
from advise_ros.core.people.simulated_expert import SimulatedExpert
from advise_ros.core.people.trial import advised_trial
from advise_ros.core.planning.rollout import shortest_route
from advise_ros.demo import summary, trials
from advise_ros.demo.options import DemoSites, load_sites
from advise_ros.demo.story import DemoFlight, DemoPolicy, DemoSession
from advise_ros.report import page, pictures
from advise_ros.report.pictures import FlownTrack

SEEDS = range(6)
# A small route on which answers count for much; the demo's own is larger, and its learner needs few.
SQUARE = Grid(2.0, 4, 4, (-1.0, -1.0), 3.0, (3, 15, 12, 0))


@pytest.fixture
def grid() -> Grid:
    return SQUARE


@pytest.fixture
def settings() -> trial.TrialSettings:
    return trial.TrialSettings(LearnSettings(acquisition='occupancy'), flights=3, answers=6, max_moves=60)


def answers(grid: Grid, *, right: bool) -> tuple[AdviceRecord, ...]:
    """One answer for each state: what a knowing person says, or the opposite of it."""
    expert = SimulatedExpert(grid, np.random.default_rng(0), 'never_optimal', 0.0, 0.0)
    log = []
    for number, state in enumerate(grid.flown_states() if hasattr(grid, 'flown_states') else range(grid.n_states), start=1):
        preferred, avoided = expert.advice((state,))
        if preferred and avoided:
            said = (preferred, avoided) if right else (avoided, preferred)
            log.append(AdviceRecord(number, number, (state,), *said, Verdict.ANSWER, 'anna'))
    return tuple(log)


def reached(grid: Grid, settings: trial.TrialSettings, log: tuple[AdviceRecord, ...]) -> tuple[int, int]:
    """Trials that reach the end without and with the answers."""
    results = [advised_trial(grid, settings, log, seed) for seed in SEEDS]
    return sum(result.before.success for result in results), sum(result.after.success for result in results)


def test_the_trials_of_a_person_are_as_good_as_the_persons_answers(grid: Grid, settings: trial.TrialSettings) -> None:
    before, with_right = reached(grid, settings, answers(grid, right=True))
    assert before < with_right == len(SEEDS)
    assert reached(grid, settings, answers(grid, right=False)) == (before, 0)


def test_without_answers_a_person_has_changed_nothing(grid: Grid, settings: trial.TrialSettings) -> None:
    result = advised_trial(grid, settings, (), 3)
    assert (result.before, result.answers) == (result.after, 0)


def test_no_simulated_expert_answers_in_the_trials_of_a_person(
    grid: Grid, settings: trial.TrialSettings, monkeypatch: pytest.MonkeyPatch,
) -> None:
    def never(*_: Any, **__: Any) -> None:
        raise AssertionError('the simulated expert was asked')

    log = answers(grid, right=True)
    monkeypatch.setattr(trial, 'SimulatedExpert', never)
    with pytest.raises(AssertionError, match='was asked'):
        trial.run_trial(grid, settings, 0)
    assert advised_trial(grid, settings, log, 0).answers == len(log)


def test_the_demos_trials_know_the_garden_and_the_other_route(tmp_path: Path) -> None:
    options = demo.parse(['--out', str(tmp_path / 'out'), '--flights', '4'])
    settings, sites = trials.trial_settings(options), load_sites(options)
    assert (settings.flights, settings.learn.acquisition, len(settings.keep_out)) == (4, 'site', 12)
    assert sites.other is not None and settings.other == sites.other.grid
    for site in (sites.shown, sites.other):
        assert site.steps > shortest_route(site.grid, site.grid.start_state()), 'every shortest way crosses the garden'


def outcome(*, by_person: bool = False, entered: tuple[int, ...] = ()) -> summary.DemoOutcome:
    """One of a small site with a garden on the planner's way."""
    site = site_of(SQUARE, (1, 2))
    kept, lost = Judgement(True, True, 1.0), Judgement(True, False, 1.0)
    flights = [
        DemoFlight('before', True, (1,), 12, 9.0, ''), DemoFlight('after', True, entered, 16, 9.0, ''),
    ]
    return summary.DemoOutcome(
        DemoSites(site, site), DemoSession(flights=flights), DemoFlight('other', True, (), 16, 9.0, ''), [],
        [trial.TrialResult(seed, 2, 100, (lost, kept), kept) for seed in range(4)], 0, by_person, True, 1.0, Path('bag'),
    )


def test_the_table_says_whose_answers_its_figures_come_from() -> None:
    def labels(*, by_person: bool) -> str:
        return ' '.join(str(cell) for cell in summary.table(outcome(by_person=by_person)).columns[0].cells)

    assert 'your answers' in labels(by_person=True)
    assert 'your answers' not in labels(by_person=False)
    assert 'simulated answers' in labels(by_person=False)
    assert 'simulated' not in labels(by_person=True)


def test_the_table_says_who_entered_the_garden() -> None:
    assert summary.headings(outcome()) == ["planner's route", 'without advice', 'with advice', 'another route']
    by_name = {line.name: line.words for line in summary.lines(outcome())}
    assert by_name['garden'] == ['entered', 'entered', 'kept out', 'kept out']
    assert by_name['moves'] == ['12', '12', '16', '16']
    assert by_name['questions answered'] == ['0', '0', '0', 'none new']
    rates = next(words for name, words in by_name.items() if name.startswith('success'))
    assert [word.split(' (')[0] for word in rates] == ['never', '0 %', '100 %', '100 %']


def test_the_story_holds_if_what_was_learnt_keeps_out_and_the_bag_replays() -> None:
    assert outcome().good
    assert not outcome(entered=(2,)).good
    assert not replace(outcome(), replay_equal=False).good


def test_the_report_shows_the_garden_what_is_believed_and_every_kind_of_flight() -> None:
    ended = outcome(entered=(2,))
    believed = DemoPolicy(np.zeros(SQUARE.n_states, dtype=np.uint8), np.linspace(0.0, 1.0, SQUARE.n_cells))
    line = np.array([[0.0, 0.0], [6.0, 0.0]])
    html = page.render(summary.page_values(replace(
        ended, session=replace(ended.session, learnt=[believed, believed]),
        tracks=[FlownTrack(kind, line, reached=kind != 'before') for kind in pictures.TRACKS],
    )))
    assert html.count('<svg') == 3, 'the site, the policies and the trials'
    for said in ('garden', "planner's route", *(name for *_, name in pictures.TRACKS.values())):
        assert f'>{said}</text>' in html, said
    assert 'garden entered in 1 of its cells' in html and 'equal byte for byte' in html
