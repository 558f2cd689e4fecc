"""Child processes of a command: started, watched, and never left behind."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import IO, Any

from ament_index_python.packages import get_package_prefix

from advise_ros.core.errors import AdviseError
from advise_ros.fair_clock import FairClock
from advise_ros.parent import die_with_parent

LAST_LINES = 12
STOP_PATIENCE_S = 8.0
POLL_S = 0.02


class ChildDiedError(AdviseError):
    """A process that should run has ended; the message holds its last lines.

    Attributes:
        name: of the process.
    """

    def __init__(self, name: str, message: str) -> None:
        super().__init__(message)
        self.name = name


def executable(name: str) -> Path:
    """Path of an executable of this package, as `ros2 run` would find it."""
    return Path(get_package_prefix('advise_ros')) / 'lib' / 'advise_ros' / name


def ros_arguments(parameters: Mapping[str, object], *extra: str) -> list[str]:
    """--ros-args with every parameter."""
    arguments = ['--ros-args', *extra]
    for name, value in parameters.items():
        # Parameter values are YAML, and JSON is: a path stays a text whatever it holds.
        text = json.dumps(str(value) if isinstance(value, Path) else value, ensure_ascii=False)
        arguments += ['-p', f'{name}:={text}']
    return arguments


@dataclass
class Child:
    """One child process and the file that holds what it prints."""

    name: str
    process: subprocess.Popen[bytes]
    log_path: Path
    log_file: IO[bytes]
    may_end: bool
    fatal: bool

    def last_lines(self) -> str:
        self.log_file.flush()
        lines = self.log_path.read_text(errors='replace').strip().splitlines()
        return '\n'.join(f'    {line}' for line in lines[-LAST_LINES:]) or '    (it printed nothing)'


class Supervisor:
    """Starts children in sessions of their own, so that Ctrl-C reaches the parent alone, which stops them in order.

    Use as a context manager: leaving it stops every child. Within it SIGINT and SIGTERM only leave a note,
    which `check` turns into KeyboardInterrupt: raised anywhere, it could be lost inside a fork or a callback.

    Attributes:
        clock: seconds in which all children could run; patience with them is measured by it.
    """

    def __init__(self, log_directory: Path) -> None:
        self._logs = log_directory
        self._children: list[Child] = []
        self._interrupted = False
        self._handlers: dict[signal.Signals, Any] = {}
        self.clock = FairClock(lambda: self.pids().values())

    def __enter__(self) -> Supervisor:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._handlers[number] = signal.signal(number, self._interrupt)
        return self

    def __exit__(self, *_: object) -> None:
        self.stop_all()
        for number, handler in self._handlers.items():
            signal.signal(number, handler)

    def _interrupt(self, *_: object) -> None:
        self._interrupted = True

    def start(self, name: str, command: Sequence[str], *, may_end: bool = False, fatal: bool = True) -> Child:
        """Start a process; `may_end`: its clean end is no failure; not `fatal`: nor is any other end."""
        self._logs.mkdir(parents=True, exist_ok=True)
        log_path = self._logs / f'{name}.log'
        log_file = log_path.open('ab')
        process = subprocess.Popen(
            list(command), stdin=subprocess.DEVNULL, stdout=log_file, stderr=subprocess.STDOUT,
            start_new_session=True, preexec_fn=partial(die_with_parent, os.getpid()),  # noqa: PLW1509  one prctl, no locks
        )
        child = Child(name, process, log_path, log_file, may_end, fatal)
        self._children.append(child)
        return child

    def start_node(
        self, name: str, parameters: Mapping[str, object], *extra: str, may_end: bool = False, log: str = '',
    ) -> Child:
        """Start an executable of this package as a node."""
        command = [str(executable(name)), *ros_arguments(parameters, *extra)]
        return self.start(log or name, command, may_end=may_end)

    def pids(self) -> dict[str, int]:
        """Process ids of the children by name."""
        return {child.name: child.process.pid for child in self._children}

    def check(self) -> None:
        """Look after the children.

        Raises:
            KeyboardInterrupt: somebody wants the parent to stop.
            ChildDiedError: a child has ended that should run.
        """
        if self._interrupted:
            raise KeyboardInterrupt
        for child in self._children:
            code = child.process.poll()
            if code is not None and child.fatal and not (child.may_end and code == 0):
                how = f'was killed by {signal.Signals(-code).name}' if code < 0 else f'ended with exit code {code}'
                raise ChildDiedError(child.name, f'{child.name} {how}; its last lines ({child.log_path}):\n{child.last_lines()}')

    def stop(self, *children: Child) -> tuple[str, ...]:
        """Ask children to stop, then make them; returns when all are gone, with the names of those that were made to."""
        for child in children:
            if child.process.poll() is None:
                child.process.send_signal(signal.SIGINT)
        end = self.clock() + STOP_PATIENCE_S
        while any(child.process.poll() is None for child in children) and self.clock() < end:
            time.sleep(POLL_S)
        stubborn = [child for child in children if child.process.poll() is None]
        for child in stubborn:
            child.process.kill()
        for child in children:
            child.process.wait()
            child.log_file.close()
            if child in self._children:
                self._children.remove(child)
        return tuple(child.name for child in stubborn)

    def stop_all(self) -> None:
        """Stop every child, the latest first."""
        self.stop(*reversed(self._children))
