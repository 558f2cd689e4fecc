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
# What an activated environment, a sourced workspace or a user's habits leave behind, and set-up must not follow.
FOREIGN = (
    'AMENT_PREFIX_PATH', 'CMAKE_PREFIX_PATH', 'COLCON_PREFIX_PATH', 'COLCON_DEFAULTS_FILE', 'VIRTUAL_ENV', 'CONDA_PREFIX',
    'PIP_USER', 'PIP_TARGET', 'PIP_PREFIX', 'PIP_ROOT', 'PIP_REQUIRE_VIRTUALENV', 'PIP_CONSTRAINT', 'PIP_NO_DEPS',
    'UV_PYTHON', 'UV_SYSTEM_PYTHON', 'UV_CONSTRAINT', 'UV_OVERRIDE',
)
FOREIGN_PREFIXES = ('PYTHON', '_ROS_WHEELS')


def plain_env(scratch: Path | None = None) -> dict[str, str]:
    """This environment without what would lead set-up's own Python, pip and CMake astray.

    Args:
        scratch: directory of temporary files, since TMPDIR may be small or allow no programs; None: as it is.
    """
    kept = {name: value for name, value in os.environ.items() if name not in FOREIGN and not name.startswith(FOREIGN_PREFIXES)}
    kept['PYTHONUTF8'] = '1'
    if scratch is not None:
        kept['TMPDIR'] = str(scratch)
    return kept


class Shell:
    """Runs commands in the repository's root; what they print is appended to a log file.

    Attributes:
        env: environment of every command that is not given another.
    """

    def __init__(self, root: Path, log: Path) -> None:
        self.root = root
        self.log = log
        self.env: Mapping[str, str] = plain_env()

    def say(self, text: str) -> None:
        print(f'set-up: {text}', flush=True)

    def try_run(self, command: Sequence[str | Path], env: Mapping[str, str] | None = None) -> tuple[int, str]:
        """Exit code and output."""
        self.log.parent.mkdir(exist_ok=True)
        try:
            done = subprocess.run(
                [str(word) for word in command], cwd=self.root, env=dict(self.env if env is None else env),
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                encoding='utf-8', errors='replace', check=False,
            )
        except OSError as problem:
            return 127, f'{command[0]}: {problem.strerror}'
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
