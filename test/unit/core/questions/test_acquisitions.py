"""Ways to ask, tried on simulated people."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from advise_ros.commands import experiments
from advise_ros.domains import find
from advise_ros.experiments.acquisitions import GAINS, IDEAL, PAPER, VARIANTS, row, table
from advise_ros.experiments.interview import BUDGET, Interview, interviews, with_errors
from advise_ros.experiments.protocols import protocol_for

RISING = Interview((0.0, 50.0, 100.0, *[100.0] * 8), (0.9, 0.5, 0.01, *[0.0] * 8))
LATE = Interview((*[0.0] * 9, 100.0, 100.0), (0.9, *[0.01] * 10))


@pytest.fixture(scope='module')
def wumpus() -> list[list[Interview]]:
    return [interviews(protocol_for('wumpus'), (IDEAL, PAPER, GAINS), seed) for seed in range(6)]


def test_the_same_trial_gives_the_same_answers_alone_and_among_others(wumpus: list[list[Interview]]) -> None:
    assert interviews(protocol_for('wumpus'), (GAINS,), 0) == wumpus[0][2:]


def test_each_begins_with_the_same_policy_and_ends_without_doubt_when_all_is_asked(wumpus: list[list[Interview]]) -> None:
    for found in wumpus:
        assert len({one.performance[0] for one in found}) == 1
        assert all(len(one.performance) == len(one.doubt) == BUDGET + 1 for one in found)
        assert found[0].doubt[-1] == 0.0


def test_asking_for_the_largest_gain_is_ahead_of_the_papers_over_the_whole_curve(wumpus: list[list[Interview]]) -> None:
    paper, own = (sum(sum(found[which].performance) for found in wumpus) for which in (1, 2))
    assert own > paper


def test_a_wrong_answer_is_asked_for_again_and_right_ones_are_not() -> None:
    right, wrong = protocol_for('wumpus'), with_errors(protocol_for('wumpus'), 1.0)
    assert wrong.expert.error_rate == 1.0
    assert right.expert.error_rate == 0.0
    once = replace(GAINS, confirm=False)
    trials = [interviews(right, (once, GAINS), seed) for seed in range(4)]
    assert all(first.performance == second.performance for first, second in trials)


def test_answers_needed_stopping_and_regret() -> None:
    found = row(find('wumpus'), GAINS, 0.0, [RISING, LATE], 100.0)
    assert found.answers == 9
    assert found.curve[:3] == (0.0, 25.0, 50.0)
    assert (found.best_stop, found.stopped) == (5.5, 1.5)
    assert found.on_time == 0.5
    assert found.regret == 50.0


def test_waits_are_learnt_when_they_are_short() -> None:
    waits = Interview((3.0, 2.0, 1.05, *[1.0] * 8), tuple([0.0] * 11))
    found = row(find('traffic'), GAINS, 0.0, [waits, waits], 1.0)
    assert found.answers == 2
    assert found.best_stop == 3.0
    assert '| traffic | 0% | gain | 2 |' in table([found])


def test_the_command_writes_a_row_a_way_and_kind_of_expert(tmp_path: Path) -> None:
    assert experiments.run(['acquisitions', '--domain', 'wumpus', '--trials', '1', '--seed', '5', '--out', str(tmp_path)]) == 0
    rows = json.loads((tmp_path / 'acquisitions.json').read_text())
    assert [(one['method'], one['error_rate']) for one in rows] == [
        (variant.name, rate) for rate in (0.0, 0.1, 0.2) for variant in VARIANTS
    ]
    assert len((tmp_path / 'acquisitions.md').read_text().splitlines()) == len(rows) + 2
