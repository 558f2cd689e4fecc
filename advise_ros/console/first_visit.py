"""The page's server is made when the node is at work, or as soon as somebody looks: its libraries take half of a start."""

from __future__ import annotations

import select
import socket
import threading
import time
from collections.abc import Callable
from typing import Protocol

POLL_S, STOP_PATIENCE_S = 0.2, 3.0
# Who comes later than this does not wait for the libraries.
IDLE_S = 2.0


class Server(Protocol):
    """What serves the page, in a thread of its own.

    Attributes:
        failure: why it serves no more, empty while it does.
    """

    failure: str

    def start(self) -> None: ...

    def stop(self) -> None: ...


class FirstVisit:
    """Waits a while for the first browser in a thread of its own; it waits in the socket's queue until the server is up.

    Args:
        bound: the socket, which listens.
        make: imports and builds the server on that socket.
        idle_s: it is made then, if nobody came.

    Attributes:
        failure: why nothing is served any more, empty while it is.
    """

    def __init__(self, bound: socket.socket, make: Callable[[], Server], idle_s: float = IDLE_S) -> None:
        self._bound, self._make, self._idle_s = bound, make, idle_s
        self._server: Server | None = None
        self._problem = ''
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name='first-visit', daemon=True)

    @property
    def failure(self) -> str:
        return self._problem or (self._server.failure if self._server is not None else '')

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """End the waiting, or the server."""
        self._stopped.set()
        if self._thread.is_alive():
            self._thread.join(STOP_PATIENCE_S)
        if self._server is not None:
            self._server.stop()
        self._bound.close()

    def _run(self) -> None:
        idle_until = time.monotonic() + self._idle_s
        while time.monotonic() < idle_until and not select.select([self._bound], [], [], POLL_S)[0]:
            if self._stopped.is_set():
                return
        try:
            server = self._make()
            server.start()
        except Exception as problem:  # noqa: BLE001  whatever it is, the node has to say it
            self._problem = f'the page cannot be served: {type(problem).__name__}: {problem}'
        else:
            self._server = server
