"""Serves pages to browsers on this machine: NiceGUI in a thread of its own, behind the gate."""

from __future__ import annotations

import os
import socket
import threading
from pathlib import Path
from typing import Any

from fastapi import HTTPException, Request
from nicegui import app, ui
from nicegui.server import Server

from advise_ros.console import language
from advise_ros.console.port import HOST
from advise_ros.console.protection import Gate, Protection

STATIC = Path(__file__).parent / 'static'
STOP_PATIENCE_S = 3.0
# A browser that is away for longer loads the page anew.
RECONNECT_S = 30.0
# The language that a person chose on the page.
COOKIE = 'advise-language'
# Browsers load the page's files again when they have changed.
CACHE_S = 0


def head(prefix: str) -> str:
    """What a page's head loads: the common style, and all its modules at once, instead of one import after the other.

    Args:
        prefix: of the modules and the style that are this page's own; '' for those that have none.
    """
    own = [path for path in sorted(STATIC.iterdir()) if path.name.startswith('draw') == bool(prefix)]
    styles = ['console.css', *(path.name for path in own if path.suffix == '.css' and path.name != 'console.css')]
    return ''.join(f'<link rel="stylesheet" href="/console/{name}">' for name in styles) + ''.join(
        f'<link rel="modulepreload" href="/console/{path.name}">' for path in own if path.suffix == '.js'
    )


def begin_page(request: Request, prefix: str, chosen: str) -> str:
    """Fill in the head of a page that opens; returns the language that it speaks at first.

    Args:
        request: of the browser, with the language that a person chose on the page before.
        prefix: as of `head`.
        chosen: the language that whoever started the server has chosen; empty: the browser's.
    """
    ui.add_css(':root { color-scheme: light dark }')
    ui.add_head_html(head(prefix))
    return language.of_browser(request.headers.get('accept-language', ''), request.cookies.get(COOKIE) or chosen)


def texts(code: str) -> dict[str, Any]:
    """The catalogue of a language, for a page that changes to it."""
    if code not in language.languages():
        raise HTTPException(404, f'no language {code!r}; there are {", ".join(language.languages())}')
    return language.catalogue(code)


class PageThread:
    """Serves every page that was added to NiceGUI, to its own browser windows only.

    Args:
        gate: who may see and act.
        bound: the socket to serve on; `port.bind` makes one.

    Attributes:
        failure: why it serves no more, empty while it does.
    """

    def __init__(self, gate: Gate, bound: socket.socket) -> None:
        self._bound = bound
        self.failure = ''
        self._thread = threading.Thread(target=self._run, name='page-server', daemon=True)
        app.add_static_files('/console', STATIC, max_cache_age=CACHE_S)
        app.add_middleware(Protection, gate=gate)
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
