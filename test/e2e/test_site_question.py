"""A question about a site answered by one gesture, on the page and in a terminal, against the real learner."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from advise_msgs.msg import AdviceQuery
from advise_ros.ros import convert
from support.browser import PHONE, Person, start_console
from support.graph import Graph
from support.learner import Learner, write_grid
from support.sites import flown_site
from support.typist import Typist

# The border of the cells in dispute, and the two ways.
DISPUTED, KEEP, THROUGH = (163, 31, 0), (91, 47, 176), (133, 84, 0)
SOME = 100


@pytest.fixture
def learner(graph: Graph, tmp_path: Path) -> Learner:
    """A learner with a question about a site open."""
    site, flights = flown_site()
    found = Learner(graph, write_grid(tmp_path, site.grid), acquisition='site', demonstrations_min=len(flights))
    for flight in flights:
        found.publish(convert.demonstration_to_msg(flight))
    found.policy(len(flights), 0)
    return found


def opened(learner: Learner) -> AdviceQuery:
    number = learner.open_query()
    return next(query for query in learner.queries if query.query_id == number)


def test_one_click_answers_what_the_question_decides(graph: Graph, learner: Learner, browser: Browser) -> None:
    asked = opened(learner)
    _, address = start_console(graph)
    anna = Person(browser, address, 'Anna')
    anna.asked(asked.query_id)
    anna.shows('question', asked.question.split('?')[0])
    anna.shows('worth', f'{asked.worth:.1f} steps')
    expect(anna.at('option-0')).to_contain_text(asked.options[0].label.split(': ')[0])
    expect(anna.at('option-1')).to_contain_text('fly through')
    for colour in (DISPUTED, KEEP, THROUGH):
        assert anna.pixels(colour) > SOME, colour
    expect(anna.page.locator('.compass')).to_have_count(0)
    assert not anna.nameless()
    anna.at('option-0').hover()
    anna.shows('preview', 'keep-out cells crossed')
    assert not learner.log, 'a preview commits nothing'
    anna.at('option-0').click()
    graph.wait_until(lambda: learner.log, what='the answer in the log')
    (given,) = learner.log
    assert (list(given.preferred), list(given.avoided)) == (list(asked.options[0].preferred), list(asked.options[0].avoided))
    assert (given.expert_id, given.comment) == ('Anna', asked.options[0].label)
    assert not anna.errors


def test_one_key_on_a_phone_s_page_and_directions_still_there(graph: Graph, learner: Learner, browser: Browser) -> None:
    asked = opened(learner)
    _, address = start_console(graph)
    ben = Person(browser, address, 'Ben', PHONE)
    ben.asked(asked.query_id)
    ben.at('by-directions').click()
    expect(ben.page.locator('.compass')).to_have_count(1)
    ben.press('ArrowUp')
    ben.shows('sentence', 'You say: NORTH is right, not SOUTH.')
    ben.press('Backspace', 'n')
    graph.wait_until(lambda: learner.log, what='the answer in the log')
    assert list(learner.log[0].preferred) == list(asked.options[1].preferred)
    assert not ben.errors


def test_one_key_in_a_terminal_and_one_word_in_a_command(graph: Graph, learner: Learner) -> None:
    asked = opened(learner)
    typist = Typist(graph, 'ask', '--name', 'Anna')
    try:
        typist.wait_to_see(f'question {asked.query_id}', asked.options[0].label, asked.options[1].label)
        typist.type(b'w')
        typist.wait_to_see('expected to save')
        typist.type(b'y')
        graph.wait_until(lambda: learner.log, what='the answer in the log')
        assert list(learner.log[0].preferred) == list(asked.options[0].preferred)
        typist.type(b't')
        graph.wait_until(lambda: len(learner.log) == 2, what='the answer taken back')
    finally:
        typist.close()
    again = opened(learner)
    done = graph.run('answer', '--query', str(again.query_id), '--say', again.options[1].word, '--expert', 'Anna')
    assert done.popen.returncode == 0, done.text
    graph.wait_until(lambda: len(learner.log) == 3, what='the answer in the log')
    assert list(learner.log[2].avoided) == list(again.options[1].avoided)
    wrong = graph.run('answer', '--query', str(again.query_id), '--say', 'on-purpose')
    assert wrong.popen.returncode == 2
    assert 'is not open' in wrong.err[-1]
