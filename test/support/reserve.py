"""ROS domain ids and UDP ports that no other test uses, in this run or in one beside it."""

from __future__ import annotations

import os
import socket
from contextlib import AbstractContextManager

from advise_ros.ros.private_domain import private_domain

DEFAULT_DOMAINS = '50-100'


def ros_domain() -> AbstractContextManager[int]:
    """A ROS domain id that is locked for this machine while in use and in which nobody listens."""
    low, high = os.environ.get('ADVISE_TEST_DOMAINS', DEFAULT_DOMAINS).split('-')
    return private_domain(range(int(low), int(high) + 1))


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
