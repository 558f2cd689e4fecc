"""Commands of set-up: run with their output in a log, and explained in one sentence when they fail."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import prerequisites
from prerequisites import SetupError

TAIL = 20


class Shell:
    """Runs commands in the repository's root; what they print is appended to a log file."""

    def __init__(self, root: Path, log: Path) -> None:
        self.root = root
        self.log = log

    def say(self, text: str) -> None:
        print(f'set-up: {text}', flush=True)

    def try_run(self, command: Sequence[str | Path], env: Mapping[str, str] | None = None) -> tuple[int, str]:
        """Exit code and output."""
        self.log.parent.mkdir(exist_ok=True)
        try:
            done = subprocess.run(
                [str(word) for word in command], cwd=self.root, env=dict(os.environ if env is None else env),
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                text=True, errors='replace', check=False,
            )
        except FileNotFoundError as problem:
            return 127, str(problem)
        with self.log.open('a', encoding='utf-8') as log:
            log.write(f'{time.strftime("%F %T")} $ {" ".join(str(word) for word in command)}\n{done.stdout}\n')
        return done.returncode, done.stdout

    def run(self, what: str, command: Sequence[str | Path], env: Mapping[str, str] | None = None) -> str:
        """The output of a command that has to succeed.

        Raises:
            SetupError: it failed; the sentence names the cause where it is a known one.
        """
        code, output = self.try_run(command, env)
        if code == 0:
            return output
        known = prerequisites.reason(output)
        if known is None:
            print('\n'.join(output.splitlines()[-TAIL:]), flush=True)
        raise SetupError(f'{what} failed: {known or f"exit code {code}; its last lines stand above"} (log: {self.log})')
