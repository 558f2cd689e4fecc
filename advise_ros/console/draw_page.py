"""The page on which a person draws a grid file, and its server."""

from __future__ import annotations

import asyncio
import socket
from typing import Any

from fastapi import HTTPException, Request
from fastapi.responses import Response
from nicegui import app, ui

from advise_ros.console import language
from advise_ros.console.grid_editor import GridEditor
from advise_ros.console.protection import Gate
from advise_ros.console.serving import COOKIE, PageThread, head


class DrawPage(ui.element, component='static/draw.js'):
    """One open window of it."""

    def __init__(self, editor: GridEditor, code: str) -> None:
        super().__init__()
        self._editor = editor
        self._props['start'] = editor.start()
        self._props['words'] = language.catalogue(code)
        self.on('act', self._on_act)
        self.on('hello', self._on_hello)

    def _on_hello(self, event: Any) -> None:
        if isinstance(event.args, dict):
            self.run_method('welcome', str(event.args.get('line')))

    async def _on_act(self, event: Any) -> None:
        given = event.args
        if not isinstance(given, dict) or not isinstance(given.get('given'), dict):
            return
        reply = await asyncio.to_thread(self._editor.act, str(given.get('name')), given['given'])
        if not self.is_deleted:
            self.run_method('reply', given.get('id'), reply)


class DrawServer(PageThread):
    """Serves one drawing.

    Args:
        editor: the drawing.
        gate, bound: as PageThread has them.
    """

    def __init__(self, editor: GridEditor, gate: Gate, bound: socket.socket) -> None:
        super().__init__(gate, bound)
        self._editor = editor
        app.get('/console-picture')(self._picture)
        ui.page('/', title='advise: draw a grid', response_timeout=30)(self._open)

    def _picture(self) -> Response:
        picture = self._editor.picture
        if picture is None:
            raise HTTPException(404, 'there is no picture')
        return Response(picture.data, media_type=picture.kind, headers={'cache-control': 'no-store'})

    def _open(self, request: Request) -> None:
        ui.add_css(':root { color-scheme: light dark }')
        ui.add_head_html(head('draw'))
        chosen = request.cookies.get(COOKIE, '')
        DrawPage(self._editor, language.of_browser(request.headers.get('accept-language', ''), chosen))
