"""A process that has imported what one executable imports, and forks each process of that executable.

Started by `support.fork_server`: python forking.py SOCKET EXECUTABLE, with the number of an open socket of type SOCK_SEQPACKET.
A request is the JSON of arguments, environment and directory, with the descriptors of stdout and stderr. The child replies
by {"started": PID} once it is what was asked for; its end is told by {"ended": PID, "code": as of subprocess}.

Nothing runs here before the fork but imports: no ROS context, no middleware, no thread of Python's. Two libraries start threads
when they are imported. OpenBLAS ends its own before a fork and starts them again for who needs them (pthread_atfork);
LTTng, which comes with rclpy, has to be told (lttng-ust(3), "Using LTTng-UST with daemons").
"""

from __future__ import annotations

import ctypes
import gc
import json
import os
import runpy
import select
import socket
import sys
import threading
from importlib import import_module
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

LONGEST_REQUEST = 1 << 17
STREAMS = (1, 2)
# sizeof(sigset_t), which LTTng keeps the mask of signals in meanwhile.
SIGSET_BYTES = 128
# Executable -> what it imports once it is at work, for a second or two of each process.
LEARNING = ('sklearn.cluster', 'advise_ros.core.site.within_advise')
AT_WORK = {'advise': LEARNING, 'replay': LEARNING}


def import_as_started(script: Path) -> None:
    """Import what the script of an executable imports, from the same places."""
    sys.path[0] = str(script.parent)
    (point,) = (
        one for one in distribution('advise-ros').entry_points if (one.group, one.name) == ('console_scripts', script.name))
    import_module(point.module)
    for module in (f'{point.module.rpartition(".")[0]}.{point.attr}', *AT_WORK.get(script.name, ())):
        import_module(module)


class Tracer:
    """LTTng, where it is loaded: its threads go through a fork."""

    def __init__(self) -> None:
        mapped = {line.split()[-1] for line in Path('/proc/self/maps').read_text().splitlines() if '/liblttng-ust' in line}
        libraries = [ctypes.CDLL(library) for library in sorted(mapped)]
        prefixes = 'ust_', 'lttng_ust_'  # Before and since version 2.13.
        self._libraries = [(one, prefix) for one in libraries for prefix in prefixes if hasattr(one, f'{prefix}before_fork')]
        self._signals = ctypes.create_string_buffer(SIGSET_BYTES)

    def fork(self) -> int:
        """As os.fork."""
        self._tell('before_fork')
        child = os.fork()
        self._tell('after_fork_parent' if child else 'after_fork_child')
        return child

    def _tell(self, hook: str) -> None:
        for library, prefix in self._libraries[:1]:
            getattr(library, prefix + hook)(self._signals)


def next_child(connection: socket.socket) -> tuple[dict[str, Any], list[int]] | None:
    """In each child, what it is to be; in this process None, when nobody is left to ask."""
    children: dict[int, int] = {}
    tracer = Tracer()
    events = select.poll()
    events.register(connection, select.POLLIN)
    while True:
        for ready, _ in events.poll():
            if ready in children:
                events.unregister(ready)
                _tell_end(connection, children.pop(ready))
                os.close(ready)
                continue
            request, streams, *_ = socket.recv_fds(connection, LONGEST_REQUEST, len(STREAMS))
            if not request:
                return None
            child = tracer.fork()
            if not child:
                for descriptor in children:
                    os.close(descriptor)
                return json.loads(request), streams
            for descriptor in streams:
                os.close(descriptor)
            descriptor = os.pidfd_open(child)
            children[descriptor] = child
            events.register(descriptor, select.POLLIN)


def _tell_end(connection: socket.socket, child: int) -> None:
    _, status = os.waitpid(child, 0)
    connection.send(json.dumps({'ended': child, 'code': os.waitstatus_to_exitcode(status)}).encode())


def become(request: dict[str, Any], streams: list[int], connection: socket.socket) -> None:
    """Be a process that was started with these arguments, environment, directory and streams, in a session of its own."""
    os.setsid()
    for number, descriptor in zip(STREAMS, streams, strict=True):
        os.dup2(descriptor, number)
        os.close(descriptor)
    os.environ.clear()
    os.environ.update(request['env'])
    os.chdir(request['cwd'])
    sys.argv[:] = request['command']
    connection.send(json.dumps({'started': os.getpid()}).encode())
    connection.close()


def main(connection: socket.socket, script: Path) -> None:
    import_as_started(script)
    assert threading.active_count() == 1, threading.enumerate()
    gc.collect()
    gc.freeze()
    asked = next_child(connection)
    if asked:
        become(*asked, connection)
        runpy.run_path(str(script), run_name='__main__')


main(socket.socket(fileno=int(sys.argv[1])), Path(sys.argv[2]))
