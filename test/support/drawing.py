"""The page that draws a grid, as one person has it."""

from __future__ import annotations

import re
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser

from support.browser import PAGE, Person
from support.processes import executable

ADDRESS = re.compile(r'http://127\.0\.0\.1:\d+/\?token=\S+')
SCREEN = f"""([x, y]) => {{
  const {{ grid, board, $refs }} = {PAGE}, box = $refs.canvas.getBoundingClientRect(), at = board.screen([x, y]);
  return [box.left + at[0], box.top + at[1]];
}}"""
END_S = 20.0


@contextmanager
def served(folder: Path, *words: str) -> Iterator[str]:
    """The address of `grid draw`; in the end Ctrl-C ends it, and well."""
    command = [executable('grid'), 'draw', *words, '--port', '0', '--no-browser']
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        try:
            assert process.stdout is not None
            yield next(found[0] for line in process.stdout if (found := ADDRESS.search(line)))
            process.send_signal(signal.SIGINT)
            assert process.wait(END_S) == 0
        finally:
            process.kill()


class Draughtsman(Person):
    """One person who draws."""

    def __init__(self, browser: Browser, address: str, width: int = 1280, height: int = 720, language: str = 'en-GB') -> None:
        super().__init__(browser, address, viewport={'width': width, 'height': height}, language=language)

    def says(self, words: str) -> None:
        """Wait for the sentence on the drawing."""
        self.shows('verdict', words)

    def on_screen(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Where a place of the map is in the window [css px]."""
        x, y = self.page.evaluate(SCREEN, [x_m, y_m])
        return x, y

    def drag(self, *places_m: tuple[float, float]) -> None:
        """By mouse from place to place; one place alone is a click."""
        mouse = self.page.mouse
        mouse.move(*self.on_screen(*places_m[0]))
        mouse.down()
        for place in places_m[1:]:
            mouse.move(*self.on_screen(*place))
        mouse.up()

    def complaints(self) -> list[str]:
        """What axe (WCAG A and AA, best practices) finds on the page as it stands."""
        return [f'{one["id"]}: {one["nodes"][0]["html"]}' for one in Axe().run(self.page).response['violations']]

    def type_into(self, name: str, text: str) -> None:
        self.at(name).fill(text)
        self.at(name).press('Enter')
