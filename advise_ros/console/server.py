"""The page's server: NiceGUI in a thread of its own."""

from __future__ import annotations

import asyncio
import os
import socket
import threading
from pathlib import Path
from typing import Any

from fastapi import HTTPException, Request
from nicegui import app, background_tasks, ui
from nicegui.server import Server

from advise_ros.config import ConsoleConfig
from advise_ros.console import language
from advise_ros.console.board import newer
from advise_ros.console.listener import GraphListener
from advise_ros.console.port import HOST
from advise_ros.console.protection import Gate, Protection
from advise_ros.console.requests import RequestDispatcher
from advise_ros.console.wording import reply_in

STATIC = Path(__file__).parent / 'static'
# A page that hears nothing for some of these says that it is cut off.
BEAT_S = 1.0
STOP_PATIENCE_S = 3.0
# A browser that is away for longer loads the page anew.
RECONNECT_S = 30.0
# The language that a person chose on the page.
COOKIE = 'advise-language'
# All modules at once, instead of one import after the other.
HEAD = '<link rel="stylesheet" href="/console/console.css">' + ''.join(
    f'<link rel="modulepreload" href="/console/{path.name}">' for path in sorted(STATIC.glob('*.js'))
)
# Browsers load the page's files again when they have changed.
CACHE_S = 0


def texts(code: str) -> dict[str, Any]:
    """The catalogue of a language, for a page that changes to it."""
    if code not in language.languages():
        raise HTTPException(404, f'no language {code!r}; there are {", ".join(language.languages())}')
    return language.catalogue(code)


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


class PageServer:
    """Serves the listener's board to every window, and hands their requests to the dispatcher.

    Attributes:
        failure: why it serves no more, empty while it does.
    """

    def __init__(
        self, listener: GraphListener, dispatcher: RequestDispatcher, gate: Gate, bound: socket.socket, config: ConsoleConfig,
    ) -> None:
        self._listener, self._dispatcher, self._bound = listener, dispatcher, bound
        self._period_s, self._language = 1.0 / config.rate_hz, config.language
        self._pages: set[Page] = set()
        self.failure = ''
        self._thread = threading.Thread(target=self._run, name='page-server', daemon=True)
        app.add_static_files('/console', STATIC, max_cache_age=CACHE_S)
        app.add_middleware(Protection, gate=gate)
        app.on_startup(lambda: background_tasks.create(self._push_for_ever(), name='push'))
        ui.page('/', title='advise', response_timeout=30)(self._open)
        app.get('/console-texts/{code}')(texts)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """Close every connection; returns when the thread has ended, or after some seconds."""
        server = getattr(Server, 'instance', None)
        if server is not None:
            server.should_exit = True
        if self._thread.is_alive():
            self._thread.join(STOP_PATIENCE_S)
        self._bound.close()

    def _run(self) -> None:
        os.environ.pop('PYTEST_CURRENT_TEST', None)  # Whoever tests with this node: NiceGUI would take a port of its own tests.
        try:
            self._serve()
        except (Exception, SystemExit) as problem:  # noqa: BLE001  the thread's end is the page's end, whatever ended it
            self.failure = f'the page cannot be served any more: {type(problem).__name__}: {problem}'

    def _serve(self) -> None:
        # Nothing is compressed: on the same machine that takes longer than it saves.
        ui.run(
            host=HOST, port=self._bound.getsockname()[1], fd=self._bound.fileno(), reload=False, show=False, tailwind=False,
            show_welcome_message=False, dark=None, favicon=STATIC / 'icon.svg', reconnect_timeout=RECONNECT_S,
            binding_refresh_interval=None, gzip_middleware_factory=None, access_log=False, timeout_graceful_shutdown=1,
        )

    def _open(self, request: Request) -> None:
        ui.add_css(':root { color-scheme: light dark }')
        ui.add_head_html(HEAD)
        chosen = request.cookies.get(COOKIE) or self._language
        page = Page(self._listener, self._dispatcher, language.of_browser(request.headers.get('accept-language', ''), chosen))
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
