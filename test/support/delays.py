"""How late a link delivers, as a function of when something is sent; nothing is lost and nothing overtakes (FIFO)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

# Seconds since the delay began -> seconds of delay.
Delay = Callable[[float], float]


def steady(delay_s: float) -> Delay:
    """Always as late, from the first datagram on."""
    return lambda _: delay_s


def growing(rate: float, most_s: float, from_s: float = 0.0) -> Delay:
    """Later and later, by `rate` seconds a second: a queue that fills."""
    return lambda since_s: min(from_s + rate * since_s, most_s)


def jittering(delay_s: float, jitter_s: float, rng: np.random.Generator) -> Delay:
    """Each late by its own share; FIFO keeps the order, so one that is late holds up those behind it."""
    return lambda _: delay_s + jitter_s * float(rng.random())


def stalling(period_s: float, stall_s: float) -> Delay:
    """A relay that starves: for `stall_s` of each period nothing comes, then all of it at once."""
    def delay(since_s: float) -> float:
        phase_s = math.fmod(since_s, period_s)
        return stall_s - phase_s if phase_s < stall_s else 0.0

    return delay


@dataclass
class Queue:
    """When each thing comes out of a delay, never before the one ahead of it."""

    delay: Delay
    began_s: float
    last_s: float = -math.inf

    def due_s(self, now_s: float) -> float:
        self.last_s = max(now_s + self.delay(now_s - self.began_s), self.last_s)
        return self.last_s

    def changed(self, delay: Delay, now_s: float) -> Queue:
        """Another delay from now on; what is under way stays ahead."""
        return Queue(delay, now_s, self.last_s)
