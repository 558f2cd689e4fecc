"""The page in the browser's language, and in another one that a person chooses."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser, expect

from support.browser import Person, start_console
from support.graph import Graph
from support.learner import Learner, write_grid
from support.walks import GRID_4X4


def test_the_page_speaks_the_browser_s_language_until_another_is_chosen(graph: Graph, tmp_path: Path, browser: Browser) -> None:
    asking = Learner(graph, write_grid(tmp_path, GRID_4X4))
    asking.demonstrate(0, 1)
    asking.policy(2, 0)
    _, address = start_console(graph)
    anna = Person(browser, address, language='de-AT')
    expect(anna.page.locator('html')).to_have_attribute('lang', 'de')
    anna.at('language').select_option('en')
    expect(anna.page.locator('html')).to_have_attribute('lang', 'en')
    anna.page.reload()
    expect(anna.page.locator('html')).to_have_attribute('lang', 'en')
    assert not anna.errors
