"""The last check of a velocity command before a vehicle: frame, numbers, age, speed and fence.

On doubt the answer is zero velocity, with the reason in words.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from advise_ros.core.grid import Grid

Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)
AXES = ('east', 'north', 'up')
MAP_FRAME = 'map'

# Generous, as simulated clocks that run fast arrive late.
FUTURE_NS, BACKWARD_NS = 5_000_000_000, 1_000_000_000


class Fence(NamedTuple):
    """A box in the map frame (ENU), metres; both ends belong to it."""

    low_enu_m: Vector
    high_enu_m: Vector


@dataclass(frozen=True)
class Limits:
    """What a command must keep to.

    Attributes:
        max_speed_m_s: horizontal.
        max_climb_m_s: up or down.
        braking_m_s2: deceleration that each axis can be trusted to have.
        command_timeout_s, pose_timeout_s: older ones count as missing.
        reaction_s: twice the longest time from a pose to the vehicle's obeying what was made from it: when
            the next pose comes it may still fly as fast as the last one allowed.
        fence: None for no fence.
    """

    max_speed_m_s: float = 3.0
    max_climb_m_s: float = 1.5
    max_yaw_rate_rad_s: float = 1.0
    braking_m_s2: float = 2.0
    command_timeout_s: float = 0.5
    pose_timeout_s: float = 0.5
    reaction_s: float = 1.1
    fence: Fence | None = None


class Command(NamedTuple):
    """A velocity asked for, how long ago it arrived (steady time), and what is wrong with its stamp."""

    velocity_enu_m_s: Vector
    frame_id: str
    age_s: float
    yaw_rate_rad_s: float = 0.0
    doubt: str = ''


class Position(NamedTuple):
    """Where the vehicle was, and how long ago that arrived (steady time)."""

    position_enu_m: Vector
    frame_id: str
    age_s: float


class Verdict(NamedTuple):
    """The velocity to fly; `reason` is '' when it is the one asked for."""

    velocity_enu_m_s: Vector
    yaw_rate_rad_s: float
    reason: str


def fence_around(grid: Grid, margin_m: float, altitude_band_m: float) -> Fence:
    """The grid's rectangle grown by a margin, and a band around its altitude."""
    west, south = grid.origin_enu_m
    east, north = west + grid.width * grid.resolution_m, south + grid.height * grid.resolution_m
    return Fence(
        (west - margin_m, south - margin_m, grid.altitude_m - altitude_band_m),
        (east + margin_m, north + margin_m, grid.altitude_m + altitude_band_m),
    )


def stamp_doubt(stamp_ns: int, newest_ns: int, now_ns: int) -> str:
    """What is wrong with a command's stamp, or ''; a stamp of 0 says nothing.

    Args:
        stamp_ns: of the command.
        newest_ns: the newest stamp among commands that are not stale yet, 0 if there is none.
        now_ns: our clock, 0 if it has not begun.
    """
    if stamp_ns <= 0:
        return ''
    if now_ns > 0 and stamp_ns > now_ns + FUTURE_NS:
        return f'its stamp is {(stamp_ns - now_ns) / 1e9:.1f} s in the future; is use_sim_time the same everywhere?'
    if stamp_ns + BACKWARD_NS < newest_ns:
        return f'its stamp is {(newest_ns - stamp_ns) / 1e9:.1f} s before that of another command; let one node fly at a time'
    return ''


def check(command: Command | None, position: Position | None, limits: Limits) -> Verdict:
    """The velocity that may be flown now.

    The speed is never above the limits (scaled down, direction kept). Toward the fence it is so low that a
    vehicle that stops hearing us after this command, and brakes each axis at `braking_m_s2`, stands before
    the fence. Outside the fence only motion back inward passes.
    """
    doubt = _doubt(command, position, limits)
    if doubt or command is None or position is None:
        return Verdict(ZERO, 0.0, doubt)
    velocity, slowed = _limited(command.velocity_enu_m_s, limits)
    yaw_rate = max(-limits.max_yaw_rate_rad_s, min(limits.max_yaw_rate_rad_s, command.yaw_rate_rad_s))
    if limits.fence is None:
        return Verdict(velocity, yaw_rate, slowed)
    inside, fenced = _fenced(velocity, position.position_enu_m, limits, limits.fence)
    return Verdict(inside, yaw_rate, '; '.join(reason for reason in (slowed, fenced) if reason))


