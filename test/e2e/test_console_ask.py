"""The question in a terminal of its own (a pseudo-terminal), against the real learner."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from std_srvs.srv import Trigger

from advise_ros.core.advice.advice import Verdict
from support.graph import Graph
from support.learner import Learner, write_grid
from support.typist import Typist
from support.walks import GRID_4X4

RIGHT, SHIFT_LEFT = b'\x1b[C', b'\x1b[1;2D'


@pytest.fixture
def learner(graph: Graph, tmp_path: Path) -> Learner:
    asking = Learner(graph, write_grid(tmp_path, GRID_4X4))
    asking.demonstrate(0, 1)
    asking.policy(2, 0)
    return asking


@pytest.fixture
def typist(graph: Graph, learner: Learner) -> Iterator[Typist]:
    person = Typist(graph, 'ask', '--name', 'Anna')
    yield person
    person.close()


def test_a_question_is_answered_by_single_keys(graph: Graph, learner: Learner, typist: Typist) -> None:
    typist.wait_to_see('question 1', 'Flying to waypoint', 'Choose the right direction', '#')
    typist.type(b'?')
    typist.wait_to_see('take off', 'ros2 service call /advise/answer', 'RIGHT')
    typist.type(b'?')
    typist.type(RIGHT)
    typist.wait_to_see('You say: EAST right, WEST wrong.', 'waypoints reached', 'would change')
    assert not learner.log, 'a preview commits nothing'
    typist.type(b'K')
    typist.wait_to_see('You say: EAST right, NORTH wrong.')
    typist.type(SHIFT_LEFT)
    typist.wait_to_see('You say: EAST right, NORTH, WEST wrong.')
    typist.type(b'\r')
    typist.wait_to_see('question 2', '1: EAST, not NORTH, WEST, Anna')
    graph.wait_until(lambda: learner.log, what='the answer in the log')
    (given,) = learner.log
    assert (list(given.preferred), list(given.avoided), given.expert_id) == ([1], [0, 3], 'Anna')
    typist.type(b't')
    typist.wait_to_see('(taken back)', 'question 3')
    typist.type(b'm')
    typist.wait_to_see('Mark the cells that go another way')
    typist.type(b'x')
    typist.wait_to_see('You say: 1 of')
    typist.type(b'\r')
    typist.wait_to_see('question 4')
    graph.wait_until(lambda: len(learner.log) == 3, what='the split in the log')
    assert learner.log[-1].verdict == Verdict.SPLIT and len(learner.log[-1].states) == 1
    held: list[Trigger.Request] = []
    graph.in_node_thread(lambda: graph.node.create_service(Trigger, 'policy/stop', lambda ask, reply: held.append(ask) or reply))
    graph.wait_until(lambda: typist.type(b' ') or held, what='hold')
    typist.type(b'q')
    assert typist.ends() == 0
    assert typist.settings() == typist.before


def test_without_a_terminal_one_sentence_tells_so(graph: Graph) -> None:
    done = graph.run('ask')
    assert done.popen.returncode == 2
    assert 'standard input is no terminal' in done.err[-1]
