"""No child outlives its parent, however the parent dies."""

from __future__ import annotations

import ctypes
import os
import signal
from typing import Any

PR_SET_PDEATHSIG = 1
# Loaded here: between fork and exec nothing may be imported.
_LIBC = ctypes.CDLL(None, use_errno=True)


def die_with_parent(parent: int) -> None:
    """Called in a child of process `parent`: SIGTERM when the thread that started it is gone (Linux, prctl(2))."""
    _LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:  # It died before the call.
        os._exit(0)


def tied_workers() -> dict[str, Any]:
    """What to give joblib's Parallel so that its workers end with this process; they would work on for half a minute."""
    return {'initializer': die_with_parent, 'initargs': (os.getpid(),)}
