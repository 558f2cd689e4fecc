"""A ROS domain that nobody else uses, for graphs that must be alone."""

from __future__ import annotations

import fcntl
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from advise_ros.core.errors import InputError

# Above the ids that people pick, below those whose ports reach into the ephemeral range.
DOMAINS = range(50, 101)
PORT_BASE, PORTS_PER_DOMAIN = 7400, 250
SOCKETS = Path('/proc/net/udp')


@contextmanager
def private_domain(candidates: Sequence[int] = DOMAINS) -> Iterator[int]:
    """The id of a domain that is locked for this machine while in use and on which nothing listens.

    Raises:
        InputError: there is none among the candidates.
    """
    folder = Path(tempfile.gettempdir(), f'advise_ros_domains_{os.getuid()}')
    folder.mkdir(exist_ok=True)
    # Each process begins elsewhere: others that know no locks may begin just now.
    first = os.getpid() % len(candidates)
    for domain in (*candidates[first:], *candidates[:first]):
        with (folder / str(domain)).open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            if is_silent(domain):
                yield domain
                return
    raise InputError(f'none of the ROS domains {min(candidates)} to {max(candidates)} is free; stop other graphs')


def is_silent(domain: int) -> bool:
    """Whether nothing on this machine listens in a domain: its UDP ports are free."""
    first = PORT_BASE + PORTS_PER_DOMAIN * domain
    return _ports_in_use().isdisjoint(range(first, first + PORTS_PER_DOMAIN))


def _ports_in_use() -> set[int]:
    try:
        rows = SOCKETS.read_text(encoding='ascii').splitlines()[1:]
    except OSError:  # Not a Linux machine: the lock must do.
        return set()
    return {int(row.split()[1].rpartition(':')[2], 16) for row in rows}
