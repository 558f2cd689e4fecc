"""The page's server is made by the first browser, or when nobody has come for a while."""

import socket
import threading
from collections.abc import Iterator

import pytest

from advise_ros.console.first_visit import FirstVisit
from advise_ros.console.port import HOST, bind

PATIENCE_S = 20.0


class OneReply:
    """A stand-in for the page's server: it serves one connection."""

    def __init__(self, bound: socket.socket) -> None:
        self._bound = bound
        self.failure = ''

    def start(self) -> None:
        connection, _ = self._bound.accept()
        connection.sendall(b'page')
        connection.close()

    def stop(self) -> None:
        self.failure = 'stopped'


@pytest.fixture
def bound() -> Iterator[socket.socket]:
    with bind(0) as one:
        yield one


def visit(bound: socket.socket) -> bytes:
    with socket.create_connection((HOST, bound.getsockname()[1]), timeout=PATIENCE_S) as browser:
        return browser.recv(4)


def test_the_first_browser_waits_for_the_server_and_is_served(bound: socket.socket) -> None:
    page = FirstVisit(bound, lambda: OneReply(bound))
    page.start()
    assert visit(bound) == b'page'
    page.stop()
    assert page.failure == 'stopped'


def test_a_node_that_ends_before_a_visit_makes_no_server(bound: socket.socket) -> None:
    page = FirstVisit(bound, lambda: pytest.fail('made'), idle_s=PATIENCE_S)
    page.start()
    page.stop()
    assert page.failure == ''
    assert bound.fileno() == -1


def test_after_a_while_without_a_visit_it_is_made(bound: socket.socket) -> None:
    made = threading.Event()

    def make() -> OneReply:
        made.set()
        return OneReply(bound)

    page = FirstVisit(bound, make, idle_s=0.0)
    page.start()
    assert made.wait(PATIENCE_S)
    assert visit(bound) == b'page'
    page.stop()


def test_why_a_server_cannot_be_made_is_its_failure(bound: socket.socket) -> None:
    tried = threading.Event()

    def broken() -> OneReply:
        tried.set()
        raise OSError('no files')

    page = FirstVisit(bound, broken)
    page.start()
    with socket.create_connection((HOST, bound.getsockname()[1]), timeout=PATIENCE_S):
        assert tried.wait(PATIENCE_S)
    page.stop()
    assert page.failure == 'the page cannot be served: OSError: no files'
