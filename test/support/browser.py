"""The person's page in a real browser: Debian's Chromium, driven by Playwright."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from playwright.sync_api import Browser, Locator, Page, expect, sync_playwright

from support.graph import Graph
from support.processes import Process

FLAGS = (
    '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking',
    '--disable-component-update', '--disable-sync',
)
PATIENCE_MS = 60_000
DESKTOP, PHONE = {'width': 1440, 'height': 900}, {'width': 390, 'height': 844}


@contextmanager
def chromium() -> Iterator[Browser]:
    """A browser; `make test-console` installs it where that is possible."""
    found = shutil.which('chromium')
    assert found, 'chromium is not installed; run `make chromium`, or as root: apt-get install chromium'
    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=list(FLAGS))
        try:
            yield browser
        finally:
            browser.close()


def start_console(graph: Graph, **params: object) -> tuple[Process, str]:
    """A console on a free port, and the address that it prints."""
    process = graph.start('console', {'port': 0, **params})
    found = graph.wait_until(lambda: re.search(r'http://127\.0\.0\.1:\d+/\?token=\S+', process.text), what='the address')
    return process, found[0]


class Person:
    """One person at the page in a browser of their own."""

    def __init__(self, browser: Browser, address: str, name: str = '', viewport: Any = None, language: str = 'en-GB') -> None:
        self.context = browser.new_context(viewport=viewport or DESKTOP, reduced_motion='reduce', locale=language)
        self.page: Page = self.context.new_page()
        self.page.set_default_timeout(PATIENCE_MS)
        self.errors: list[str] = []
        self.page.on('pageerror', lambda error: self.errors.append(str(error)))
        self.page.goto(address)
        self.shows('connection', 'live')
        if name:
            self.page.get_by_label('Your name').fill(name)
            self.page.get_by_label('Your name').blur()

    def at(self, name: str) -> Locator:
        return self.page.locator(f'[data-test={name}]')

    def shows(self, name: str, words: str) -> None:
        """Wait until a part of the page holds these words."""
        expect(self.at(name)).to_contain_text(words)

    def hides(self, name: str) -> None:
        expect(self.at(name)).to_have_count(0)

    def asked(self, number: int) -> None:
        """Wait until a question is open."""
        self.shows('status', f'question {number}')

    def press(self, *keys: str) -> None:
        for key in keys:
            self.page.keyboard.press(key)

    def click(self, name: str) -> None:
        self.page.get_by_role('button', name=re.compile(name)).first.click()

    def draw(self, cell: int) -> None:
        """Touch a cell of the main map by mouse."""
        canvas = self.page.locator('.stage > .map .over')
        box = canvas.bounding_box()
        assert box is not None
        x, y = self.page.evaluate(f'(cell) => {PAGE}.$refs.map.overPainter.centre(cell)', cell)
        self.page.mouse.move(box['x'] + x, box['y'] + y)
        self.page.mouse.down()
        self.page.mouse.up()

    def late_answer(self, number: int, states: list[int]) -> dict[str, Any]:
        """What the server replies to an answer that a page sends too late."""
        reply: dict[str, Any] = self.page.evaluate(LATE_ANSWER, [number, states])
        return reply

    def hold_until(self, held: Callable[[], bool]) -> None:
        """Press the space bar until it arrives: the service may be new."""
        for _ in range(PATIENCE_MS // 100):
            self.press(' ')
            self.page.wait_for_timeout(100)
            if held():
                return
        raise AssertionError('hold never arrived')

    def rests(self) -> None:
        """Wait until every act so far has its reply."""
        self.page.wait_for_function(RESTS)

    def history(self, *words: str) -> None:
        """Wait until the newest answer holds these words."""
        for word in words:
            expect(self.page.locator('.history li').first).to_contain_text(word)

    def nameless(self) -> list[str]:
        """Controls and pictures that a screen reader has no name for."""
        return re.findall(r'^\s*- (?:button|textbox|checkbox|img|meter)(?: \[.*\])*:?$', self.at_all(), re.MULTILINE)

    def at_all(self) -> str:
        """The page as a screen reader has it."""
        return self.page.locator('.console').aria_snapshot()

    def pixels(self, colour: tuple[int, int, int]) -> int:
        """How many points of the main map have a colour."""
        count: int = self.page.evaluate(COUNT_PIXELS, list(colour))
        return count


# The page's component.
PAGE = 'Object.values(mounted_app.$refs).flat().find((element) => element && element.link)'
RESTS = f'() => !{PAGE}.link.waiting.size'
LATE_ANSWER = f"""async ([query, states]) => {{
  const page = {PAGE};
  return page.link.answer({{ ...page.given(0), query, states, preferred: [0], avoided: [2] }});
}}"""
COUNT_PIXELS = """([r, g, b]) => {
  const canvas = document.querySelector('.stage > .map canvas');
  const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  let count = 0;
  for (let i = 0; i < data.length; i += 4) count += data[i] === r && data[i + 1] === g && data[i + 2] === b;
  return count;
}"""
