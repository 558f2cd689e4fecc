"""The person's page against the real nodes: what is asked is seen, answered, previewed, taken back, contradicted."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from advise_msgs.msg import Advice
from support.browser import Person, chromium, start_console
from support.graph import Graph
from support.learner import Learner, write_grid
from support.walks import GRID_4X4

ASKED, CHANGED, CLASH = (253, 231, 181), (201, 239, 224), (184, 51, 15)
FAST = {'learn_when': 'demonstration'}


@pytest.fixture(scope='module')
def browser() -> Iterator[Browser]:
    with chromium() as found:
        yield found


@pytest.fixture
def grid_file(tmp_path: Path) -> str:
    return write_grid(tmp_path, GRID_4X4)


@pytest.fixture
def learner(graph: Graph, grid_file: str) -> Learner:
    """A learner with its first question open."""
    asking = Learner(graph, grid_file)
    asking.demonstrate(0, 1)
    asking.policy(2, 0)
    return asking


def entry(learner: Learner, number: int = -1) -> Advice:
    """An entry of the advice log, once it is there."""
    wanted = max(number, 0)
    learner.graph.wait_until(lambda: len(learner.log) > wanted, what='an entry of the log')
    return learner.log[number]


# -- answering -------------------------------------------------------------------------------
def test_a_newcomer_sees_the_question_and_answers_by_mouse(graph: Graph, learner: Learner, browser: Browser) -> None:
    _, address = start_console(graph)
    anna = Person(browser, address, 'Anna')
    anna.asked(1)
    asked = learner.query_of(learner.policies[-1])
    anna.shows('question', asked.question)
    assert anna.pixels(ASKED) > 500
    anna.click('^EAST')
    anna.shows('sentence', 'You say: EAST is right, WEST is wrong.')
    anna.shows('preview', 'expected success')
    anna.click('Send')
    anna.history('EAST, not WEST', 'Anna', f'{len(asked.states)} cells')
    given = entry(learner, 0)
    assert (list(given.preferred), list(given.avoided), given.expert_id) == ([1], [3], 'Anna')
    assert list(given.states) == list(asked.states)
    anna.asked(2)
    assert not anna.errors
