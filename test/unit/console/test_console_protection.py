"""What the page's server lets pass, decided from headers and rates alone."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from advise_ros.console.protection import BURST, FRAME_MAX_BYTES, TOO_BIG, TOO_MANY, Bucket, Gate, Message, Protection

PORT = 8080
HOST = f'127.0.0.1:{PORT}'


def scope(kind: str = 'http', method: str = 'GET', path: str = '/', query: str = '', **headers: str) -> dict[str, Any]:
    found = {'host': HOST, **headers}
    return {
        'type': kind, 'method': method, 'path': path, 'query_string': query.encode(),
        'headers': [(name.encode(), value.encode()) for name, value in found.items()],
    }


@pytest.fixture
def gate() -> Gate:
    return Gate(PORT, ['Drone.example.org'], 'secret')


COOKIE = f'advise_console_{PORT}=secret'


@pytest.mark.parametrize(('asked', 'status'), [
    (scope(cookie=COOKIE), None),
    (scope(cookie=f'other=1; {COOKIE}', host=f'localhost:{PORT}'), None),
    (scope(cookie=COOKIE, host='drone.example.org', origin='https://drone.example.org'), None),
    (scope('websocket', cookie=COOKIE, origin=f'http://{HOST}'), None),
    (scope(), 403),
    (scope(cookie=f'advise_console_{PORT}=Secret'), 403),
    (scope(cookie='=;;='), 403),
    (scope(cookie=COOKIE, host='127.0.0.1:9'), 421),
    (scope(cookie=COOKIE, host='drone.example.org.evil.example'), 421),
    (scope(cookie=COOKIE, origin='http://drone.example.org'), 403),
    (scope(cookie=COOKIE, origin='null'), 403),
    (scope('websocket', cookie=COOKIE), 403),
    (scope('websocket', cookie=COOKIE, origin='https://127.0.0.1'), 403),
    (scope(method='DELETE', cookie=COOKIE), 405),
    (scope(path='/_nicegui_ws/socket.io/', cookie=COOKIE), 400),
])  # fmt: skip
def test_who_may_pass(gate: Gate, asked: dict[str, Any], status: int | None) -> None:
    refusal = gate.look(asked)
    assert (refusal and refusal.status) == status


def test_only_the_token_in_the_address_of_the_right_host_gives_a_cookie(gate: Gate) -> None:
    cookie = gate.entry(scope(query='token=secret'))
    assert cookie is not None and cookie.startswith(COOKIE.encode())
    right = {'query': 'token=secret'}
    wrong = (scope(query='token=secreT'), scope(), scope(**right, host='evil.example'), scope(**right, method='POST'))
    assert [gate.entry(one) for one in wrong] == [None] * 4


def test_tokens_are_random_and_long() -> None:
    tokens = {Gate(PORT).token for _ in range(10)}
    assert len(tokens) == 10 and min(map(len, tokens)) >= 32


def test_the_rate_is_limited_and_comes_back() -> None:
    bucket = Bucket(rate_hz=10.0, burst=5.0)
    begin = bucket._at_s
    assert [bucket.take(begin) for _ in range(6)] == [True] * 5 + [False]
    assert bucket.take(begin + 1.0)


def through(gate: Gate, messages: list[Message]) -> list[Message]:
    """What the application behind receives of a browser's messages on a WebSocket."""
    received: list[Message] = []
    stream = iter(messages)

    async def application(_: Any, receive: Any, __: Any) -> None:
        received.extend([await receive() for _ in messages])

    async def receive() -> Message:
        return next(stream)

    asked = scope('websocket', cookie=COOKIE, origin=f'http://{HOST}')
    asyncio.run(Protection(application, gate)(asked, receive, receive))  # type: ignore[arg-type]
    return received


def test_a_message_that_is_too_big_ends_the_connection(gate: Gate) -> None:
    small, big = ({'type': 'websocket.receive', 'text': size * 'x'} for size in (FRAME_MAX_BYTES, FRAME_MAX_BYTES + 1))
    assert through(gate, [small, big]) == [small, {'type': 'websocket.disconnect', 'code': TOO_BIG}]


def test_too_many_messages_end_the_connection(gate: Gate) -> None:
    many = [{'type': 'websocket.receive', 'text': 'x'}] * int(2 * BURST)
    assert through(gate, many)[-1] == {'type': 'websocket.disconnect', 'code': TOO_MANY}


def test_names_that_can_be_gone_through_only_once_all_count() -> None:
    """As the node gives them: it splits a parameter and drops what is empty."""
    gate = Gate(PORT, filter(None, ['drone.example.org', '']), 'secret')
    behind_a_proxy = scope(cookie=COOKIE, host='drone.example.org', origin='https://drone.example.org')
    assert gate.look(behind_a_proxy) is None
