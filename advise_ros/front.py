"""Where every executable begins: Ctrl-C ends it without a traceback, also while it still reads its libraries.

Only exit codes and the standard library are imported before the handler stands; the rest takes a second or more.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from functools import partial
from importlib import import_module

from advise_ros.exits import INTERRUPTED


class Front:
    """The entry points of a package: `nodes.policy` runs `main` of advise_ros.nodes.policy.

    Args:
        package: whose modules are run.
        interrupted: exit code when Ctrl-C comes before the module takes care of it.
    """

    def __init__(self, package: str, interrupted: int) -> None:
        self._package, self._interrupted = package, interrupted

    def __getattr__(self, name: str) -> Callable[[], None]:
        return partial(self._run, name)

    def _run(self, name: str) -> None:
        # A process in the background of a script is not to be interrupted: leave that as it is.
        watched = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        if watched:
            signal.signal(signal.SIGINT, self._leave)
        main = import_module(f'{self._package}.{name}').main
        if watched:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            main()
        except KeyboardInterrupt:
            self._leave()

    def _leave(self, *_: object) -> None:
        os._exit(self._interrupted)


# A node that has not begun is stopped cleanly; a command has not done what it was asked.
nodes = Front('advise_ros.nodes', 0)
commands = Front('advise_ros.commands', INTERRUPTED)
