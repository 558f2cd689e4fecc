"""A terminal that gives single keys, and is put back as it was however the process ends."""

from __future__ import annotations

import atexit
import os
import select
import signal
import sys
import termios
import tty
from typing import Any

from advise_ros.core.errors import InputError


class Terminal:
    """Standard input key by key, without echo; Ctrl-C still interrupts.

    Raises:
        InputError: standard input is no terminal.
    """

    def __init__(self) -> None:
        if not sys.stdin.isatty():
            raise InputError('standard input is no terminal; start this in one, by hand, not in the background or a pipe')
        self._fd = sys.stdin.fileno()
        self._saved: list[Any] | None = termios.tcgetattr(self._fd)
        atexit.register(self.restore)
        tty.setcbreak(self._fd)
        # Back from Ctrl-Z, the shell has set the terminal to lines again.
        signal.signal(signal.SIGCONT, self._on_continue)

    def _on_continue(self, *_: object) -> None:
        if self._saved is not None:
            tty.setcbreak(self._fd)

    def read(self) -> bytes | None:
        """What was typed since the last call, at once; None when the terminal is gone."""
        ready, _, _ = select.select([self._fd], [], [], 0.0)
        if not ready:
            return b''
        try:
            return os.read(self._fd, 1024) or None
        except OSError:
            return None

    @staticmethod
    def show(line: str) -> None:
        """Replace the last line of the terminal."""
        columns = os.get_terminal_size(sys.stdout.fileno()).columns if sys.stdout.isatty() else 0
        print(f'\r\x1b[K{line[: columns - 1] if columns else line}', end='', flush=True)

    def restore(self) -> None:
        """Put the terminal back; may be called twice."""
        saved, self._saved = self._saved, None
        if saved is not None:
            try:
                termios.tcsetattr(self._fd, termios.TCSADRAIN, saved)
            except termios.error:
                return  # The terminal is gone: nothing to put back.
            print(flush=True)
