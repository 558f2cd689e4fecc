"""A person at a terminal of their own: a command in a pseudo-terminal, its keys and its screen."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import struct
import subprocess
import termios
from typing import Any

from support.graph import Graph
from support.processes import executable

ROWS, COLUMNS = 50, 160
PATIENCE_S = 60.0
# A run of tests may have set others for itself.
TERMINAL = {'TERM': 'xterm-256color', 'COLUMNS': str(COLUMNS), 'LINES': str(ROWS)}
ESCAPES = re.compile(r'\x1b\[[0-9;?]*[a-zA-Z]')


class Typist:
    """A command in a pseudo-terminal.

    Attributes:
        before: the terminal's settings before the command came.
        screen: what it wrote there since the last look with `type`.
    """

    def __init__(self, graph: Graph, name: str, *arguments: str, size: tuple[int, int] = (ROWS, COLUMNS)) -> None:
        self._graph = graph
        self._master, self._slave = pty.openpty()
        os.set_blocking(self._master, False)
        fcntl.ioctl(self._slave, termios.TIOCSWINSZ, struct.pack('HHHH', *size, 0, 0))
        self.before = self.settings()
        self.screen = ''
        rows, columns = map(str, size)
        self.popen = subprocess.Popen(
            [executable(name), *arguments], env={**graph.env, **TERMINAL, 'LINES': rows, 'COLUMNS': columns},
            start_new_session=True, stdin=self._slave, stdout=self._slave, stderr=self._slave,
        )

    def _read(self) -> None:
        try:
            while chunk := os.read(self._master, 65536):
                self.screen += chunk.decode(errors='replace')
        except BlockingIOError:
            pass

    def sees(self, text: str) -> bool:
        self._read()
        assert self.popen.poll() in (None, 0), self.screen
        return text in ESCAPES.sub('', self.screen)

    def wait_to_see(self, *texts: str) -> None:
        for text in texts:
            self._graph.wait_until(lambda wanted=text: self.sees(wanted), PATIENCE_S, f'{text!r} on the screen')

    def type(self, keys: bytes, *, look_on: bool = False) -> None:
        """Press keys; what stood on the screen before is forgotten, unless one looks on."""
        self._read()
        if not look_on:
            self.screen = ''
        os.write(self._master, keys)

    def settings(self) -> list[Any]:
        return termios.tcgetattr(self._slave)

    def ends(self) -> int:
        """Exit code of a command that is to end by itself."""

        def ended() -> bool:
            self._read()  # Who is not listened to cannot go on writing.
            return self.popen.poll() is not None

        self._graph.wait_until(ended, PATIENCE_S, 'its end')
        return self.popen.wait()

    def close(self) -> None:
        if self.popen.poll() is None:
            self.popen.kill()
        self.popen.wait(10)
        os.close(self._master)
        os.close(self._slave)
