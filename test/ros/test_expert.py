"""The simulated expert and the answer command, each against a running learner."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray

from advise_msgs.msg import LearnerStatus
from advise_ros.core.advice.advice import Verdict
from advise_ros.core.grid.grid import optimal_actions
from support.graph import Graph
from support.learner import Learner, write_grid
from support.walks import GRID_4X4


@pytest.fixture
def grid_file(tmp_path: Path) -> str:
    return write_grid(tmp_path, GRID_4X4)


def test_the_expert_answers_until_nothing_is_left_to_ask(graph: Graph, grid_file: str) -> None:
    expert = graph.start('expert', {'skip_rate': 0.2, 'thinking_time_s': 0.05})  # Before there is anybody to answer.
    learner = Learner(graph, grid_file)
    learner.demonstrate(0, 1, 2)
    learner.status(LearnerStatus.DONE)
    graph.wait_until(lambda: learner.queries and learner.queries[-1].query_id == 0)
    said = [entry for entry in learner.log if entry.verdict == Verdict.ANSWER]
    assert said and len(learner.log) >= len(learner.queries) - 1 - 2  # At most two questions were replaced by demonstrations.
    for entry in said:
        right = {action for state in entry.states for action in optimal_actions(GRID_4X4, state)}
        assert entry.expert_id == 'simulated-expert'
        assert set(entry.preferred) <= right
    graph.wait_until(lambda: sum('-> accepted' in line for line in expert.lines) == len(learner.log))
    assert expert.terminate() == 0


def test_with_error_rate_one_it_is_always_wrong_and_a_restarted_learner_is_answered_too(graph: Graph, grid_file: str) -> None:
    graph.start('expert', {'grid_file': grid_file, 'error_rate': 1.0, 'avoid': 'all_others', 'expert_id': 'bert'})
    first = Learner(graph, grid_file, budget=2)
    first.demonstrate(0)
    first.status(LearnerStatus.DONE)
    graph.wait_until(lambda: len(first.log) >= 2)
    assert {entry.expert_id for entry in first.log} == {'bert'}
    for entry in first.log:
        if len(entry.states) == 1 and entry.verdict == Verdict.ANSWER:
            assert not set(entry.preferred) & set(optimal_actions(GRID_4X4, entry.states[0]))
    first.process.kill()
    second = Learner(graph, grid_file, budget=2)
    second.status(LearnerStatus.DONE)
    graph.wait_until(lambda: len(second.log) >= 2)
    assert [(e.preferred, e.avoided) for e in second.log] == [(e.preferred, e.avoided) for e in first.log]


def test_the_expert_does_not_answer_for_another_grid(graph: Graph, grid_file: str, tmp_path: Path) -> None:
    other = write_grid(tmp_path, replace(GRID_4X4, width=5, waypoints=(4, 19, 15, 0)))
    graph.start('expert', {'grid_file': other})
    learner = Learner(graph, grid_file)
    learner.demonstrate(0)
    graph.wait_for(
        '/diagnostics', DiagnosticArray,
        lambda m: m.status[0].name == '/expert' and 'query 1 cannot be answered: it is about another grid' in m.status[0].message,
    )
    assert learner.log == []


def test_a_person_answers_from_the_terminal(graph: Graph, grid_file: str) -> None:
    learner = Learner(graph, grid_file)
    learner.demonstrate(0, 1)
    learner.policy(2, 0)
    number = str(learner.open_query())
    shown = graph.run('answer')
    assert shown.popen.returncode == 0
    assert f'Query {number}: ' in shown.text and 'No answers so far.' in shown.text
    assert f'./advise answer --query {number} --prefer RIGHT --avoid WRONG' in shown.text
    taken = graph.run('answer', '--query', number, '--prefer', 'north', '--avoid', 'east,S', '--expert', 'anna')
    assert (taken.popen.returncode, taken.out[-1]) == (0, 'accepted as answer 1: noted')
    refused = graph.run('answer', '--query', number, '--skip')
    assert refused.popen.returncode == 1
    assert f'refused: query {number} was answered before' in refused.text
    undone = graph.run('answer', '--undo')
    assert (undone.popen.returncode, undone.out[-1]) == (0, 'done: answer 1 is taken back')
    graph.wait_until(lambda: len(learner.log) == 2)
    assert [(entry.expert_id, entry.retracted) for entry in learner.log] == [('anna', False), ('anna', True)]


def test_without_a_learner_the_answer_command_says_so(graph: Graph) -> None:
    alone = graph.run('answer', '--query', '1', '--skip', '--wait', '0.2')
    assert alone.popen.returncode == 2
    assert any(line.startswith('error: ') and 'is the learner' in line for line in alone.err)
