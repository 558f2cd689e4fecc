"""`fly` as a newcomer runs it: one command from nothing to a learnt, recorded session, and one Ctrl-C."""

from __future__ import annotations

import os
import re
import signal
from pathlib import Path

import pytest

from support.demo_site import SMALL_SITE
from support.graph import Graph
from support.processes import Process, living_in_domain

FILES = dict(zip(SMALL_SITE[::2], SMALL_SITE[1::2], strict=True))
WATCHED = ('--grid', FILES['--grid'], '--wish', FILES['--wish'], '--actors', '--speedup', '20', '--port', '0', '--no-browser')


def fly(graph: Graph, bag: Path, *arguments: str) -> Process:
    return graph.start_fresh('fly', args=('--bag', str(bag), *arguments))


def wait_for(graph: Graph, session: Process, words: str) -> None:
    graph.wait_until(lambda: re.search(words, session.text) or not session.running, timeout_s=300.0)
    assert re.search(words, session.text), session.describe()


@pytest.mark.timeout(900)
def test_flown_answered_ended_and_replayed(graph: Graph, tmp_path: Path) -> None:
    session = fly(graph, tmp_path / 'session', *WATCHED)
    wait_for(graph, session, 'http://.*[?]token=')
    wait_for(graph, session, '[1-9] answers?, ')
    session.signal(signal.SIGINT)
    assert session.wait_exit() == 0, session.describe()
    assert 'killed' not in session.text
    assert f'./advise replay {tmp_path / "session"}' in session.out[-1]
    left = living_in_domain(os.environ['ROS_DOMAIN_ID'])
    assert not left, left
    replay = graph.run('replay', str(tmp_path / 'session'))
    assert replay.popen.returncode == 0, replay.text


@pytest.mark.timeout(600)
def test_a_node_that_dies_is_named_and_everything_ends(graph: Graph, tmp_path: Path) -> None:
    session = fly(graph, tmp_path / 'session', *WATCHED)
    wait_for(graph, session, 'in the air')
    ((number, _),) = [one for one in living_in_domain(os.environ['ROS_DOMAIN_ID']).items() if 'lib/advise_ros/recorder' in one[1]]
    os.kill(number, signal.SIGKILL)
    assert session.wait_exit() == 1
    assert 'recorder was killed by SIGKILL; its last lines' in session.text
    assert 'what is flown teaches nothing any more; everything was ended in order' in session.text
    assert not living_in_domain(os.environ['ROS_DOMAIN_ID'])
