"""The page at every size: question, map and answer on one screen; 50 x 50 cells that can be read, moved and zoomed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from advise_msgs import msg
from advise_ros.core.grid.grid import Grid
from advise_ros.ros import convert, qos
from support.browser import PAGE, Person, start_console
from support.graph import Graph
from support.learner import Learner, write_grid
from support.sites import flown_site

SIZES = {'notebook': (1280, 720), 'desktop': (1920, 1080), 'tablet': (820, 1180), 'phone': (390, 844)}
READABLE_PX = 24
LARGE = Grid(2.0, 50, 50, (-1.0, -1.0), 5.0, (49, 2499, 0))
# Where parts lie in the window: left, top, right, bottom [css px]; where the fixed button begins, if it lies below.
BOXES = """(names) => {
  const of = (found) => { const box = found.getBoundingClientRect(); return [box.left, box.top, box.right, box.bottom]; };
  const hold = document.querySelector('.hold').getBoundingClientRect();
  return {
    parts: names.map((name) => of(document.querySelector(name))), width: innerWidth, wide: document.documentElement.scrollWidth,
    end: hold.top > innerHeight / 2 ? hold.top : innerHeight,
  };
}"""
SEEN = f'() => {{ const {{ cell, x, y }} = {PAGE}.$refs.map.basePainter; return [cell, x, y]; }}'


@pytest.fixture
def large(graph: Graph) -> msg.AdviceQuery:
    """A question about 12 cells of a map of 50 x 50, published as a learner does."""
    grid = convert.grid_to_msg(LARGE)
    policy = msg.Policy(version=1, grid=grid, greedy=[1] * LARGE.n_states, probabilities=[0.25] * 4 * LARGE.n_states)
    query = msg.AdviceQuery(query_id=1, policy_version=1, grid=grid, budget_left=-1, question='Which way?')
    query.states = [LARGE.cell(x, y) for y in (30, 31, 32) for x in (20, 21, 22, 23)]
    query.demonstrated = query.policy = [0.25] * 4
    for kind, topic, message in ((msg.Policy, 'advise/policy', policy), (msg.AdviceQuery, 'advise/query', query)):
        graph.publisher(topic, kind, qos.latched(), readers=0).publish(message)
    return query


def fits(person: Person, *names: str) -> None:
    """Nothing is cut off at the right, and these parts are on the screen at once."""
    found: dict[str, Any] = person.page.evaluate(BOXES, list(names))
    assert found['wide'] <= found['width']
    for name, (left, top, right, bottom) in zip(names, found['parts'], strict=True):
        assert left >= 0 and right <= found['width'] + 0.5, name
        assert top >= 0 and bottom <= found['end'] + 0.5, f'{name} ends at {bottom}, the screen at {found["end"]}'


def seen(person: Person) -> tuple[float, float, float]:
    """Size of a cell, and where the map's corner is [css px]."""
    cell, x, y = person.page.evaluate(SEEN)
    return cell, x, y


@pytest.mark.parametrize('language', ['en', 'de'])
def test_question_map_and_answer_are_on_one_screen(graph: Graph, large: msg.AdviceQuery, browser: Browser, language: str) -> None:
    _, address = start_console(graph)
    for size, (width, height) in SIZES.items():
        anna = Person(browser, address, viewport={'width': width, 'height': height}, language=language)
        anna.at('question').wait_for()
        anna.page.locator('.send').wait_for()
        fits(anna, '[data-test=question]', '.stage > .map', '.compass', '.send')
        cell, x, y = seen(anna)
        assert cell >= READABLE_PX, size
        box = anna.page.locator('.stage > .map').bounding_box()
        assert box is not None and box['height'] >= 200
        middle = (x + 22 * cell, y + (50 - 31.5) * cell)
        assert 0 < middle[0] < box['width'] and 0 < middle[1] < box['height'], f'{size}: the map does not show the question'
        assert not anna.errors
        anna.context.close()


def test_two_answers_are_on_one_screen(graph: Graph, tmp_path: Path, browser: Browser) -> None:
    site, flights = flown_site()
    learner = Learner(graph, write_grid(tmp_path, site.grid), acquisition='site', demonstrations_min=len(flights))
    for flight in flights:
        learner.publish(convert.demonstration_to_msg(flight))
    learner.policy(len(flights), 0)
    _, address = start_console(graph)
    for width, height in SIZES.values():
        for language in ('en', 'de'):
            anna = Person(browser, address, viewport={'width': width, 'height': height}, language=language)
            anna.at('option-1').wait_for()
            fits(anna, '[data-test=question]', '.stage > .map', '[data-test=option-0]', '[data-test=option-1]')
            anna.context.close()


def test_the_map_zooms_and_pans_by_buttons_wheel_and_keys(graph: Graph, large: msg.AdviceQuery, browser: Browser) -> None:
    _, address = start_console(graph)
    anna = Person(browser, address)
    anna.page.locator('.send').wait_for()
    followed = seen(anna)
    anna.at('whole').click()
    whole = seen(anna)
    assert whole[0] < followed[0]
    anna.at('to-question').click()
    assert seen(anna) == followed
    anna.press('0')
    assert seen(anna) == whole
    anna.press('+', '+')
    assert seen(anna)[0] == pytest.approx(whole[0] * 1.25**2)
    anna.press('-')
    assert seen(anna)[0] == pytest.approx(whole[0] * 1.25)
    before = seen(anna)
    anna.press('Control+ArrowRight')
    assert seen(anna)[1] < before[1]
    assert anna.page.evaluate(f'() => {PAGE}.preferred.length') == 0, 'moving the map names no direction'
    anna.at('over').first.hover()
    anna.page.mouse.wheel(0, -400)
    anna.page.wait_for_function(f'(before) => {PAGE}.$refs.map.basePainter.cell > before', arg=before[0])
    near = seen(anna)
    anna.page.mouse.down()
    box = anna.page.locator('.stage > .map').bounding_box()
    assert box is not None
    anna.page.mouse.move(box['x'] + box['width'] / 2 + 50, box['y'] + box['height'] / 2 + 30)
    anna.page.mouse.up()
    moved = seen(anna)
    assert moved[1] > near[1] and moved[2] > near[2]
    anna.at('over').first.dblclick()
    assert seen(anna) == whole
    assert not anna.errors
