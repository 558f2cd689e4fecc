"""A bad radio on loopback: a UDP relay that loses, delays, reorders and cuts, and writes down what passes.

`wire` is the radio: it loses, and its jitter lets datagrams overtake others. `delay` is a queue before it, for each
direction: late by what support/delays.py says, nothing lost, nothing overtaken.
"""

from __future__ import annotations

import heapq
import selectors
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from advise_ros.mavlink.framing import Framer
from advise_ros.mavlink.messages import Message
from support.delays import Delay, Queue, steady

Address = tuple[str, int]
LONGEST_WAIT_S = 0.2


@dataclass(frozen=True)
class Wire:
    """How bad the radio is, in both directions.

    Attributes:
        loss: share of datagrams that vanish.
        delay_s: added to each one.
        jitter_s: up to this much more, each drawn by itself, so that later ones overtake earlier ones.
        cut: nothing passes.
    """

    loss: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    cut: bool = False


GOOD = Wire()


class LossyProxy:
    """Relays between a vehicle that sends to `port` and a companion that listens on another port.

    Attributes:
        wire: how bad it is now; replace it at any time.
        port: where the vehicle sends to.
        passed: datagrams handed on, by direction: to the companion, to the vehicle.
        latest_s: how late the newest of them was, by direction.
    """

    def __init__(self, companion_port: int, rng: np.random.Generator, on_message: Callable[[str, Message, float], Any]) -> None:
        """Start; `on_message(direction, message, steady_s)` sees what enters, 'up' from the vehicle or 'down' to it."""
        self.wire = GOOD
        self.passed = {'up': 0, 'down': 0}
        self.latest_s = {'up': 0.0, 'down': 0.0}
        self._rng, self._on_message = rng, on_message
        self._companion: Address = ('127.0.0.1', companion_port)
        self._vehicle: Address | None = None
        self._sockets = {'up': _bound(), 'down': _bound()}  # Each hears one side and speaks to it.
        self._framers = {'up': Framer(), 'down': Framer()}
        self._waiting: list[tuple[float, int, str, bytes, float]] = []
        self._number = 0
        self._queues = {direction: Queue(steady(0.0), time.monotonic()) for direction in ('up', 'down')}
        self._closing = False
        self._thread = threading.Thread(target=self._run, name='lossy-proxy', daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        return int(self._sockets['up'].getsockname()[1])

    def delay(self, direction: str, delay: Delay) -> None:
        """Be late from now on in a direction: 'up' from the vehicle, 'down' to it. Each may be changed at any time."""
        self._queues[direction] = self._queues[direction].changed(delay, time.monotonic())

    def tell_vehicle(self, data: bytes) -> None:
        """Send it something of our own, once it has spoken."""
        if self._vehicle is not None:
            self._sockets['up'].sendto(data, self._vehicle)

    def close(self) -> None:
        self._closing = True
        self._thread.join(5)
        for side in self._sockets.values():
            side.close()

    def _run(self) -> None:
        with selectors.DefaultSelector() as selector:
            for direction, side in self._sockets.items():
                selector.register(side, selectors.EVENT_READ, direction)
            while not self._closing:
                for key, _ in selector.select(self._wait_s()):
                    self._take(key.data)
                self._hand_on()

    def _wait_s(self) -> float:
        if not self._waiting:
            return LONGEST_WAIT_S
        return min(LONGEST_WAIT_S, max(0.0, self._waiting[0][0] - time.monotonic()))

    def _take(self, direction: str) -> None:
        try:
            data, sender = self._sockets[direction].recvfrom(65536)
        except (ConnectionError, BlockingIOError):  # The other side is not there; its refusal comes back as an error.
            return
        now_s = time.monotonic()
        if direction == 'up':
            self._vehicle = sender
        for message in self._framers[direction].datagram(data):
            self._on_message(direction, message, now_s)
        wire = self.wire
        if wire.cut or self._rng.random() < wire.loss:
            return
        self._number += 1
        due_s = self._queues[direction].due_s(now_s) + wire.delay_s + wire.jitter_s * self._rng.random()
        heapq.heappush(self._waiting, (due_s, self._number, direction, data, now_s))

    def _hand_on(self) -> None:
        now_s = time.monotonic()
        while self._waiting and self._waiting[0][0] <= now_s:
            _, _, direction, data, taken_s = heapq.heappop(self._waiting)
            to = self._companion if direction == 'up' else self._vehicle
            if self.wire.cut or to is None:
                continue
            self.latest_s[direction] = now_s - taken_s
            try:
                self._sockets['down' if direction == 'up' else 'up'].sendto(data, to)
                self.passed[direction] += 1
            except ConnectionError:
                continue


def _bound() -> socket.socket:
    side = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    side.bind(('127.0.0.1', 0))
    side.setblocking(False)
    return side
