"""A guard in closed loop with a vehicle that obeys late, in wind, over links that fail; for tests and benchmarks."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from advise_ros.core.fence import Fence, corners_from_text, nearest, outside_m
from advise_ros.core.guard import Command, Limits
from advise_ros.core.guard_monitor import GuardMonitor, MonitorSettings

TICK_S = 0.05
BRAKING_M_S2, POSE_TIMEOUT_S = 2.0, 0.5
# Of a position on its way here, of a command on its way to its effect; the guard is told both, and a tick.
POSE_LATE_S, OBEYED_LATE_S = 0.1, 0.2
DELAY_S = POSE_LATE_S + OBEYED_LATE_S + TICK_S
# How far gusts carry the vehicle off the track that its autopilot holds.
GUST_M = 0.25
# The documented bound: gusts may carry it from one end of their range to the other while it cannot see.
BOUND_M = 2.0 * GUST_M

FENCES = (
    '-10,-10 10,-10 10,10 -10,10', '0,0 12,0 12,6 6,6 6,12 0,12', '-8,0 0,-8 8,0 0,8', '0,-6 10,-6 10,6 0,6 4,0',
)


@dataclass
class Episode:
    """One flight of a pilot who means to leave.

    Attributes:
        worst_m: furthest outside in plan or altitude so far.
        side: to which of both sides along the fence he weaved last.
    """

    rng: np.random.Generator
    fence: Fence
    position: np.ndarray
    braking_m_s2: float
    delay_s: float
    pose_period_s: float
    pose_late_s: float
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    gust: np.ndarray = field(default_factory=lambda: np.zeros(3))
    worst_m: float = 0.0
    side: float = 1.0

    @property
    def true_position(self) -> np.ndarray:
        return self.position + self.gust

    def fly(self, seconds: float) -> float:
        """The whole episode; returns `worst_m`."""
        reaction_s = 2.0 * (POSE_TIMEOUT_S + TICK_S + DELAY_S)
        monitor = GuardMonitor(Limits(
            max_speed_m_s=4.0, max_climb_m_s=2.0, braking_m_s2=BRAKING_M_S2, pose_timeout_s=POSE_TIMEOUT_S,
            reaction_s=reaction_s, fence=self.fence,
        ), MonitorSettings())
        obeyed: deque[tuple[float, np.ndarray]] = deque()
        poses: deque[tuple[float, np.ndarray]] = deque()
        wanted, wish, wish_until, pose_due = np.zeros(3), np.zeros(3), 0.0, 0.0
        blind_until = deaf_until = 0.0
        for tick in range(round(seconds / TICK_S)):
            now_s = tick * TICK_S
            if now_s >= wish_until:
                wish, wish_until = self._wish(), now_s + self.rng.uniform(0.5, 4.0)
            if self.rng.random() < 0.01:
                blind_until = now_s + self.rng.uniform(0.0, 3.0)
            if self.rng.random() < 0.005:
                deaf_until = now_s + self.rng.uniform(0.0, 2.0)
            if now_s >= pose_due:
                pose_due = now_s + self.pose_period_s
                if now_s >= blind_until:
                    poses.append((now_s + self.pose_late_s, self.true_position.copy()))
            while poses and poses[0][0] <= now_s:
                at = poses.popleft()[1]
                monitor.pose((float(at[0]), float(at[1]), float(at[2])), 'map', now_s)
            if now_s >= deaf_until:
                monitor.command(Command((float(wish[0]), float(wish[1]), float(wish[2])), 'map', 0.0), now_s)
            verdict = monitor.verdict(now_s)
            obeyed.append((now_s + self.delay_s, np.array(verdict.velocity_enu_m_s if verdict else (0.0, 0.0, 0.0))))
            while obeyed and obeyed[0][0] <= now_s:
                wanted = obeyed.popleft()[1]
            self._move(wanted)
        return self.worst_m

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
        for _ in range(5):
            step_s = TICK_S / 5
            change = wanted - self.velocity
            for part in (slice(0, 2), slice(2, 3)):  # Thrust and tilt are two things.
                size = math.hypot(*change[part])
                if size > self.braking_m_s2 * step_s:
                    change[part] *= self.braking_m_s2 * step_s / size
            self.position = self.position + (self.velocity + change / 2) * step_s
            self.velocity = self.velocity + change
        kept = math.exp(-TICK_S / 1.0)
        drawn = kept * self.gust + math.sqrt(1 - kept**2) * 0.6 * GUST_M * self.rng.standard_normal(3)
        reach = np.array([GUST_M / math.sqrt(2), GUST_M / math.sqrt(2), GUST_M])
        self.gust = np.clip(drawn, -reach, reach)
        at = self.true_position
        high = max(at[2] - self.fence.high_m, self.fence.low_m - at[2], 0.0)
        self.worst_m = max(self.worst_m, float(high), outside_m(self.fence, (float(at[0]), float(at[1]))))


def episode(seed: int, number: int, late_s: float = POSE_LATE_S + OBEYED_LATE_S) -> Episode:
    """Episode `number` of a series: its fence, its vehicle and its links, which are late by at most `late_s` together."""
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
    )
