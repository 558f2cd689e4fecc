"""A ROS domain of one's own."""

import socket

import pytest

from advise_ros.core.errors import InputError
from advise_ros.ros.private_domain import PORT_BASE, PORTS_PER_DOMAIN, private_domain

# Not those of the other tests, and below the ports that the kernel gives away.
QUIET = range(20, 50)


def test_a_domain_in_use_is_given_to_nobody_else_and_is_free_again_afterwards() -> None:
    with private_domain(QUIET) as mine:
        assert mine in QUIET
        with pytest.raises(InputError, match=f'none of the ROS domains {mine} to {mine} is free'), private_domain([mine]):
            pass
    with private_domain([mine]) as again:
        assert again == mine


def test_a_domain_in_which_somebody_listens_is_passed_over() -> None:
    with private_domain(QUIET) as free:
        pass
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(('127.0.0.1', PORT_BASE + PORTS_PER_DOMAIN * free + 11))
        with pytest.raises(InputError, match='is free; stop other graphs'), private_domain([free]):
            pass
