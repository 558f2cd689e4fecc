"""The command `experiments`: what it writes, and that an interruption changes nothing."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from advise_ros.commands import experiments
from support.processes import executable, living_in_group

METHODS = ['clustered', 'single', 'random', 'trajectories', 'ideal', 'shuffled']


def figure5(out: Path, *more: str) -> list[dict[str, object]]:
    assert experiments.run(['figure5', '--domain', 'wumpus', '--trials', '3', '--out', str(out), *more]) == 0
    return json.loads((out / 'figure5.json').read_text())


def test_figure5_has_a_row_for_each_method_and_number_of_questions(tmp_path: Path) -> None:
    rows = figure5(tmp_path)
    assert [row['method'] for row in rows[::11]] == METHODS
    assert all(set(row) == {'domain', 'method', 'queries', 'mean', 'ci95', 'trials'} for row in rows)
    assert {(row['domain'], row['trials']) for row in rows} == {('wumpus', 3)}
    assert [row['queries'] for row in rows[:11]] == list(range(11))
    assert (tmp_path / 'figure5.png').read_bytes().startswith(b'\x89PNG')
    assert '<svg' in (tmp_path / 'figure5.svg').read_text()
    table = (tmp_path / 'figure5.md').read_text().splitlines()
    assert table[0] == f'| wumpus, 3 trials: questions | {" | ".join(METHODS)} |'
    last = {row['method']: row for row in rows if row['queries'] == 10}
    assert table[-1].split(' | ')[1] == f'{last["clustered"]["mean"]:.4g} ± {last["clustered"]["ci95"]:.2g}'


@pytest.mark.parametrize('cut', [0, 1, 40])
def test_an_interruption_changes_no_result(tmp_path: Path, cut: int) -> None:
    """The file of trials ends where the process died: between trials or within one."""
    figure5(tmp_path)
    files = ('figure5.json', 'figure5.png', 'figure5.svg')
    whole = [(tmp_path / name).read_bytes() for name in files]
    trials = tmp_path / 'trials.jsonl'
    kept = trials.read_text()[: len(trials.read_text()) // 2 + cut]
    trials.write_text(kept)
    figure5(tmp_path)
    assert [(tmp_path / name).read_bytes() for name in files] == whole
    assert trials.read_text().startswith(kept)


def test_a_method_alone_gives_what_it_gives_among_others(tmp_path: Path) -> None:
    rows = figure5(tmp_path / 'all')
    alone = figure5(tmp_path / 'alone', '--method', 'single')
    assert alone == [row for row in rows if row['method'] == 'single']


@pytest.mark.parametrize(('arguments', 'told'), [
    (['figure5', '--domain', 'chess'], "'chess' is unknown"),
    (['figure5', '--domain', 'missing.npz'], 'missing.npz cannot be read'),
    (['figure5', '--domain', 'wumpus', '--out', '/proc/nowhere'], 'cannot be written'),
])
def test_wrong_input_is_told_in_one_sentence(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert experiments.run([*arguments, '--trials', '1']) == 2
    said = capsys.readouterr().err
    assert told in said
    assert 'Traceback' not in said


def chain(path: Path, **changes: object) -> str:
    """Two states, action 0 to the second, which ends the task; 1 stays."""
    process = {
        'n_states': 2, 'n_actions': 2, 'gamma': 0.9, 'p_action': [0, 0, 1, 1], 'p_from': [0, 1, 0, 1], 'p_to': [1, 1, 0, 1],
        'p_prob': np.ones(4), 'reward': [0.0, 1.0],
    }
    path.parent.mkdir(exist_ok=True)
    np.savez(path, **{**process, **changes})  # type: ignore[arg-type]
    return str(path)


def test_all_leaves_out_of_figure6_what_has_no_place_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    without_goal, one_way = chain(tmp_path / 'chain.npz'), chain(tmp_path / 'one_way.npz', goal=[0, 1])
    arguments = ['all', '--domain', without_goal, one_way, '--trials', '1', '--out', str(tmp_path / 'out')]
    assert experiments.run(arguments) == 0
    left = capsys.readouterr().err
    assert "left out: figure 6 is relative to a share of goals reached; domain 'chain' measures mean reward a step" in left
    assert "in domain 'one_way' one action is best in all states" in left
    assert {path.stem for path in (tmp_path / 'out').iterdir()} == {'figure5', 'clusters', 'trials'}


@pytest.mark.parametrize(('command', 'domains', 'told'), [
    ('figure5', ['wumpus', 'chess'], "'chess' is unknown"),
    ('figure5', ['a/chain.npz', 'b/chain.npz'], "would both be 'chain' in the figures"),
    ('figure6', ['a/chain.npz'], "domain 'chain' measures mean reward a step"),
])
def test_what_is_wrong_with_a_domain_is_told_before_the_trials(
    command: str, domains: list[str], told: str, capsys: pytest.CaptureFixture[str], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    for directory in 'ab':
        chain(tmp_path / directory / 'chain.npz')
    assert experiments.run([command, '--domain', *domains]) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


def test_sigterm_ends_it_as_ctrl_c_does_and_its_workers_with_it(tmp_path: Path) -> None:
    arguments = ['figure5', '--domain', 'wumpus', '--trials', '1000', '--jobs', '2', '--out', str(tmp_path)]
    command = [executable('experiments'), *arguments]
    with subprocess.Popen(command, start_new_session=True, stderr=subprocess.PIPE, text=True) as process:
        trials = tmp_path / 'trials.jsonl'
        wait_until(lambda: trials.exists() and trials.stat().st_size)
        assert len(living_in_group(process.pid)) > 2
        process.send_signal(signal.SIGTERM)
        wait_until(lambda: not living_in_group(process.pid))
        _, said = process.communicate()
    assert (process.returncode, said) == (130, 'stopped; the trials that are done are kept, the same command goes on\n')


def wait_until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + 120.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)
