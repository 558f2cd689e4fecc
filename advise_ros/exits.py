"""Exit codes of every command and node, and the one sentence that goes with a failure."""

from __future__ import annotations

import sys

OK, VERDICT_NO, USAGE, INTERRUPTED = 0, 1, 2, 130


def fail(sentence: str, code: int = USAGE) -> int:
    """Say on stderr what is wrong; returns the exit code, by default that of wrong usage or input."""
    print(f'error: {sentence}', file=sys.stderr, flush=True)
    return code
