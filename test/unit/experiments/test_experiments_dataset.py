"""Recorded flights in the experiments: a dataset as a domain of figure 5, and as a problem of `learn`."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from advise_ros.commands import discretise, experiments
from advise_ros.core.errors import InputError
from advise_ros.core.planning.process import mdp_of
from advise_ros.experiments import trial
from advise_ros.experiments.method import METHODS
from advise_ros.experiments.protocols import protocol_for
from advise_ros.experiments.recorded import domain_of
from advise_ros.experiments.work import Task
from advise_ros.recording.dataset import Dataset, load_dataset, save_dataset
from support.paths import ROOT

IDEAL = ('--method', 'ideal')


@pytest.fixture(scope='module')
def flights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The dataset of five real flights around four corners."""
    out = tmp_path_factory.mktemp('recorded') / 'corners'
    bag, grid = ROOT / 'bags' / 'arducopter_five_flights', ROOT / 'config' / 'grid_6x6.yaml'
    assert discretise.run([str(bag), '--grid', str(grid), '--out', str(out)]) == 0
    return out


@pytest.fixture
def own(flights: Path, tmp_path: Path) -> Path:
    """A copy that may be changed."""
    save_dataset(tmp_path / 'corners', load_dataset(flights))
    return tmp_path / 'corners'


def test_flights_take_part_in_figure5(flights: Path, tmp_path: Path) -> None:
    for named in (flights, flights / 'dataset.yaml'):
        arguments = ['figure5', '--domain', str(named), '--trials', '3', '--out', str(tmp_path), *IDEAL]
        assert experiments.run(arguments) == 0
        rows = json.loads((tmp_path / 'figure5.json').read_text())
        assert {row['domain'] for row in rows} == {'corners'}
        assert rows[-1]['mean'] == pytest.approx(100.0)


def test_the_domain_is_the_route_of_the_grid_from_where_flights_began(flights: Path) -> None:
    grid, domain = load_dataset(flights).grid, domain_of(str(flights))
    assert domain.best_performance == pytest.approx(100.0)
    assert np.flatnonzero(domain.start).tolist() == [grid.start_state()]
    assert np.flatnonzero(domain.goal).tolist() == [grid.goal_state]


def test_a_trial_draws_as_many_flights_as_there_are(flights: Path) -> None:
    recorded = load_dataset(flights).demonstrations
    visits = [trial.show(protocol_for(str(flights)), seed).counts.visits for seed in (1, 1, 2)]
    assert np.array_equal(visits[0], visits[1])
    assert not np.array_equal(visits[0], visits[2])
    lengths = [len(one.states) for one in recorded]
    assert len(recorded) * min(lengths) <= visits[0].sum() <= len(recorded) * max(lengths)


def test_other_contents_are_other_trials(own: Path, tmp_path: Path) -> None:
    """A result of the flights of yesterday does not stand for those of today."""
    arguments = ['figure5', '--domain', str(own), '--trials', '1', '--out', str(tmp_path), *IDEAL]
    before = protocol_for(str(own))
    assert experiments.run(arguments) == experiments.run(arguments) == 0
    assert len((tmp_path / 'trials.jsonl').read_text().splitlines()) == 1
    dataset = load_dataset(own)
    save_dataset(own, Dataset(dataset.grid, dataset.demonstrations[:2]))
    os.utime(own / 'dataset.yaml', ns=(0, 0))  # Written within one tick of the clock or not.
    assert experiments.run(arguments) == 0
    assert len((tmp_path / 'trials.jsonl').read_text().splitlines()) == 2
    with pytest.raises(InputError, match='is not what it was'):
        Task('curves', before, (METHODS['ideal'],), 0).perform()


def test_learn_solves_the_problem_that_flights_pose(flights: Path, tmp_path: Path) -> None:
    """The same as the problem file with the grid's moves and all that was flown."""
    dataset = load_dataset(flights)
    process = mdp_of(dataset.grid, 0.0, 0.95)
    rows, targets = process.stacked.nonzero()
    np.savez(
        tmp_path / 'p.npz', n_states=process.n_states, n_actions=4, gamma=0.95, p_action=rows // process.n_states,
        p_from=rows % process.n_states, p_to=targets, p_prob=np.ones(len(rows)),
        demo_state=[state for one in dataset.demonstrations for state in one.states],
        demo_action=[action for one in dataset.demonstrations for action in one.actions],
    )
    of_file, of_flights = tmp_path / 'file.npz', tmp_path / 'flights.npz'
    assert experiments.run(['learn', '--problem', str(tmp_path / 'p.npz'), '--out', str(of_file), '--xi-cap', '0.1']) == 0
    assert experiments.run(['learn', '--dataset', str(flights), '--out', str(of_flights), '--xi-cap', '0.1']) == 0
    with np.load(of_file) as file, np.load(of_flights) as result:
        assert result['status'] == 'optimal'
        assert result['objective'] == pytest.approx(float(file['objective']), rel=1e-9)
        assert result['q'].shape == (process.n_states, 4)
        assert np.array_equal(result['greedy'], file['greedy'])


@pytest.mark.parametrize(('arguments', 'told'), [
    (['figure5', '--domain', '{}', '--trials', '1'], 'dataset.yaml cannot be read'),
    (['learn', '--dataset', '{}'], 'dataset.yaml cannot be read'),
])
def test_a_directory_without_a_dataset_is_told(
    arguments: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:
    filled = [argument.format(tmp_path) for argument in arguments]
    assert experiments.run([*filled, '--out', str(tmp_path / 'out')]) == 2
    assert told in capsys.readouterr().err


def test_a_wrong_option_is_told(flights: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert experiments.run(['learn', '--dataset', str(flights), '--out', str(tmp_path / 'r.npz'), '--reading', 'R9']) == 2
    assert "'reading' is 'R9'" in capsys.readouterr().err


def test_no_flight_is_told(own: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_dataset(own, Dataset(load_dataset(own).grid, ()))
    assert experiments.run(['figure5', '--domain', str(own), '--trials', '1', '--out', str(tmp_path)]) == 2
    assert 'holds no flight' in capsys.readouterr().err
