"""Executables of the package as child processes whose output is captured and whose end is certain."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Protocol

TAIL = 15


def executable(name: str) -> str:
    """Path of an installed executable, found as `ros2 run advise_ros NAME` finds it."""
    for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep):
        path = Path(prefix, 'lib', 'advise_ros', name)
        if path.is_file():
            return str(path)
    raise AssertionError(f'executable {name!r} is not installed; run the tests by `make test` or `./advise python -m pytest`')


def ros_arguments(params: Mapping[str, Any], remaps: Mapping[str, str], namespace: str) -> list[str]:
    """`--ros-args` for parameters (JSON is YAML, so strings stay strings), remappings and a namespace."""
    words = [word for key, value in params.items() for word in ('-p', f'{key}:={json.dumps(value)}')]
    words += [word for old, new in remaps.items() for word in ('-r', f'{old}:={new}')]
    words += ['-r', f'__ns:={namespace}'] if namespace else []
    return ['--ros-args', *words] if words else []


def living_in_group(group: int) -> list[int]:
    """Processes of a process group that are not zombies."""
    found = []
    for stat in Path('/proc').glob('[0-9]*/stat'):
        try:
            state, _, member_of = stat.read_text().rpartition(')')[2].split()[:3]
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(member_of) == group and state not in 'ZX':
            found.append(int(stat.parent.name))
    return found


def living_in_domain(domain: str) -> dict[int, str]:
    """Command lines by process id of all other processes that were started in a ROS domain."""
    found = {}
    for environ in Path('/proc').glob('[0-9]*/environ'):
        number = int(environ.parent.name)
        try:
            if number != os.getpid() and f'ROS_DOMAIN_ID={domain}\0'.encode() in environ.read_bytes():
                found[number] = (environ.parent / 'cmdline').read_bytes().replace(b'\0', b' ').decode()
        except OSError:
            continue
    return {number: command for number, command in found.items() if command}


class Started(Protocol):
    """What a subprocess.Popen and a forked process have in common."""

    pid: int
    returncode: int | None

    @property
    def stdout(self) -> IO[str] | None: ...

    @property
    def stderr(self) -> IO[str] | None: ...

    def poll(self) -> int | None: ...

    def wait(self, timeout: float | None = None) -> int: ...

    def send_signal(self, number: int, /) -> None: ...

    def kill(self) -> None: ...


def start_fresh(command: Sequence[str], env: Mapping[str, str]) -> Started:
    """A process that begins from nothing, in a session of its own, with pipes for its output."""
    return subprocess.Popen(
        list(command), env=dict(env), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, errors='replace', start_new_session=True,
    )


class Process:
    """A child in its own process group.

    Attributes:
        name: the executable.
        out, err: lines written so far to stdout and stderr. Read verdicts from `err` or topics: the
            middleware writes to stdout too.
        expected_to_end: set by everything that ends it or waits for its end; the end of any other
            process with a code other than 0 fails the test.
    """

    def __init__(self, name: str, popen: Started, notify: Callable[[], None]) -> None:
        self.name = name
        self.out: list[str] = []
        self.err: list[str] = []
        self.expected_to_end = False
        self._notify = notify
        self.popen = popen
        self._readers = [self._read(self.popen.stdout, self.out), self._read(self.popen.stderr, self.err)]

    def _read(self, stream: IO[str] | None, lines: list[str]) -> threading.Thread:
        def collect() -> None:
            assert stream is not None
            for line in stream:
                lines.append(line.rstrip('\n'))
                self._notify()

        thread = threading.Thread(target=collect, daemon=True)
        thread.start()
        return thread

    @property
    def pid(self) -> int:
        return self.popen.pid

    @property
    def lines(self) -> list[str]:
        """All of stdout, then all of stderr."""
        return [*self.out, *self.err]

    @property
    def text(self) -> str:
        return '\n'.join(self.lines)

    @property
    def running(self) -> bool:
        return self.popen.poll() is None

    @property
    def failed(self) -> bool:
        """It ended by itself with an exit code other than 0."""
        return not self.expected_to_end and self.popen.poll() not in (None, 0)

    def describe(self) -> str:
        """Name, exit code and the last lines, for a failure's message."""
        tail = '\n  '.join([*self.out[-TAIL:], *self.err[-TAIL:]])
        return f'{self.name}: exit code {self.popen.poll()}\n  {tail}'

    def wait_exit(self, timeout_s: float = 120.0) -> int:
        """Exit code of a process that is to end by itself; all its output is there afterwards."""
        self.expected_to_end = True
        try:
            code = self.popen.wait(timeout_s)
        except subprocess.TimeoutExpired:
            raise AssertionError(f'still running after {timeout_s} s: {self.describe()}') from None
        self._join()
        return code

    def signal(self, number: int = signal.SIGINT) -> None:
        """Send a signal to the process alone."""
        self.expected_to_end = True
        if self.running:
            self.popen.send_signal(number)

    def terminate(self, timeout_s: float = 30.0) -> int:
        """SIGTERM, and its exit code."""
        self.signal(signal.SIGTERM)
        return self.wait_exit(timeout_s)

    def kill(self) -> None:
        """SIGKILL to the whole process group, as when the machine fails."""
        self.expected_to_end = True
        self._kill_group()
        self.popen.wait(10)
        self._join()

    def end(self, patience_s: float = 30.0) -> str:
        """Stop it at the end of a test, by force if need be; returns what was wrong, or ''."""
        self.signal(signal.SIGINT)
        try:
            self.popen.wait(patience_s)
        except subprocess.TimeoutExpired:
            self.kill()
            return f'did not stop within {patience_s} s of SIGINT: {self.describe()}'
        complaint = self._end_children()
        self._join()
        return complaint

    def _end_children(self, patience_s: float = 3.0) -> str:
        left = self._wait_empty(patience_s)
        self._kill_group()
        return f'{self.name} left processes {left} behind' if left else ''

    def _kill_group(self) -> None:
        try:
            os.killpg(self.pid, signal.SIGKILL)
        except ProcessLookupError:
            return
        left = self._wait_empty(5.0)
        assert not left, f'processes {left} of {self.name} survive SIGKILL'

    def _wait_empty(self, patience_s: float) -> list[int]:
        """Members of the group that are still alive after a while."""
        deadline = time.monotonic() + patience_s
        while (left := living_in_group(self.pid)) and time.monotonic() < deadline:
            time.sleep(0.02)
        return left

    def _join(self) -> None:
        for reader in self._readers:
            reader.join(1)  # A child left behind may hold the pipe open.