def _doubt(command: Command | None, position: Position | None, limits: Limits) -> str:
    """Why nothing may be flown, or ''."""
    if command is None:
        return 'no command yet'
    if command.doubt:
        return f'command refused: {command.doubt}'
    if command.frame_id != MAP_FRAME:
        return f"command refused: its frame is '{command.frame_id}'; it must be '{MAP_FRAME}' (ENU)"
    if not _finite(command.velocity_enu_m_s) or not math.isfinite(command.yaw_rate_rad_s):
        return 'command refused: it is not finite'
    if not 0.0 <= command.age_s <= limits.command_timeout_s:
        return f'command older than {limits.command_timeout_s:g} s'
    if position is None:
        return 'no pose yet'
    if position.frame_id != MAP_FRAME:
        return f"pose refused: its frame is '{position.frame_id}'; it must be '{MAP_FRAME}' (ENU)"
    if not _finite(position.position_enu_m):
        return 'pose refused: it is not finite'
    if not 0.0 <= position.age_s <= limits.pose_timeout_s:
        return f'pose older than {limits.pose_timeout_s:g} s'
    return ''


def _finite(vector: Vector) -> bool:
    return all(math.isfinite(value) for value in vector)


def _limited(velocity: Vector, limits: Limits) -> tuple[Vector, str]:
    east, north, up = velocity
    horizontal = math.hypot(east, north)
    scale, reason = 1.0, ''
    if horizontal > limits.max_speed_m_s:
        scale, reason = limits.max_speed_m_s / horizontal, f'speed limited to {limits.max_speed_m_s:g} m/s'
    if abs(up) * scale > limits.max_climb_m_s:
        scale, reason = limits.max_climb_m_s / abs(up), f'climb limited to {limits.max_climb_m_s:g} m/s'
    return (east * scale, north * scale, up * scale), reason


def stopping_speed_m_s(distance_m: float, braking_m_s2: float, reaction_s: float) -> float:
    """Highest speed v from which v * reaction + v^2 / (2 braking) fits into a distance."""
    if distance_m <= 0.0:
        return 0.0
    # The root in the form that loses no digits for short distances.
    return 2.0 * distance_m / (reaction_s + math.sqrt(reaction_s**2 + 2.0 * distance_m / braking_m_s2))


def _fenced(velocity: Vector, position: Vector, limits: Limits, fence: Fence) -> tuple[Vector, str]:
    outside = [axis for axis in range(3) if not fence.low_enu_m[axis] <= position[axis] <= fence.high_enu_m[axis]]
    if outside:
        return _inward(velocity, position, outside, fence)
    allowed = [
        _toward(velocity[axis], position[axis], (fence.low_enu_m[axis], fence.high_enu_m[axis]), limits)
        for axis in range(3)
    ]
    slowed = [AXES[axis] for axis in range(3) if allowed[axis] != velocity[axis]]
    reason = f'fence ahead: {", ".join(slowed)} limited' if slowed else ''
    return (allowed[0], allowed[1], allowed[2]), reason


def _toward(speed: float, at: float, ends: tuple[float, float], limits: Limits) -> float:
    low, high = ends
    upper = stopping_speed_m_s(high - at, limits.braking_m_s2, limits.reaction_s)
    lower = -stopping_speed_m_s(at - low, limits.braking_m_s2, limits.reaction_s)
    return max(lower, min(upper, speed))


def _inward(velocity: Vector, position: Vector, outside: list[int], fence: Fence) -> tuple[Vector, str]:
    inward = [0.0, 0.0, 0.0]
    for axis in outside:
        below = position[axis] < fence.low_enu_m[axis]
        inward[axis] = max(0.0, velocity[axis]) if below else min(0.0, velocity[axis])
    names = ', '.join(AXES[axis] for axis in outside)
    return (inward[0], inward[1], inward[2]), f'outside the fence ({names}): only motion back inward is flown'
