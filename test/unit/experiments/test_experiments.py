"""The harness: trials, where they run, and what becomes of them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from distributed import LocalCluster

from advise_ros.commands import experiments
from advise_ros.core.advice.advice import Preference
from advise_ros.core.irl.program import Evidence, pose
from advise_ros.core.irl.solvers.choose import solve
from advise_ros.core.people.simulated_demonstrator import Demonstrator
from advise_ros.domains import find
from advise_ros.domains.domain import Measure
from advise_ros.experiments import plots, runner, trial
from advise_ros.experiments.clusterings import quality
from advise_ros.experiments.experiment import PAPERS
from advise_ros.experiments.figures import QUALITIES, Row5, perturbed
from advise_ros.experiments.method import METHODS, Method, Protocol
from advise_ros.experiments.optimum import optimum
from advise_ros.experiments.protocols import PROTOCOLS
from advise_ros.experiments.statistics import estimate

SAILING = PROTOCOLS['sailing']
FILES = ('figure5.json', 'figure5.png', 'figure5.svg', 'figure5.md')


# -- trials ------------------------------------------------------------------------------------------
def test_every_domain_of_the_paper_has_a_protocol_and_every_method_runs_in_it() -> None:
    assert tuple(PROTOCOLS) == PAPERS
    for name in ('wumpus', 'sailing', 'drone'):
        protocol = PROTOCOLS[name]
        found = trial.curves(protocol, tuple(METHODS.values()), 3)
        assert list(found) == list(METHODS)
        assert {len(curve) for curve in found.values()} == {len(protocol.points)}
        assert len({curve[0] for curve in found.values()}) == 1
        assert len(set(found['trajectories'])) == 1
        assert found['ideal'][-1] == pytest.approx(100.0)


def test_a_domain_of_ones_own_takes_part(tmp_path: Path) -> None:
    """A ring of five states with a goal; forward is right."""
    here, n = np.arange(5), 5
    forward, back = np.minimum(here + 1, 4), np.where(here == 4, 4, np.maximum(here - 1, 0))
    path = tmp_path / 'ring.npz'
    np.savez(
        path, n_states=n, n_actions=2, gamma=0.9, p_action=np.repeat([0, 1], n), p_from=np.tile(here, 2),
        p_to=np.concatenate([forward, back]), p_prob=np.ones(2 * n), reward=here == 4, goal=here == 4,
    )
    arguments = ['figure5', '--domain', str(path), '--trials', '3', '--method', 'ideal', '--out', str(tmp_path)]
    assert experiments.run(arguments) == 2  # `reward` must be numbers.
    np.savez(
        path, n_states=n, n_actions=2, gamma=0.9, p_action=np.repeat([0, 1], n), p_from=np.tile(here, 2),
        p_to=np.concatenate([forward, back]), p_prob=np.ones(2 * n), reward=1.0 * (here == 4), goal=here == 4,
    )
    assert experiments.run(arguments) == 0
    rows = json.loads((tmp_path / 'figure5.json').read_text())
    assert rows[0]['domain'] == 'ring'
    assert rows[-1]['mean'] == pytest.approx(100.0)


def test_an_expert_who_errs_is_worse_than_one_who_does_not() -> None:
    ideal = (METHODS['ideal'],)
    right = [trial.curves(SAILING, ideal, seed)['ideal'][-1] for seed in range(10)]
    wrong_one = replace(SAILING, expert=replace(SAILING.expert, error_rate=0.5))
    wrong = [trial.curves(wrong_one, ideal, seed)['ideal'][-1] for seed in range(10)]
    assert np.mean(wrong) < np.mean(right) - 10.0


def test_an_expert_who_skips_everything_changes_nothing() -> None:
    silent = replace(SAILING, expert=replace(SAILING.expert, skip_rate=1.0))
    assert len(set(trial.curves(silent, (METHODS['clustered'],), 0)['clustered'])) == 1


@pytest.mark.parametrize('kept', QUALITIES)
def test_perturbed_clusters_keep_the_share_asked_for(kept: float) -> None:
    """What stays is similar, and what was displaced is not as long as it is in the minority."""
    shown = trial.show(SAILING, 1)
    found = quality(shown.domain, shown.clusters(perturbed(kept)))
    assert found >= kept - 0.02
    assert found <= kept + 0.03 or kept < 0.8


def test_the_small_program_has_the_optimum_of_the_whole() -> None:
    """Traffic is large enough for it: as many rows as matter, one answer after the other."""
    junction = find('traffic')
    shown = trial.show(replace(PROTOCOLS['traffic'], demonstrator=Demonstrator(1000, 8)), 1)
    near, advice = None, {}
    for state in (3, 77):
        advice[state] = Preference((0,), tuple((0, worse) for worse in range(1, 16)))
        problem = pose(junction.mdp, Evidence(shown.counts.favourite(), advice), PROTOCOLS['traffic'].terms)
        near = optimum(problem, 'piqp', near)
    assert near is not None
    assert near.objective == pytest.approx(solve(problem, 'piqp').objective, rel=1e-7)


def test_a_method_asks_in_any_of_the_cores_ways() -> None:
    methods = tuple(
        Method(acquisition, acquisition=acquisition, features=0.5, clusters=6)
        for acquisition in ('paper', 'occupancy', 'disagreement', 'gain')
    )
    found = trial.curves(PROTOCOLS['wumpus'], methods, 0)
    assert all(curve[-1] >= curve[0] for curve in found.values())


# -- where they run ----------------------------------------------------------------------------------
def figure5(out: Path, *more: str) -> list[bytes]:
    arguments = ['figure5', '--domain', 'wumpus', 'sailing', '--trials', '3', '--out', str(out), *more]
    assert experiments.run(arguments) == 0
    return [(out / name).read_bytes() for name in FILES]


def test_all_cores_and_a_cluster_give_the_same_bytes(tmp_path: Path) -> None:
    expected = figure5(tmp_path / 'here')
    assert figure5(tmp_path / 'cores', '--jobs', '2') == expected
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True) as cluster:
        assert figure5(tmp_path / 'dask', '--dask', cluster.scheduler_address) == expected


@pytest.mark.parametrize(('address', 'told'), [
    ('nowhere', "error: 'nowhere' is no address of a Dask scheduler; give one like tcp://127.0.0.1:8786\n"),
    ('tcp://127.0.0.1:9', 'error: no Dask scheduler answers at tcp://127.0.0.1:9; start one or check the address\n'),
])
def test_no_cluster_is_told_in_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, address: str, told: str,
) -> None:
    monkeypatch.setattr(runner, 'CONNECT_S', 0.5)
    assert experiments.run(['clusters', '--out', str(tmp_path), '--trials', '1', '--dask', address]) == 2
    assert capsys.readouterr().err == told


# -- statistics and the other figures ----------------------------------------------------------------
def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    rng = np.random.default_rng(0)
    found = [estimate(rng.normal(3.0, 2.0, 20)) for _ in range(2000)]
    assert np.mean([one.low <= 3.0 <= one.high for one in found]) == pytest.approx(0.95, abs=0.015)


def test_figure6_falls_with_the_quality_of_clusters(tmp_path: Path) -> None:
    assert experiments.run(['figure6', '--domain', 'sailing', '--trials', '12', '--out', str(tmp_path)]) == 0
    content = json.loads((tmp_path / 'figure6.json').read_text())
    assert [row['quality'] for row in content['rows']] == list(QUALITIES)
    assert content['rows'][0]['mean'] == pytest.approx(1.0)
    assert content['slopes'][0]['mean'] - content['slopes'][0]['ci95'] > 0.0


def test_figure6_is_about_goals(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert experiments.run(['figure6', '--domain', 'traffic', '--trials', '1', '--out', str(tmp_path)]) == 2
    assert "'traffic' measures mean wait [cars]" in capsys.readouterr().err


def test_a_panel_alone_holds_its_legend_and_shares_their_axis() -> None:
    rows = [Row5('wumpus', name, asked, 50.0, 500.0 * asked, 3) for name in METHODS for asked in (0, 1)]
    with plots.in_style():
        figure = plots.figure5(rows, {'wumpus': Measure.GOAL.value})
    figure.draw_without_rendering()
    legend, whole = figure.legends[0].get_window_extent(), figure.bbox
    assert whole.x0 <= legend.x0 < legend.x1 <= whole.x1
    assert figure.axes[0].get_ylim() == plots.SHARES


def test_cluster_quality_stands_beside_the_papers(tmp_path: Path) -> None:
    assert experiments.run(['clusters', '--trials', '4', '--out', str(tmp_path)]) == 0
    rows = {row['domain']: row for row in json.loads((tmp_path / 'clusters.json').read_text())}
    assert {name: row['paper'] for name, row in rows.items()} == {
        'wumpus': 94.2, 'sailing': 91.3, 'traffic': 69.58, 'drone': None,
    }
    assert all(row['least'] < row['mean'] <= 100.0 for row in rows.values())


def test_protocols_are_values() -> None:
    """Stored results are found again by what the settings hold."""
    assert Protocol('wumpus', Demonstrator(40, 10), clusters=4) == PROTOCOLS['wumpus']
