"""The demo's figures come from whoever answered: the simulated expert, or the person."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from advise_ros.commands import demo
from advise_ros.core.advice.advice import AdviceRecord, Verdict
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.people import trial
from advise_ros.core.people.simulated_expert import SimulatedExpert
from advise_ros.core.people.trial import advised_trial
from advise_ros.demo import summary, trials
from advise_ros.demo.options import share
from advise_ros.recording.gridfile import load_grid

SEEDS = range(6)


@pytest.fixture
def grid() -> Grid:
    return load_grid(share('grid_demo.yaml'))


@pytest.fixture
def settings(tmp_path: Path) -> trial.TrialSettings:
    return trials.trial_settings(demo.parse(['--expert', 'human', '--out', str(tmp_path / 'out')]))


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
    return sum(result.before for result in results), sum(result.after for result in results)


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


def test_a_person_answers_in_one_session_and_no_other_is_flown(tmp_path: Path) -> None:
    out = ['--out', str(tmp_path / 'out')]
    assert demo.parse(['--expert', 'human', *out]).seeds_flown == 1
    assert demo.parse(out).seeds_flown == 3
    with pytest.raises(InputError, match='--seeds-flown is 3, but a person answers in one session only'):
        demo.parse(['--expert', 'human', '--seeds-flown', '3', *out])


def test_the_table_says_whose_answers_its_figures_come_from() -> None:
    def labels(*, by_person: bool) -> str:
        outcome = summary.DemoOutcome(
            sessions=[], tracks=[], log=(), before=None, after=None, rate_before=summary.rate([False, True]),  # type: ignore[arg-type]
            rate_after=summary.rate([True, True]), answers_mean=6.0, first_trial_seed=0, by_person=by_person,
            replay_equal=True, seconds=1.0, bag=Path('bag'),
        )
        return ' '.join(str(cell) for cell in summary.table(outcome).columns[0].cells)

    assert 'your answers' in labels(by_person=True)
    assert 'your answers' not in labels(by_person=False)
    assert 'simulated answers' in labels(by_person=False)
    assert 'simulated' not in labels(by_person=True).replace('in the simulator', '')
