"""A guard in closed loop with a vehicle that obeys late, in wind, over links that fail; for tests and benchmarks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from advise_ros.core.guard.fence import Fence, corners_from_text, nearest, outside_m
from advise_ros.core.guard.monitor import DRIFT_M_S, SETTLED_S, GuardMonitor, MonitorSettings
from advise_ros.core.guard.rules import Command, Limits
from advise_ros.core.units import NS
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.timesync import Timesync
from support.late_line import KINDS, LONGEST_S, LateLine

TICK_S = 0.05
BRAKING_M_S2, POSE_TIMEOUT_S, MAX_SPEED_M_S = 2.0, 0.5, 4.0
# Of a position on its way here, of a command on its way to its effect; the guard is told both, and a tick.
POSE_LATE_S, OBEYED_LATE_S = 0.1, 0.2
DELAY_S = POSE_LATE_S + OBEYED_LATE_S + TICK_S
# The vehicle's clock, and how long it flies on by itself (GUID_TIMEOUT, COM_OF_LOSS_T as recommended).
BOOT_S, AUTOPILOT_TIMEOUT_S = 100.0, 1.0
# How far gusts carry the vehicle off the track that its autopilot holds.
GUST_M = 0.25
REACH = np.array([GUST_M / math.sqrt(2), GUST_M / math.sqrt(2), GUST_M])
# The documented bound: gusts may carry it from one end of their range to the other while it cannot see.
BOUND_M = 2.0 * GUST_M

FENCES = (
    '-10,-10 10,-10 10,10 -10,10', '0,0 12,0 12,6 6,6 6,12 0,12', '-8,0 0,-8 8,0 0,8', '0,-6 10,-6 10,6 0,6 4,0',
)


@dataclass(frozen=True)
class Troubles:
    """What an episode adds to gusts and losses.

    Attributes:
        down, up: how positions and commands are late, see `LateLine`.
        down_s, up_s: by at most this much.
        drift_m_s: the velocity is off by a random walk within this, each way.
        jumps: whether positions jump for up to 0.8 s.
    """

    down: str = 'none'
    up: str = 'none'
    down_s: float = 0.0
    up_s: float = 0.0
    drift_m_s: float = 0.0
    jumps: bool = False


@dataclass
class Episode:
    """One flight of a pilot who means to leave.

    Attributes:
        worst_m: furthest outside in plan or altitude so far.
        unseen_s: the longest time in which no position was sent that is to be trusted.
        side: to which of both sides along the fence he weaved last.
    """

    rng: np.random.Generator
    fence: Fence
    position: np.ndarray
    braking_m_s2: float
    delay_s: float
    pose_period_s: float
    pose_late_s: float
    troubles: Troubles = Troubles()
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    gust: np.ndarray = field(default_factory=lambda: np.zeros(3))
    drift: np.ndarray = field(default_factory=lambda: np.zeros(3))
    glitch: np.ndarray = field(default_factory=lambda: np.zeros(3))
    worst_m: float = 0.0
    unseen_s: float = 0.0
    side: float = 1.0

    @property
    def true_position(self) -> np.ndarray:
        return self.position + self.gust

    @property
    def bound_m(self) -> float:
        """As docs/safety.md has it: gusts, the drift for as long as it cannot be seen or answered, old commands flown on."""
        late_s = POSE_TIMEOUT_S + DELAY_S + self.unseen_s + self.down.longest_s + self.up.longest_s
        flown_on_m = MAX_SPEED_M_S * AUTOPILOT_TIMEOUT_S if self.troubles.up == 'jitter' else 0.0
        return BOUND_M + self.troubles.drift_m_s * late_s + flown_on_m

    def fly(self, seconds: float) -> float:
        """The whole episode; returns `worst_m`."""
        self._begin(seconds)
        for tick in range(round(seconds / TICK_S)):
            now_s = tick * TICK_S
            self._change_mind(now_s)
            self._send(now_s)
            for at_s, what in self.down.take(now_s):
                self._hear(what, at_s)
            self._command(now_s)
            for at_s, what in self.up.take(now_s):
                self._obey(what, at_s)
            self._move(self.wanted if now_s - self.obeyed_s <= AUTOPILOT_TIMEOUT_S else np.zeros(3))
        return self.worst_m

    def _begin(self, seconds: float) -> None:
        self.monitor = GuardMonitor(Limits(
            max_speed_m_s=MAX_SPEED_M_S, max_climb_m_s=2.0, braking_m_s2=BRAKING_M_S2, pose_timeout_s=POSE_TIMEOUT_S,
            reaction_s=2.0 * (POSE_TIMEOUT_S + DELAY_S), fence=self.fence,
        ), MonitorSettings(vehicle_delay_s=DELAY_S - TICK_S, lifts=True))
        self.timesync, troubles = Timesync(), self.troubles
        self.down = LateLine(self.rng, troubles.down, self.pose_late_s, troubles.down_s, seconds)
        self.up = LateLine(self.rng, troubles.up, self.delay_s, troubles.up_s, seconds)
        self.wanted, self.obeyed_s, self.seen_s, self.pose_due_s = np.zeros(3), 0.0, 0.0, 0.0
        self.wish, self.wish_until_s = np.zeros(3), 0.0
        self.blind_until_s = self.deaf_until_s = self.glitch_until_s = 0.0

    def _change_mind(self, now_s: float) -> None:
        """What the pilot wants, and what fails."""
        rng = self.rng
        if now_s >= self.wish_until_s:
            self.wish, self.wish_until_s = self._wish(), now_s + rng.uniform(0.5, 4.0)
        if rng.random() < 0.01:
            self.blind_until_s = now_s + rng.uniform(0.0, 3.0)
        if rng.random() < 0.005:
            self.deaf_until_s = now_s + rng.uniform(0.0, 2.0)
        if self.troubles.jumps and rng.random() < 0.004:
            self.glitch, self.glitch_until_s = rng.uniform(4.0, 20.0) * unit(rng), now_s + rng.uniform(0.05, 0.8)

    def _send(self, now_s: float) -> None:
        """The vehicle its position, the guard's computer a question."""
        if now_s >= self.pose_due_s:
            self.pose_due_s = now_s + self.pose_period_s
            if now_s >= self.blind_until_s:
                if now_s >= self.glitch_until_s + SETTLED_S:
                    self.unseen_s, self.seen_s = max(self.unseen_s, now_s - self.seen_s), now_s
                self.down.put((now_s, self.true_position + (self.glitch if now_s < self.glitch_until_s else 0.0)), now_s)
        for question in self.timesync.due(now_s):
            self.up.put(question, now_s)

    def _hear(self, what: Any, at_s: float) -> None:
        if isinstance(what, tuple):
            east, north, up = (float(value) for value in what[1])
            self.monitor.pose((east, north, up), 'map', at_s, stamp_ns=round((BOOT_S + what[0]) * NS))
            return
        self.timesync.take(what, at_s)
        if self.timesync.bounds is not None:
            self.monitor.clock_bounds(*self.timesync.bounds, at_s)

    def _command(self, now_s: float) -> None:
        monitor, round_trip_s = self.monitor, self.timesync.round_trip_s(now_s)
        if round_trip_s is not None:
            monitor.round_trip(round_trip_s)
        if now_s >= self.deaf_until_s:
            east, north, up = (float(value) for value in self.wish)
            monitor.command(Command((east, north, up), 'map', 0.0), now_s)
        verdict = monitor.verdict(now_s)
        self.up.put(np.array(verdict.velocity_enu_m_s if verdict else (0.0, 0.0, 0.0)), now_s)

    def _obey(self, what: Any, at_s: float) -> None:
        if isinstance(what, np.ndarray):
            self.wanted, self.obeyed_s = what, at_s
        else:
            self.down.put(mav.dialect.MAVLink_timesync_message(round((BOOT_S + at_s) * NS), what.ts1), at_s)

    def _wish(self) -> np.ndarray:
        """Mostly at the fence, straight or weaving, as fast as it will."""
        if self.rng.random() < 0.2:
            return self.rng.uniform(-6.0, 6.0, 3)
        edge = self.fence.edges[self.rng.integers(len(self.fence.edges))]
        at = (float(self.position[0]), float(self.position[1]))
        near = nearest(edge, at)
        away = np.array([near[0] - at[0], near[1] - at[1], self.rng.uniform(-3.0, 3.0)])
        size = math.hypot(*away[:2])
        if self.rng.random() < 0.5:
            self.side = -self.side
            along = self.side * self.rng.uniform(0.0, 2.0)
            away += along * np.array([-away[1], away[0], 0.0])
        return away * (self.rng.uniform(0.5, 50.0) / max(size, 0.1))

    def _move(self, wanted: np.ndarray) -> None:
        """In plain numbers, as arrays of three take most of the time."""
        moved, velocity = list(map(float, self.position)), list(map(float, self.velocity))
        target, drift = list(map(float, wanted)), list(map(float, self.drift))
        step_s = TICK_S / 5
        for _ in range(5):
            change = [to - now for to, now in zip(target, velocity, strict=True)]
            level, upright = math.hypot(change[0], change[1]), abs(change[2])
            most = self.braking_m_s2 * step_s  # Thrust and tilt are two things.
            shares = (min(1.0, most / max(level, 1e-12)),) * 2 + (min(1.0, most / max(upright, 1e-12)),)
            for axis in range(3):
                gained = change[axis] * shares[axis]
                moved[axis] += (velocity[axis] + drift[axis] + gained / 2) * step_s
                velocity[axis] += gained
        self.position, self.velocity = np.array(moved), np.array(velocity)
        self._blow()
        east, north, up = (float(value) for value in self.true_position)
        high = max(up - self.fence.high_m, self.fence.low_m - up, 0.0)
        self.worst_m = max(self.worst_m, high, outside_m(self.fence, (east, north)))

    def _blow(self) -> None:
        """Gusts come and go within a second, the drift walks slowly."""
        most = self.troubles.drift_m_s
        if most:
            walked = self.drift + 0.3 * most * math.sqrt(TICK_S) * self.rng.standard_normal(3)
            self.drift = walked * min(1.0, most / max(float(np.linalg.norm(walked)), 1e-9))
        kept = math.exp(-TICK_S / 1.0)
        drawn = kept * self.gust + math.sqrt(1 - kept**2) * 0.6 * GUST_M * self.rng.standard_normal(3)
        self.gust = np.clip(drawn, -REACH, REACH)


