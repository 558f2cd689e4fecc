"""Whole stories; most of the fixtures are explained in test/ros/conftest.py."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from support.browser import chromium
from support.fixtures import announcements, forks, free_tcp_port, free_udp_port, graph, ros_env, square_file

__all__ = ['announcements', 'forks', 'free_tcp_port', 'free_udp_port', 'graph', 'ros_env', 'square_file']


@pytest.fixture(scope='module')
def browser() -> Iterator[Browser]:
    """One browser for all tests of a file."""
    with chromium() as opened:
        yield opened
