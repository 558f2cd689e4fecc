"""Who may see the page and act on it: its own browser window, with the token, through its own address.

A page of another site can make a browser call this server (cross-site request forgery), read it under another name
(DNS rebinding) or show it in a frame (clickjacking); each check below is there for one of these.
"""

from __future__ import annotations

import hmac
import secrets
import time
from collections.abc import Awaitable, Callable, Iterable, Mapping, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any, NamedTuple
from urllib.parse import parse_qs

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

# A person's act is small: an answer with the states of a split on the largest grid fits.
FRAME_MAX_BYTES = 1_000_000
# Messages of a browser: so many a second, and so many at once.
RATE_HZ, BURST = 30.0, 150.0
TOO_BIG, TOO_MANY = 1009, 1008
HEADERS = (
    (b'content-security-policy', (
        b"default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        b"img-src 'self' data:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )),
    (b'x-frame-options', b'DENY'),
    (b'x-content-type-options', b'nosniff'),
    (b'referrer-policy', b'no-referrer'),
)


class Refusal(NamedTuple):
    """Why a request is refused; `status` of HTTP."""

    status: int
    sentence: str


class Gate:
    """Decides about a request from its headers alone.

    Args:
        port: the server's.
        hosts: further names that a reverse proxy serves the page under, e.g. 'drone.example.org'.
        token: '' makes a random one.
    """

    def __init__(self, port: int, hosts: Iterable[str] = (), token: str = '') -> None:
        self.token = token or secrets.token_urlsafe(24)
        hosts = tuple(hosts)
        own = [f'{name}:{port}' for name in ('127.0.0.1', 'localhost')]
        self._hosts = frozenset(name.lower() for name in (*own, *hosts))
        self._origins = frozenset(f'http://{name}' for name in own) | frozenset(
            f'https://{name.lower()}' for name in hosts
        )
        self._cookie = f'advise_console_{port}'

    def look(self, scope: Scope) -> Refusal | None:
        """Why not, None when it may pass."""
        headers = _headers(scope)
        origin = headers.get('origin')
        websocket = scope['type'] == 'websocket'
        if headers.get('host', '').lower() not in self._hosts:
            return Refusal(421, 'This page is not served under that name; use the printed address, or set allowed_hosts.')
        if (origin is None and websocket) or (origin is not None and origin.lower() not in self._origins):
            return Refusal(403, 'Another site may not use this page.')
        if not websocket and scope['method'] not in ('GET', 'HEAD'):
            return Refusal(405, 'Nothing is changed by plain requests here.')
        if not self._knows_token(headers):
            return Refusal(403, 'This page needs the address with its token, as the console prints it at its start.')
        if not websocket and scope['path'].startswith('/_nicegui_ws'):
            return Refusal(400, 'Only a WebSocket carries acts.')  # Long polling would change state by plain requests.
        return None

    def entry(self, scope: Scope) -> bytes | None:
        """The cookie for a browser that comes with the token in the address; None for any other."""
        given = parse_qs(scope.get('query_string', b'').decode('latin-1')).get('token', [''])[0]
        known = _headers(scope).get('host', '').lower() in self._hosts
        if scope['type'] != 'http' or scope['method'] != 'GET' or not known or not self._is_token(given):
            return None
        return f'{self._cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict'.encode()

    def _knows_token(self, headers: Mapping[str, str]) -> bool:
        try:
            morsel = SimpleCookie(headers.get('cookie', '')).get(self._cookie)
        except CookieError:
            return False
        return morsel is not None and self._is_token(morsel.value)

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.token.encode())


class Bucket:
    """A rate limit: `rate_hz` a second, `burst` at once."""

    def __init__(self, rate_hz: float = RATE_HZ, burst: float = BURST) -> None:
        self._rate_hz, self._burst, self._left, self._at_s = rate_hz, burst, burst, time.monotonic()

    def take(self, now_s: float) -> bool:
        """Whether one more may pass now (steady time)."""
        self._left = min(self._burst, self._left + self._rate_hz * (now_s - self._at_s))
        self._at_s = now_s
        self._left -= 1.0
        return self._left >= 0.0


class Protection:
    """ASGI middleware: asks the gate, limits what a browser sends, and adds the headers that browsers guard pages by."""

    def __init__(self, app: App, gate: Gate) -> None:
        self._app, self._gate = app, gate

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope['type'] == 'lifespan':
            await self._app(scope, receive, send)
            return
        cookie = self._gate.entry(scope)
        refusal = None if cookie else self._gate.look(scope)
        if cookie:
            await _respond(send, 303, b'', (b'location', b'/'), (b'set-cookie', cookie))
        elif refusal and scope['type'] == 'http':
            await _respond(send, refusal.status, refusal.sentence.encode(), (b'content-type', b'text/plain; charset=utf-8'))
        elif refusal:
            await send({'type': 'websocket.close', 'code': TOO_MANY, 'reason': refusal.sentence})
        elif scope['type'] == 'websocket':
            await self._app(scope, _limited(receive), send)
        else:
            await self._app(scope, receive, _guarded(send))


def _limited(receive: Receive) -> Receive:
    """The same stream, cut where a message is too big or too many come."""
    bucket = Bucket()

    async def limited() -> Message:
        message = await receive()
        if message['type'] != 'websocket.receive':
            return message
        if len(message.get('text') or message.get('bytes') or b'') > FRAME_MAX_BYTES:
            return {'type': 'websocket.disconnect', 'code': TOO_BIG}
        return message if bucket.take(time.monotonic()) else {'type': 'websocket.disconnect', 'code': TOO_MANY}

    return limited


def _guarded(send: Send) -> Send:
    async def guarded(message: Message) -> None:
        if message['type'] == 'http.response.start':
            message['headers'] = [*message.get('headers', ()), *HEADERS]
        await send(message)

    return guarded


async def _respond(send: Send, status: int, body: bytes, *headers: tuple[bytes, bytes]) -> None:
    await send({'type': 'http.response.start', 'status': status, 'headers': [*headers, *HEADERS]})
    await send({'type': 'http.response.body', 'body': body})


def _headers(scope: Scope) -> dict[str, str]:
    return {name.decode('latin-1'): value.decode('latin-1') for name, value in scope['headers']}