def unit(rng: np.random.Generator) -> np.ndarray:
    """A direction, (3,), nearly level."""
    angle = rng.uniform(0.0, 2.0 * math.pi)
    return np.array([math.cos(angle), math.sin(angle), 0.1])


def troubles_of(rng: np.random.Generator) -> Troubles:
    """Delays of any kind in either direction, drift and jumps; each of them in most episodes."""
    down, up = (KINDS[rng.integers(len(KINDS))] for _ in range(2))
    down_s, up_s = (float(rng.uniform(0.0, LONGEST_S)) ** rng.uniform(0.5, 1.0) for _ in range(2))
    return Troubles(down, up, down_s, up_s, DRIFT_M_S * float(rng.random() < 0.75), bool(rng.random() < 0.5))


def episode(
    seed: int, number: int, late_s: float = POSE_LATE_S + OBEYED_LATE_S, *, troubled: bool = False,
) -> Episode:
    """Episode `number` of a series: its fence, its vehicle and its links, which are late by at most `late_s` together.

    `troubled`: with drift, positions that jump, and up to LONGEST_S more delay in either direction.
    """
    share = late_s / (POSE_LATE_S + OBEYED_LATE_S)
    rng = np.random.default_rng([seed, number])
    fence = Fence(corners_from_text(FENCES[number % len(FENCES)]), 2.0, 12.0)
    while True:
        start = rng.uniform(-10.0, 12.0, 2)
        if outside_m(fence, (float(start[0]), float(start[1]))) == 0.0:
            break
    return Episode(
        rng, fence, np.array([*start, 6.0]), braking_m_s2=rng.uniform(BRAKING_M_S2, 5.0),
        delay_s=share * rng.uniform(0.0, OBEYED_LATE_S),
        pose_period_s=rng.uniform(0.05, 0.2), pose_late_s=share * rng.uniform(0.0, POSE_LATE_S),
        troubles=troubles_of(rng) if troubled else Troubles(),
    )
