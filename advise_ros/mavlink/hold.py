"""How a PX4 is made to stand, which zero velocity does not: it wanders off by 6 to 9 m a minute.

A place is held wherever no motion is asked for: in plan, in height, or both. The place is where the vehicle
will have stopped, as a place that it has left already makes it overshoot and fly back. ArduPilot stands at
zero velocity and is never given a place: it would fly after one when its estimate jumps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from advise_ros.core.units import Vector
from advise_ros.mavlink.vehicle import Motion

# The vehicle stops where its velocity leads it in this time.
STOP_S = 0.7
# Faster than this, zero velocity slows it down first: what a place does is known below only.
SLOW_M_S = 1.5
# A place this many seconds of the velocity away is flown to at that velocity (MPC_Z_P is 1).
LEAD_S = 1.0
# PX4 comes as far off its place as its velocity estimate is off (m/s), as its position gain is 1: from this long after it
# was given a place, the place that is asked for is farther on the other side, up to a limit. That is for prompt links: late
# positions would make it swing.
STOPPED_S, STIFFER, FURTHEST_M = 2.0, 1.4, 0.7
PROMPT_S = 0.25
# After this long without being asked for, the next place is a new one.
FORGET_S = 0.5


class HoldTarget(NamedTuple):
    """What to ask for in ENU: of each axis its place (metres) or, where that is None, its velocity (metres a second)."""

    place_enu_m: tuple[float | None, float | None, float | None]
    velocity_enu_m_s: Vector


NO_PLACE = (None, None, None)


class Hold:
    """Turns velocities into places where they are zero; places are kept until motion is asked for, or a doubt."""

    def __init__(self) -> None:
        self._plan: tuple[float, float] | None = None
        self._height_m: float | None = None
        self._asked_s = self._plan_s = self._height_s = -math.inf

    def wanted(self, velocity_enu_m_s: Vector, motion: Motion | None, now_s: float, *, prompt: bool = False) -> HoldTarget:
        """What to ask for instead of a velocity.

        Args:
            velocity_enu_m_s: (3,), zero in plan or in height where it shall stand.
            motion: the newest position and velocity; None while they are old or doubted: no place then.
            now_s: steady time.
            prompt: it takes less than PROMPT_S to the autopilot and back.
        """
        if motion is None or now_s - self._asked_s > FORGET_S:
            self._plan = self._height_m = None
        self._asked_s = now_s
        if motion is None:
            return HoldTarget(NO_PLACE, velocity_enu_m_s)
        east, north, up = velocity_enu_m_s
        self._hold_plan(motion, now_s, moves=bool(east or north))
        self._hold_height(motion, now_s, moves=bool(up))
        x, y, z = motion.position_enu_m
        height_m = None if self._height_m is None else _stiff(self._height_m, z, now_s - self._height_s, prompt)
        if self._plan is None:
            return HoldTarget((None, None, height_m), velocity_enu_m_s)
        # A place in plan beside a velocity up was never tried on a real one: the height runs ahead instead.
        held_s = now_s - self._plan_s
        plan = _stiff(self._plan[0], x, held_s, prompt), _stiff(self._plan[1], y, held_s, prompt)
        return HoldTarget((*plan, z + LEAD_S * up if height_m is None else height_m), velocity_enu_m_s)

    def _hold_plan(self, motion: Motion, now_s: float, *, moves: bool) -> None:
        (x, y, _), (vx, vy, _) = motion.position_enu_m, motion.velocity_enu_m_s
        if moves:
            self._plan = None
        elif self._plan is None and math.hypot(vx, vy) <= SLOW_M_S:
            self._plan, self._plan_s = (x + STOP_S * vx, y + STOP_S * vy), now_s

    def _hold_height(self, motion: Motion, now_s: float, *, moves: bool) -> None:
        if moves:
            self._height_m = None
        elif self._height_m is None:
            self._height_m, self._height_s = motion.position_enu_m[2] + STOP_S * motion.velocity_enu_m_s[2], now_s

    def stand_at(self, motion: Motion, now_s: float) -> None:
        """The vehicle stands on the ground: it is to climb above this place, whatever velocity its estimate has.

        Args:
            motion: position and velocity by the estimator.
            now_s: steady time.
        """
        self._plan, self._height_m, self._asked_s = motion.position_enu_m[:2], None, now_s
        self._plan_s = now_s


def _stiff(place_m: float, at_m: float, held_s: float, prompt: bool) -> float:
    """What to ask for so that a place is held more stiffly than by the place alone."""
    off_m = STIFFER * (place_m - at_m) if prompt and held_s >= STOPPED_S else 0.0
    return place_m + min(FURTHEST_M, max(-FURTHEST_M, off_m))
