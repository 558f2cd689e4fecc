"""`experiments learn`: equation (1) on any problem, against the program as written down, by another solver."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cvxpy as cp
import numpy as np
import pytest

from advise_ros.commands import experiments

N, A = 6, 3


def random_problem(seed: int) -> dict[str, Any]:
    """A process in which two actions of one state have the same outcome, repeated and contradictory advice."""
    rng = np.random.default_rng(seed)
    table = rng.dirichlet(np.full(N, 0.5), size=(A, N))
    table[1, 2] = table[0, 2]
    action, here, there = np.nonzero(table)
    preferred = np.array([[1, 0, 0], [0, 1, 0], [0, 1, 1]], dtype=bool)
    return {
        'n_states': N, 'n_actions': A, 'gamma': 0.9, 'p_action': action, 'p_from': here, 'p_to': there,
        'p_prob': table[action, here, there], 'demo_state': rng.integers(0, N - 1, 12), 'demo_action': rng.integers(0, A, 12),
        'advice_state': np.array([2, 4, int(rng.choice([2, 4]))]), 'advice_preferred': preferred, 'advice_avoided': ~preferred,
    }


def written_out(problem: dict[str, Any], cap: float = 0.2) -> float:
    """The objective of the default reading, row by row as it is documented, by Clarabel."""
    table = np.zeros((A, N, N))
    np.add.at(table, (problem['p_action'], problem['p_from'], problem['p_to']), problem['p_prob'])
    taken = np.zeros((N, A))
    np.add.at(taken, (problem['demo_state'], problem['demo_action']), 1)
    advised = sorted(set(problem['advice_state'].tolist()))
    v, r, xi, zeta, eta = cp.Variable(N), cp.Variable(N), cp.Variable(N), cp.Variable(N), cp.Variable(N)
    limits: list[Any] = [cp.abs(r) <= 1.0, xi <= cap, zeta >= 0, zeta <= cap, eta >= 0]
    mixed, demonstrated = np.zeros((N, N)), []
    for state in range(N):
        rows = problem['advice_state'] == state
        if rows.any():
            liked = problem['advice_preferred'][rows].any(axis=0)
            mixed[state] = table[liked, state].mean(axis=0)
            for better, worse in zip(problem['advice_preferred'][rows], problem['advice_avoided'][rows], strict=True):
                limits += [
                    (table[a, state] - table[b, state]) @ v >= zeta[state] + 0.1 - eta[state]
                    for a in np.flatnonzero(better) for b in np.flatnonzero(worse)
                ]
        elif taken[state].any():
            best = taken[state].argmax()
            mixed[state] = table[best, state]
            limits += [(table[best, state] - table[b, state]) @ v >= xi[state] for b in range(A) if b != best]
            demonstrated.append(state)
        else:
            mixed[state] = table[:, state].mean(axis=0)
    limits.append(v == r + 0.9 * mixed @ v)
    gain = 1000 * cp.sum(xi[demonstrated]) + 500 * cp.sum(zeta[advised]) - 1000 * cp.sum(eta[advised])
    program = cp.Problem(cp.Maximize(gain - cp.norm1(r)), limits)
    return float(program.solve(solver=cp.CLARABEL))


def learn(tmp_path: Path, problem: dict[str, Any], *options: str) -> dict[str, np.ndarray[Any, Any]]:
    np.savez(tmp_path / 'p.npz', **problem)
    assert experiments.run(['learn', '--problem', str(tmp_path / 'p.npz'), '--out', str(tmp_path / 'r.npz'), *options]) == 0
    with np.load(tmp_path / 'r.npz', allow_pickle=False) as result:
        return dict(result)


@pytest.mark.parametrize('seed', range(8))
def test_it_solves_the_program_as_written_out(tmp_path: Path, seed: int) -> None:
    problem = random_problem(seed)
    result = learn(tmp_path, problem)
    assert result['objective'] == pytest.approx(written_out(problem), rel=1e-6)
    assert str(result['status']) == 'optimal'
    spent = 1000 * result['xi'].sum() + 500 * result['zeta'].sum() - 1000 * result['slack'].sum() - np.abs(result['reward']).sum()
    assert spent == pytest.approx(float(result['objective']), rel=1e-6)


def test_value_q_and_policy_are_those_of_the_reward(tmp_path: Path) -> None:
    problem = random_problem(0)
    result = learn(tmp_path, problem)
    table = np.zeros((A, N, N))
    np.add.at(table, (problem['p_action'], problem['p_from'], problem['p_to']), problem['p_prob'])
    assert result['q'] == pytest.approx(result['reward'][:, None] + 0.9 * (table @ result['value']).T)
    assert result['value'] == pytest.approx(result['q'].max(axis=1))
    weights = np.exp(result['q'])
    assert result['policy'] == pytest.approx(weights / weights.sum(axis=1, keepdims=True))


def test_options_stand_in_the_file_or_beside_it(tmp_path: Path) -> None:
    problem = random_problem(1)
    inside = learn(tmp_path, {**problem, 'xi_cap': 0.05, 'reading': 'R3'})
    beside = learn(tmp_path, {**problem, 'xi_cap': 0.5}, '--xi-cap', '0.05')
    assert inside['objective'] == beside['objective'] == pytest.approx(written_out(problem, 0.05), rel=1e-6)


def test_strict_advice_that_contradicts_itself_is_a_no(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    both = np.array([[1, 0, 0], [0, 1, 0]], dtype=bool)
    problem = {**random_problem(0), 'advice_state': [3, 3], 'advice_preferred': both, 'advice_avoided': both[::-1]}
    np.savez(tmp_path / 'p.npz', **problem)
    arguments = ['learn', '--problem', str(tmp_path / 'p.npz'), '--out', str(tmp_path / 'r.npz'), '--reading', 'R1']
    assert experiments.run(arguments) == 1
    with np.load(tmp_path / 'r.npz') as result:
        assert (str(result['status']), result['contradictory'].tolist()) == ('infeasible', [0, 1])
    said = capsys.readouterr()
    assert 'infeasible' in said.out
    assert said.err == 'rows 0, 1 of the advice cannot all hold (rows count from 0); drop one, or set slack_cost above 0\n'


def test_elastic_advice_names_the_rows_that_cannot_hold_and_no_others(tmp_path: Path) -> None:
    """Row 1 compares two actions with the same outcome; rows 2 and 3 oppose each other."""
    preferred = np.array([[1, 0, 0], [1, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=bool)
    avoided = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0]], dtype=bool)
    advice = {'advice_state': [1, 2, 4, 4], 'advice_preferred': preferred, 'advice_avoided': avoided}
    result = learn(tmp_path, {**random_problem(0), **advice})
    assert result['contradictory'].tolist() == [1, 2, 3]
    assert (result['slack'] > 1e-3).nonzero()[0].tolist() == [2, 4]
    harmless = {name: value[:1] for name, value in advice.items()}
    assert not learn(tmp_path, {**random_problem(0), **harmless})['contradictory'].size


@pytest.mark.parametrize(('changes', 'told'), [
    ({'demo_action': None}, "'demo_action' is missing"),
    ({'demo_action': np.full(12, 3)}, "'demo_action' holds 3; allowed is 0 to 2"),
    ({'demo_state': np.zeros(11, dtype=int)}, "'demo_action' has 12 entries and 'demo_state' has 11"),
    ({'demo_state': np.zeros(12)}, "'demo_state' holds float64"),
    ({'advice_avoided': None}, "'advice_avoided' is missing"),
    ({'advice_preferred': np.zeros((3, 3), dtype=bool)}, "'advice_preferred' names no action in row 0"),
    ({'advice_avoided': np.ones((3, 3), dtype=bool)}, "'advice_avoided' names an action in row 0 that is preferred"),
    ({'advice_avoided': np.ones((3, 4), dtype=bool)}, "'advice_avoided' has shape (3, 4)"),
    ({'reading': 'R7'}, "'reading' is 'R7'"),
    ({'lambda_t': -1.0}, "'lambda_t' is -1"),
    ({'n_states': 6.5}, "'n_states' holds float64"),
    ({'xi_caps': 0.1}, "'xi_caps' is unknown"),
    ({'demo_state': np.full(12, 2**63, dtype=np.uint64)}, "'demo_state' holds 9223372036854775808"),
    ({'xi_cap': 0.0, 'slack_cost': 50.0}, "'slack_cost' leaves no optimum: slack_cost 50 is less than lambda_a 500"),
])
def test_a_malformed_file_names_the_field(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], changes: dict[str, Any], told: str,
) -> None:
    problem = {name: value for name, value in {**random_problem(0), **changes}.items() if value is not None}
    np.savez(tmp_path / 'p.npz', **problem)
    assert experiments.run(['learn', '--problem', str(tmp_path / 'p.npz'), '--out', str(tmp_path / 'r.npz')]) == 2
    said = capsys.readouterr().err
    assert told in said
    assert not (tmp_path / 'r.npz').exists()
