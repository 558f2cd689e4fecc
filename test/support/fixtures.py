"""Fixtures of test/ros and test/e2e."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from support import reserve
from support.announcements import announce_often
from support.fork_server import ForkServers
from support.graph import Graph
from support.learner import write_grid
from support.policies import square


@pytest.fixture(scope='session')
def announcements() -> None:
    """What a test starts finds the test's node at once."""
    with reserve.ros_domain() as domain:
        announce_often(domain)


@pytest.fixture
def ros_env(announcements: None, monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, str]]:
    """A ROS domain of one's own, set in this process; yields the whole environment for children."""
    with reserve.ros_domain() as domain:
        for name, value in (
            ('ROS_DOMAIN_ID', str(domain)), ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST'), ('PYTHONUNBUFFERED', '1'),
        ):
            monkeypatch.setenv(name, value)
        yield dict(os.environ)


@pytest.fixture(scope='session')
def forks() -> Iterator[ForkServers]:
    """What executables are forked from."""
    servers = ForkServers()
    yield servers
    servers.close()


@pytest.fixture
def graph(ros_env: dict[str, str], forks: ForkServers) -> Iterator[Graph]:
    """A private ROS graph; see test/ros/conftest.py."""
    private = Graph(int(ros_env['ROS_DOMAIN_ID']), ros_env, forks=forks)
    try:
        yield private
    finally:
        complaints = private.close()
    assert not complaints, '\n'.join(complaints)


@pytest.fixture
def free_udp_port() -> int:
    return reserve.free_udp_port()


@pytest.fixture
def free_tcp_port() -> int:
    return reserve.free_tcp_port()


@pytest.fixture
def square_file(tmp_path: Path) -> str:
    """A grid file of `support.policies.square`."""
    return write_grid(tmp_path, square())
