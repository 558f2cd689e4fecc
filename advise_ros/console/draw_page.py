"""The page on which a person draws a grid file, and its server."""

from __future__ import annotations

import asyncio
import socket
from typing import Any

from fastapi import HTTPException, Request
from fastapi.responses import Response
from nicegui import app, ui

from advise_ros.console import language
from advise_ros.console.grid_editor import PICTURE, GridEditor
from advise_ros.console.protection import Gate
from advise_ros.console.serving import PageThread, begin_page


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


def add_drawing(editor: GridEditor, path: str, chosen: str = '') -> None:
    """Serve a drawing on a path of NiceGUI's server.

    Args:
        editor: the drawing.
        path: e.g. '/draw'.
        chosen: the language that whoever started the server has chosen.
    """

    def opened(request: Request) -> None:
        DrawPage(editor, begin_page(request, 'draw', chosen))

    ui.page(path, title='advise: draw a grid', response_timeout=30)(opened)


class DrawServer(PageThread):
    """Serves one drawing and its picture.

    Args:
        editor: the drawing.
        gate, bound: as PageThread has them.
    """

    def __init__(self, editor: GridEditor, gate: Gate, bound: socket.socket) -> None:
        super().__init__(gate, bound)
        self._editor = editor
        app.get(PICTURE)(self._picture)
        add_drawing(editor, '/')

    def _picture(self) -> Response:
        picture = self._editor.picture
        if picture is None:
            raise HTTPException(404, 'there is no picture')
        return Response(picture.data, media_type=picture.kind, headers={'cache-control': 'no-store'})
