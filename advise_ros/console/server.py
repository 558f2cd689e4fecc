"""The page's server: what is new goes to every open window, and their requests to the dispatcher."""

from __future__ import annotations

import asyncio
import socket
from pathlib import Path
from typing import Any

from fastapi import Request
from nicegui import app, background_tasks, ui

from advise_ros.config import ConsoleConfig
from advise_ros.console import language
from advise_ros.console.board import newer
from advise_ros.console.draw_page import add_drawing
from advise_ros.console.grid_editor import GridEditor
from advise_ros.console.listener import GraphListener
from advise_ros.console.protection import Gate
from advise_ros.console.requests import RequestDispatcher
from advise_ros.console.serving import PageThread, begin_page
from advise_ros.console.wording import reply_in

# A page that hears nothing for some of these says that it is cut off.
BEAT_S = 1.0


class Page(ui.element, component='static/console.js'):
    """One open browser window."""

    def __init__(self, listener: GraphListener, dispatcher: RequestDispatcher, code: str) -> None:
        super().__init__()
        self._dispatcher = dispatcher
        sections = listener.board.sections
        self._at_start = {name: section.version for name, section in sections.items()}
        self.known = dict(self._at_start)
        self._props['start'] = {name: section.value for name, section in sections.items()} | {'track': listener.track()}
        self._props['window'] = self._window
        self._props['words'] = language.catalogue(code)
        self.on('act', self._on_act)
        self.on('hello', self._on_hello)
        self.on('stick', self._on_stick)

    def _on_hello(self, event: Any) -> None:
        """A line is up: the window may act from the reply on.

        What was sent before the window was drawn may be lost: it gets what is newer than its start, and after a loss everything.
        """
        given = event.args
        if not isinstance(given, dict):
            return
        self.known = {} if given.get('again') else dict(self._at_start)
        self.run_method('welcome', str(given.get('line')))

    def _words(self, given: dict[str, Any]) -> language.Translator:
        """In the language that the page has now."""
        code = given.get('language')
        return language.words(code if code in language.languages() else language.ENGLISH)

    @property
    def _window(self) -> str:
        """Its id, which no window can choose."""
        return str(self.client.id)

    def _on_stick(self, event: Any) -> None:
        if isinstance(event.args, dict):
            self._dispatcher.hand.stick(self._window, event.args)

    async def _on_act(self, event: Any) -> None:
        given = event.args
        if not isinstance(given, dict) or not isinstance(given.get('given'), dict):
            return
        promise = self._dispatcher.act(str(given.get('name')), {**given['given'], 'window': self._window})
        reply = reply_in(self._words(given), await asyncio.wrap_future(promise))
        if not self.is_deleted:
            self.run_method('reply', given.get('id'), reply)


class PageServer(PageThread):
    """Serves the listener's board to every window, and hands their requests to the dispatcher."""

    def __init__(
        self, listener: GraphListener, dispatcher: RequestDispatcher, gate: Gate, bound: socket.socket, config: ConsoleConfig,
    ) -> None:
        super().__init__(gate, bound)
        self._listener, self._dispatcher = listener, dispatcher
        self._period_s, self._language = 1.0 / config.rate_hz, config.language
        self._pages: set[Page] = set()
        app.on_startup(lambda: background_tasks.create(self._push_for_ever(), name='push'))
        ui.page('/', title='advise', response_timeout=30)(self._open)
        # A drawing goes on from this session's grid, and is saved where the session was started.
        add_drawing(GridEditor(Path(config.grid_file) if config.grid_file else None, folder=Path()), '/draw', config.language)

    def _open(self, request: Request) -> None:
        page = Page(self._listener, self._dispatcher, begin_page(request, '', self._language))
        self._pages.add(page)
        ui.context.client.on_delete(lambda: self._pages.discard(page))

    async def _push_for_ever(self) -> None:
        beat_s = 0.0
        while True:
            await asyncio.sleep(self._period_s)
            beat_s += self._period_s
            beat = beat_s >= BEAT_S
            for page in list(self._pages):
                self._push(page, beat)
            beat_s = 0.0 if beat else beat_s

    def _push(self, page: Page, beat: bool) -> None:
        if page.is_deleted:
            self._pages.discard(page)
        elif page.client.has_socket_connection:
            news = newer(self._listener.board.sections, page.known)
            if news or beat:
                page.known.update({name: section.version for name, section in news.items()})
                people = sum(one.client.has_socket_connection for one in self._pages)
                page.run_method('take', {name: section.value for name, section in news.items()}, people)
