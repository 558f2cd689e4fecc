"""ROS domain ids and UDP ports that no other test uses, in this run or in one beside it."""

from __future__ import annotations

import fcntl
import os
import random
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# Above the ids that people pick, below those whose ports reach into the ephemeral range.
DEFAULT_DOMAINS = '50-100'
PORT_BASE, PORTS_PER_DOMAIN = 7400, 250


def _candidates() -> list[int]:
    low, high = os.environ.get('ADVISE_TEST_DOMAINS', DEFAULT_DOMAINS).split('-')
    domains = list(range(int(low), int(high) + 1))
    random.shuffle(domains)
    return domains


def _udp_ports_in_use() -> set[int]:
    rows = Path('/proc/net/udp').read_text().splitlines()[1:]
    return {int(row.split()[1].rpartition(':')[2], 16) for row in rows}


@contextmanager
def ros_domain() -> Iterator[int]:
    """A ROS domain id that is locked for this machine while in use and in which nobody listens."""
    folder = Path(tempfile.gettempdir(), f'advise_ros_test_domains_{os.getuid()}')
    folder.mkdir(exist_ok=True)
    for domain in _candidates():
        with open(folder / str(domain), 'w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            first = PORT_BASE + PORTS_PER_DOMAIN * domain
            if _udp_ports_in_use().isdisjoint(range(first, first + PORTS_PER_DOMAIN)):
                yield domain
                return
    raise AssertionError('no free ROS domain id; name a range by ADVISE_TEST_DOMAINS=LOW-HIGH')


def free_udp_port() -> int:
    """A port of 127.0.0.1 that nobody had just now; the kernel hands out others to those who ask next."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(('127.0.0.1', 0))
        return int(probe.getsockname()[1])


def free_tcp_port() -> int:
    """As free_udp_port, for TCP."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.bind(('127.0.0.1', 0))
        return int(probe.getsockname()[1])
