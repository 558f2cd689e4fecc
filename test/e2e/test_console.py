"""The person's page against the real nodes: what is asked is seen, answered, previewed, taken back, contradicted."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from advise_msgs.msg import Advice
from advise_ros.core.advice.advice import Verdict
from support.browser import PHONE, Person, start_console
from support.graph import Graph
from support.learner import Learner, write_grid
from support.walks import GRID_4X4

# Colours of the map, and how many points of them are surely no accident.
ASKED, CHANGED, CLASH, PART = (253, 231, 181), (201, 239, 224), (184, 51, 15), (0, 114, 178)
SOME = 200


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


def entry(learner: Learner, number: int) -> Advice:
    """An entry of the advice log, once it is there."""
    learner.graph.wait_until(lambda: len(learner.log) > number, what=f'entry {number} of the log')
    return learner.log[number]


def test_a_newcomer_answers_by_mouse_and_sees_before_what_it_changes(
    graph: Graph, learner: Learner, browser: Browser,
) -> None:
    _, address = start_console(graph)
    anna = Person(browser, address, 'Anna')
    anna.asked(1)
    asked = learner.query_of(learner.policies[-1])
    anna.shows('question', 'which way in the yellow cells?')
    expect(anna.at('reason').first).to_contain_text(f'{len(asked.states)} cells: column')
    assert anna.pixels(ASKED) > SOME and anna.pixels(CHANGED) == 0
    anna.page.get_by_role('checkbox', name='unsure').check()  # The heat layer lies where the question was lit; its border stays.
    graph.wait_until(lambda: anna.pixels(ASKED) == 0, what='the heat layer')
    anna.press('v')
    graph.wait_until(lambda: anna.pixels(ASKED) > SOME, what='the lit question')
    anna.click('^EAST')
    anna.shows('sentence', 'You say: EAST is right, not WEST.')
    anna.shows('preview', 'waypoints reached')
    assert anna.pixels(CHANGED) > SOME
    assert not learner.log, 'a preview commits nothing'
    assert not anna.nameless()
    anna.click('^Send')
    anna.history('EAST, not WEST', 'Anna', f'{len(asked.states)} cells', 'expected')
    given = entry(learner, 0)
    assert (list(given.preferred), list(given.avoided), given.expert_id) == ([1], [3], 'Anna')
    assert list(given.states) == list(asked.states)
    anna.asked(2)
    assert not anna.errors


def test_the_keyboard_alone_does_everything(graph: Graph, learner: Learner, browser: Browser) -> None:
    _, address = start_console(graph)
    ben = Person(browser, address, 'Ben', PHONE)
    ben.asked(1)
    ben.press('ArrowUp', 'ArrowRight', 'Shift+ArrowLeft')
    ben.shows('sentence', 'You say: NORTH and EAST are right, not WEST.')
    ben.press('Backspace')
    ben.shows('sentence', 'Choose the right direction.')
    ben.press('ArrowUp', 'o')
    ben.shows('sentence', 'NORTH is right, not EAST, SOUTH, and WEST.')
    ben.press('Enter')
    assert list(entry(learner, 0).avoided) == [1, 2, 3]
    ben.asked(2)
    ben.press('t')
    assert entry(learner, 1).retracted
    expect(ben.page.locator('.history li').first).to_contain_text('taken back')
    ben.asked(3)
    ben.press('s')
    assert entry(learner, 2).verdict == Verdict.SKIP
    ben.asked(4)
    ben.press('u')
    assert entry(learner, 3).verdict == Verdict.UNSURE
    ben.asked(5)
    ben.press('m')
    ben.shows('sentence', 'Mark the cells that go another way')
    ben.press('a')
    assert entry(learner, 4).verdict == Verdict.MIXED
    assert not ben.errors


def test_a_split_is_drawn_and_each_part_asked_about(graph: Graph, learner: Learner, browser: Browser) -> None:
    _, address = start_console(graph)
    anna = Person(browser, address)
    anna.asked(1)
    asked = list(learner.query_of(learner.policies[-1]).states)
    anna.press('r', 'm')  # Drawing ends the replay, which would go on to other maps.
    anna.shows('replay', 'Show how it was flown there')
    anna.page.locator('.over.drawing').first.wait_for()
    anna.press('x')
    anna.shows('sentence', f'1 of {len(asked)} cells goes another way')
    drawn = [state for state in asked if state // GRID_4X4.n_cells == asked[0] // GRID_4X4.n_cells][:2]
    anna.draw(drawn[1] % GRID_4X4.n_cells)
    anna.shows('sentence', f'2 of {len(asked)} cells go another way')
    assert anna.pixels(PART) > SOME
    anna.press('Enter')
    given = entry(learner, 0)
    assert (given.verdict, list(given.states)) == (Verdict.SPLIT, drawn)
    anna.asked(2)
    learner.graph.wait_until(lambda: learner.queries[-1].query_id == 2, what='the next query')
    assert set(learner.queries[-1].states) != set(asked)
    assert not anna.errors


def test_a_contradiction_is_shown_with_the_earlier_answer_and_resolved(
    graph: Graph, grid_file: str, browser: Browser,
) -> None:
    by_moves_alone = {'cluster_features': 0.0, 'acquisition': 'paper', 'temperature': 1.0}
    learner = Learner(graph, grid_file, clusters=4, **by_moves_alone)
    learner.demonstrate(0, 1)
    learner.policy(2, 0)
    _, address = start_console(graph)
    anna = Person(browser, address, 'Anna')
    anna.asked(1)
    anna.press('ArrowRight', 'Enter')
    anna.history('EAST, not WEST')
    for number in range(2, 9):  # Flights make new clusters of states that were answered for.
        learner.demonstrate(number)
        asked = learner.query_of(learner.policy(number + 1, 1))
        if asked.query_id and asked.answered_before:
            break
    anna.asked(asked.query_id)
    anna.shows('before', 'answer 1 by Anna, EAST, not WEST')
    anna.press('ArrowLeft')
    anna.shows('clash', 'Answer 1 by Anna: EAST, not WEST')
    assert anna.pixels(CLASH) > SOME
    anna.press('Enter')
    anna.shows('clash', 'Two answers contradict each other')
    anna.click('^Take back answer 1$')
    anna.hides('clash')
    taken_back = entry(learner, 2)
    assert (taken_back.advice_id, taken_back.retracted) == (1, True)
    _, other_address = start_console(graph)
    late = Person(browser, other_address)
    expect(late.page.locator('.history li')).to_have_count(2)
    late.history('WEST, not EAST', 'what it bought is not known')
    assert not anna.errors and not late.errors
