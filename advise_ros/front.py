"""Where every executable begins: Ctrl-C and SIGTERM end it without a traceback, also while it still reads its libraries.

Only what the standard library is enough for is imported before the handlers stand; the rest takes a second or more.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any

from advise_ros.exits import INTERRUPTED, fail
from advise_ros.middleware import FLYING, without_shared_memory
from advise_ros.missing_packages import remedy

PYTHON_STARTS_WITH = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}


class Front:
    """The entry points of a package: `nodes.policy` runs `main` of advise_ros.nodes.policy.

    Args:
        package: whose modules are run.
        interrupted: exit code when Ctrl-C or SIGTERM comes before the module takes care of it.
    """

    def __init__(self, package: str, interrupted: int) -> None:
        self._package, self._interrupted = package, interrupted

    def __getattr__(self, name: str) -> Callable[[], None]:
        return partial(self._run, name)

    def _run(self, name: str) -> None:
        # A process in the background of a script is not to be interrupted: leave that as it is.
        watched = [number for number, handler in PYTHON_STARTS_WITH.items() if signal.getsignal(number) is handler]
        for number in watched:
            signal.signal(number, self._leave)
        if signal.SIGINT in watched:
            # A terminal and `ros2 launch` both send one: the second must not end a node that is on its way out with -2.
            atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
        if name in FLYING:
            without_shared_memory(os.environ)
        try:
            main = _imported(f'{self._package}.{name}').main
            for number in watched:
                signal.signal(number, signal.default_int_handler)  # SIGTERM leaves by KeyboardInterrupt, too: in good order.
            main()
        except KeyboardInterrupt:
            self._leave()
        except ModuleNotFoundError as missing:
            if (sentence := remedy(missing.name or '')) is None:
                raise
            raise SystemExit(fail(sentence)) from None
        finally:
            for number in watched:
                signal.signal(number, self._leave)  # Python waits for threads of libraries on its way out.

    def _leave(self, *_: object) -> None:
        os._exit(self._interrupted)


def _imported(name: str) -> Any:
    """A module; what it brings stays, so looking through it for garbage meanwhile takes a tenth of the time for nothing."""
    gc.disable()
    try:
        return import_module(name)
    finally:
        gc.enable()


# A node that has not begun is stopped cleanly; a command has not done what it was asked.
nodes = Front('advise_ros.nodes', 0)
commands = Front('advise_ros.commands', INTERRUPTED)
