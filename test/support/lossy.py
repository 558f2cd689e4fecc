"""A bad link: datagrams are lost, late, overtaken or cut off. `Wire` in any time, `LossyProxy` on loopback in real time."""

from __future__ import annotations

import heapq
import itertools
import select
import socket
import threading
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from support import reserve


@dataclass
class Wire:
    """One direction of a link.

    Attributes:
        loss: share of datagrams that never arrive.
        delay_s, jitter_s: each takes between delay and delay + jitter, so with jitter some overtake others.
        cut: nothing gets in, and nothing comes out.
    """

    rng: np.random.Generator
    loss: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    cut: bool = False
    _held: list[tuple[float, int, Any]] = field(default_factory=list)
    _count: itertools.count = field(default_factory=itertools.count)  # type: ignore[type-arg]

    def put(self, datagram: Any, now_s: float) -> None:
        """Send something."""
        lost, late = self.rng.random() < self.loss, self.delay_s + self.jitter_s * self.rng.random()
        if not (lost or self.cut):
            heapq.heappush(self._held, (now_s + late, next(self._count), datagram))

    def due(self, now_s: float) -> list[Any]:
        """What arrives by now."""
        arrived = []
        while self._held and self._held[0][0] <= now_s:
            arrived.append(heapq.heappop(self._held)[2])
        return [] if self.cut else arrived


class LossyProxy:
    """Stands between a vehicle (udpout to `vehicle_port`) and a companion (udpin on `companion_port`), in a thread.

    Args:
        companion_port: where the companion listens.
        seed: of losses and delays.
        quality: loss, delay_s and jitter_s of both directions.
    """

    def __init__(self, companion_port: int, seed: int, **quality: float) -> None:
        rngs = np.random.default_rng(seed).spawn(2)
        self.down, self.up = (Wire(rng, **quality) for rng in rngs)
        self._vehicle_side, self._companion_side = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        self.vehicle_port = reserve.free_udp_port()
        self._vehicle_side.bind(('127.0.0.1', self.vehicle_port))
        self._companion = ('127.0.0.1', companion_port)
        self._vehicle: Any = None
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def cut(self, off: bool) -> None:
        """Cut the link off, or give it back."""
        self.down.cut = self.up.cut = off

    def __enter__(self) -> LossyProxy:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join(5)
        self._vehicle_side.close()
        self._companion_side.close()

    def _run(self) -> None:
        sockets = [self._vehicle_side, self._companion_side]
        while not self._end.is_set():
            ready, _, _ = select.select(sockets, [], [], 0.005)
            now_s = time.monotonic()
            if self._vehicle_side in ready:
                data, self._vehicle = self._vehicle_side.recvfrom(65536)
                self.down.put(data, now_s)
            if self._companion_side in ready:
                self.up.put(self._companion_side.recv(65536), now_s)
            for data in self.down.due(now_s):
                self._companion_side.sendto(data, self._companion)
            for data in self.up.due(now_s):
                self._vehicle_side.sendto(data, self._vehicle)
