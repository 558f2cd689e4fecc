"""The question in a terminal of its own (a pseudo-terminal), against the real learner."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import struct
import subprocess
import termios
from collections.abc import Iterator
from pathlib import Path

import pytest
from std_srvs.srv import Trigger

from advise_ros.core.advice import Verdict
from support.graph import Graph
from support.learner import Learner, write_grid
from support.processes import executable
from support.walks import GRID_4X4

ROWS, COLUMNS = 50, 160
PATIENCE_S = 60.0
# A run of tests may have set others for itself.
TERMINAL = {'TERM': 'xterm-256color', 'COLUMNS': str(COLUMNS), 'LINES': str(ROWS)}
RIGHT, SHIFT_LEFT = b'\x1b[C', b'\x1b[1;2D'
ESCAPES = re.compile(r'\x1b\[[0-9;?]*[a-zA-Z]')


class Typist:
    """`ask` in a pseudo-terminal; `screen` is the text that it wrote there since the last look."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._master, self._slave = pty.openpty()
        os.set_blocking(self._master, False)
        fcntl.ioctl(self._slave, termios.TIOCSWINSZ, struct.pack('HHHH', ROWS, COLUMNS, 0, 0))
        self.before = termios.tcgetattr(self._slave)
        self.screen = ''
        self.popen = subprocess.Popen(
            [executable('ask'), '--name', 'Anna'], env={**graph.env, **TERMINAL}, start_new_session=True,
            stdin=self._slave, stdout=self._slave, stderr=self._slave,
        )

    def _read(self) -> None:
        try:
            while chunk := os.read(self._master, 65536):
                self.screen += chunk.decode(errors='replace')
        except BlockingIOError:
            pass

    def sees(self, text: str) -> bool:
        self._read()
        assert self.popen.poll() in (None, 0), self.screen
        return text in ESCAPES.sub('', self.screen)

    def wait_to_see(self, *texts: str) -> None:
        for text in texts:
            self._graph.wait_until(lambda wanted=text: self.sees(wanted), PATIENCE_S, f'{text!r} on the screen')

    def type(self, keys: bytes) -> None:
        self._read()
        self.screen = ''
        os.write(self._master, keys)

    def settings(self) -> list[object]:
        return termios.tcgetattr(self._slave)

    def close(self) -> None:
        if self.popen.poll() is None:
            self.popen.kill()
        self.popen.wait(10)
        os.close(self._master)
        os.close(self._slave)


@pytest.fixture
def learner(graph: Graph, tmp_path: Path) -> Learner:
    asking = Learner(graph, write_grid(tmp_path, GRID_4X4))
    asking.demonstrate(0, 1)
    asking.policy(2, 0)
    return asking


@pytest.fixture
def typist(graph: Graph, learner: Learner) -> Iterator[Typist]:
    person = Typist(graph)
    yield person
    person.close()


def test_a_question_is_answered_by_single_keys(graph: Graph, learner: Learner, typist: Typist) -> None:
    typist.wait_to_see('question 1', 'on the way to waypoint', 'Which direction is right', '#')
    typist.type(b'?')
    typist.wait_to_see('ros2 service call /advise/answer')
    typist.type(RIGHT)
    typist.wait_to_see('You say: EAST right, WEST wrong.', 'cells would change; expected success')
    assert not learner.log, 'a preview commits nothing'
    typist.type(b'K')
    typist.wait_to_see('You say: EAST right, NORTH wrong.')
    typist.type(SHIFT_LEFT)
    typist.wait_to_see('You say: EAST right, NORTH and WEST wrong.')
    typist.type(b'\r')
    typist.wait_to_see('question 2', '1: EAST, not NORTH and WEST, Anna')
    (given,) = learner.log
    assert (list(given.preferred), list(given.avoided), given.expert_id) == ([1], [0, 3], 'Anna')
    typist.type(b'\x7f')
    typist.wait_to_see('(taken back)', 'question 3')
    typist.type(b's')
    typist.wait_to_see('question 4')
    assert learner.log[-1].verdict == Verdict.SKIP
    held: list[Trigger.Request] = []
    graph.in_node_thread(lambda: graph.node.create_service(Trigger, 'policy/stop', lambda ask, reply: held.append(ask) or reply))
    graph.wait_until(lambda: typist.type(b' ') or held, what='hold')
    typist.type(b'q')
    assert typist.popen.wait(20) == 0
    assert typist.settings() == typist.before


def test_without_a_terminal_one_sentence_tells_so(graph: Graph) -> None:
    done = graph.run('ask')
    assert done.popen.returncode == 2
    assert 'standard input is no terminal' in done.err[-1]
