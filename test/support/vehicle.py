"""A vehicle as plain arithmetic: velocity follows the command late and lazily. For tests of what flies it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from advise_ros.core.flight.leg_follower import Pose
from advise_ros.core.units import NS, Vector

TICK_S = 0.02


@dataclass
class LazyVehicle:
    """First-order velocity response, limited acceleration, and a delay between a command and its effect."""

    position: list[float]
    response_s: float = 0.3
    acceleration_m_s2: float = 3.0
    wind_m_s: tuple[float, float] = (0.0, 0.0)
    velocity: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])

    def advance(self, command: Vector, seconds: float) -> None:
        wanted = [(c - v) / max(self.response_s, seconds) for c, v in zip(command, self.velocity, strict=True)]
        size = math.hypot(*wanted)
        scale = min(1.0, self.acceleration_m_s2 / size) if size > 0 else 0.0
        for axis in range(3):
            self.velocity[axis] += wanted[axis] * scale * seconds
            drift = self.wind_m_s[axis] if axis < 2 else 0.0
            self.position[axis] += (self.velocity[axis] + drift) * seconds


def fly(
    step: Callable[[Pose], Vector],
    vehicle: LazyVehicle,
    *,
    delay_s: Callable[[], float] = lambda: 0.0,
    pose_period_s: float = 0.1,
    limit_s: float = 600.0,
) -> Iterator[tuple[Pose, Vector]]:
    """Every pose with its command, in simulated time; a command acts `delay_s()` after its pose."""
    waiting: deque[tuple[float, Vector]] = deque()
    acting: Vector = (0.0, 0.0, 0.0)
    every = round(pose_period_s / TICK_S)
    for tick in range(round(limit_s / TICK_S)):
        now = tick * TICK_S
        if tick % every == 0:
            x, y, z = vehicle.position
            pose = Pose(round(now * NS), (x, y, z))
            command = step(pose)
            yield pose, command
            # A late command never overtakes an earlier one.
            due = max(now + delay_s(), waiting[-1][0] if waiting else 0.0)
            waiting.append((due, command))
        while waiting and waiting[0][0] <= now:
            acting = waiting.popleft()[1]
        vehicle.advance(acting, TICK_S)
