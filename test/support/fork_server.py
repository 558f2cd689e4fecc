"""Processes of the package's executables that share what they import: each is forked from one that has imported it.

Half of what a test costs is Python reading rclpy, numpy and their like, once more for each node. A forked node is a real
process all the same: its own session and process group, environment, directory, streams, signals and exit code, its own
DDS participant, and it runs the very script that is installed. What is not its own: /proc/PID/cmdline and /proc/PID/environ
are those of the server, pages of memory are shared with it, its parent is the server, and hashes of texts are the same in
all nodes of a server. Who tests starting, imports, memory or what /proc says of a process starts a fresh one.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import IO

SERVER = Path(__file__).with_name('forking.py')
LONGEST_REPLY = 4096
PATIENCE_S = 120.0
# What is read when a node begins, not when something is imported: it may differ from one process of a server to the next.
READ_LATE = ('ROS_', 'FASTDDS_', 'FASTRTPS_', 'PYTEST_')


def is_read_early(variable: str) -> bool:
    """Whether imports may read a variable of the environment."""
    return not variable.startswith(READ_LATE)


class Forked:
    """A forked process, in the shape of a subprocess.Popen.

    Attributes:
        returncode: as that of Popen, once `poll` or `wait` has seen the end.
    """

    def __init__(self, command: Sequence[str], pid: int, end: Future[int], stdout: IO[str], stderr: IO[str]) -> None:
        self.args, self.pid, self.stdout, self.stderr = command, pid, stdout, stderr
        self.returncode: int | None = None
        self._end = end

    def poll(self) -> int | None:
        if self._end.done():
            self.returncode = self._end.result()
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        try:
            self.returncode = self._end.result(timeout)
        except TimeoutError:
            raise subprocess.TimeoutExpired(self.args, timeout or 0.0) from None
        return self.returncode

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            try:
                os.kill(self.pid, number)
            except ProcessLookupError:
                pass  # It has just ended.

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)


class ForkServer:
    """The process that all processes of one executable are forked from.

    Args:
        script: of the executable, as installed.
        env: what is read while it imports.
    """

    def __init__(self, script: str, env: Mapping[str, str]) -> None:
        self._connection, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._popen = subprocess.Popen(
                [sys.executable, str(SERVER), str(theirs.fileno()), script], env=dict(env), stdin=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()], start_new_session=True,
            )
        self._asking = threading.Lock()
        self._started: queue.Queue[tuple[int, Future[int]] | None] = queue.Queue()
        self._reader = threading.Thread(target=self._read, name='fork-server', daemon=True)
        self._reader.start()

    def _read(self) -> None:
        running: dict[int, Future[int]] = {}
        while message := self._connection.recv(LONGEST_REPLY):
            told = json.loads(message)
            if 'started' in told:
                running[told['started']] = Future()
                self._started.put((told['started'], running[told['started']]))
            elif told['ended'] in running:
                running.pop(told['ended']).set_result(told['code'])
            else:
                break  # It ended before it was what it should be.
        self._started.put(None)

    def start(self, command: Sequence[str], env: Mapping[str, str]) -> Forked:
        """A process of the executable, in a session of its own and this process's directory."""
        request = json.dumps({'command': list(command), 'env': dict(env), 'cwd': str(Path.cwd())}).encode()
        (out, their_out), (err, their_err) = os.pipe(), os.pipe()
        streams = [os.fdopen(stream, encoding='utf-8', errors='replace') for stream in (out, err)]
        with self._asking:
            socket.send_fds(self._connection, [request], [their_out, their_err])
            for stream in (their_out, their_err):
                os.close(stream)
            started = self._started.get(timeout=PATIENCE_S)
        assert started, f'what forks {command[0]} has ended, or could not become it'
        return Forked(command, *started, *streams)

    def close(self) -> None:
        """End it, once it has no children."""
        self._connection.shutdown(socket.SHUT_RDWR)
        self._popen.wait(PATIENCE_S)
        self._reader.join()
        self._connection.close()


class ForkServers:
    """One server for each executable, begun when it is first asked for."""

    def __init__(self) -> None:
        self._servers: dict[str, ForkServer] = {}

    def start(self, command: Sequence[str], env: Mapping[str, str]) -> Forked:
        """A process of an executable, see `ForkServer.start`."""
        if command[0] not in self._servers:
            self._servers[command[0]] = ForkServer(command[0], {name: env[name] for name in env if is_read_early(name)})
        return self._servers[command[0]].start(command, env)

    def close(self) -> None:
        for server in self._servers.values():
            server.close()
