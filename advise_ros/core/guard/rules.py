"""The last check of a velocity command before a vehicle: frame, numbers, age, speed and fence.

On doubt the answer is zero velocity, with the reason in words.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

from advise_ros.core.guard.fence import (
    Braking,
    Fence,
    Point,
    back_in,
    can_stop,
    keep_in,
    outside_m,
    stopping_speed_m_s,
)
from advise_ros.core.guard.flown_path import moved
from advise_ros.core.parameter import parameter
from advise_ros.core.units import MAP_FRAME, ZERO, Vector

AXES = ('east', 'north', 'up')
# Of the reaction, which counts everything twice: enough for a loop that closes late, and not felt at the limit.
STILL_TO_REACT = 2.0 / 3.0
# Of the reaction, what is left beside commands that are counted one by one.
BESIDE_UNDER_WAY = 1.0 / 3.0
UNDER_WAY = 'fence ahead: what is on its way to the vehicle leads near enough'


@dataclass(frozen=True)
class Limits:
    """What a command must keep to; most of it are parameters of /guard and /mavlink_bridge.

    Attributes:
        reaction_s: twice the longest time from a pose to the vehicle's obeying what was made from it: when
            the next pose comes it may still fly as fast as the last one allowed.
        fence: None for no fence.
    """

    max_speed_m_s: float = parameter(3.0, 'horizontal speed limit', low=0.05, high=50.0)
    max_climb_m_s: float = parameter(1.5, 'vertical speed limit', low=0.05, high=20.0)
    max_yaw_rate_rad_s: float = parameter(1.0, 'yaw rate limit', low=0.0, high=10.0)
    braking_m_s2: float = parameter(2.0, 'deceleration assumed when stopping before the fence', low=0.1, high=50.0)
    command_timeout_s: float = parameter(
        0.5, 'an older command becomes zero velocity (steady time)', low=0.05, high=60.0,
    )
    pose_timeout_s: float = parameter(0.5, 'an older pose makes zero velocity (steady time)', low=0.05, high=60.0)
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
    """Where the vehicle was, how long ago that arrived (steady time), and what is wrong with it."""

    position_enu_m: Vector
    frame_id: str
    age_s: float
    doubt: str = ''


class GuardVerdict(NamedTuple):
    """The velocity to fly; `reason` is '' when it is the one asked for."""

    velocity_enu_m_s: Vector
    yaw_rate_rad_s: float
    reason: str


def check(command: Command | None, position: Position | None, limits: Limits) -> GuardVerdict:
    """The velocity that may be flown now.

    The speed is never above the limits (scaled down, direction kept). Toward the fence it is so low that a
    vehicle that stops hearing us after this command, and brakes at `braking_m_s2`, stands before the fence.
    Outside the fence only motion back inward passes.
    """
    doubt = doubt_of(command, position, limits)
    if doubt or command is None or position is None:
        return GuardVerdict(ZERO, 0.0, doubt)
    velocity, slowed = limited(command.velocity_enu_m_s, limits)
    yaw_rate = max(-limits.max_yaw_rate_rad_s, min(limits.max_yaw_rate_rad_s, command.yaw_rate_rad_s))
    if limits.fence is None:
        return GuardVerdict(velocity, yaw_rate, slowed)
    inside, fenced = _fenced(velocity, position.position_enu_m, limits, limits.fence)
    return GuardVerdict(inside, yaw_rate, '; '.join(reason for reason in (slowed, fenced) if reason))


def doubt_of(command: Command | None, position: Position | None, limits: Limits) -> str:
    """Why nothing may be flown, or ''."""
    return _command_doubt(command, limits) or pose_doubt(position, limits)


def _command_doubt(command: Command | None, limits: Limits) -> str:
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
    return ''


def pose_doubt(position: Position | None, limits: Limits) -> str:
    """Why a position is not to be flown by, or ''."""
    if position is None:
        return 'no pose yet'
    if position.frame_id != MAP_FRAME:
        return f"pose refused: its frame is '{position.frame_id}'; it must be '{MAP_FRAME}' (ENU)"
    if not _finite(position.position_enu_m):
        return 'pose refused: it is not finite'
    if position.doubt:
        return f'pose refused: {position.doubt}'
    if not 0.0 <= position.age_s <= limits.pose_timeout_s:
        return f'pose older than {limits.pose_timeout_s:g} s'
    return ''


def _finite(vector: Vector) -> bool:
    return all(math.isfinite(value) for value in vector)


def limited(velocity: Vector, limits: Limits) -> tuple[Vector, str]:
    """The velocity within the limits of speed, direction kept, and what limited it.

    Args:
        velocity: (east, north, up) [m/s].
        limits: highest speeds.
    """
    east, north, up = velocity
    horizontal = math.hypot(east, north)
    scale, reason = 1.0, ''
    if horizontal > limits.max_speed_m_s:
        scale, reason = limits.max_speed_m_s / horizontal, f'speed limited to {limits.max_speed_m_s:g} m/s'
    if abs(up) * scale > limits.max_climb_m_s:
        scale, reason = limits.max_climb_m_s / abs(up), f'climb limited to {limits.max_climb_m_s:g} m/s'
    return (east * scale, north * scale, up * scale), reason


def _fenced(velocity: Vector, position: Vector, limits: Limits, fence: Fence) -> tuple[Vector, str]:
    at, braking = position[:2], Braking(limits.braking_m_s2, limits.reaction_s)
    beyond_m = outside_m(fence, at)
    below_or_above = not fence.low_m <= position[2] <= fence.high_m
    if beyond_m > 0.0 or below_or_above:
        return _inward(velocity, position, limits, fence, beyond_m)
    east, north = keep_in(velocity[:2], at, fence, braking)
    up = _between(velocity[2], position[2], fence, limits)
    slowed = [name for name, now, asked in zip(AXES, (east, north, up), velocity, strict=True) if now != asked]
    return (east, north, up), f'fence ahead: {", ".join(slowed)} limited' if slowed else ''


def must_brake(moving: Point, position: Position, limits: Limits) -> bool:
    """Whether a vehicle inside the fence that moves so in plan (m/s) passes it unless it brakes with all it has.

    That happens when it is turned again and again: what turns it does not slow it.
    """
    if limits.fence is None or outside_m(limits.fence, position.position_enu_m[:2]) > 0.0:
        return False
    braking = Braking(limits.braking_m_s2, STILL_TO_REACT * limits.reaction_s)
    return not can_stop(moving, position.position_enu_m[:2], limits.fence, braking)


def outside(limits: Limits, position: Vector) -> bool:
    """Whether a position is outside the fence, in plan or in altitude.

    Args:
        limits: with the fence.
        position: (east, north, up) [m].
    """
    fence = limits.fence
    if fence is None:
        return False
    return outside_m(fence, position[:2]) > 0.0 or not fence.low_m <= position[2] <= fence.high_m


def held_back(verdict: GuardVerdict, position: Vector, under_way: Vector, limits: Limits) -> GuardVerdict:
    """Slowed so far that the vehicle stays inside when all that is on its way to it arrives later, after a pause.

    Args:
        verdict: what may be flown by the position alone.
        position: (3,).
        under_way: (3,) how far the commands lead that the vehicle may not have yet, metres.
        limits: a share BESIDE_UNDER_WAY of its reaction is used.
    """
    fence = limits.fence
    if fence is None or under_way == ZERO or outside(limits, position):
        return verdict
    there, still = moved(position, under_way), replace(limits, reaction_s=BESIDE_UNDER_WAY * limits.reaction_s)
    braking = Braking(still.braking_m_s2, still.reaction_s)
    leaves = outside_m(fence, there[:2]) > 0.0
    east, north = (0.0, 0.0) if leaves else keep_in(verdict.velocity_enu_m_s[:2], there[:2], fence, braking)
    up = _between(verdict.velocity_enu_m_s[2], max(fence.low_m, min(fence.high_m, there[2])), fence, still)
    if (east, north, up) == verdict.velocity_enu_m_s:
        return verdict
    return verdict._replace(velocity_enu_m_s=(east, north, up), reason=verdict.reason or UNDER_WAY)


def _between(climb: float, altitude_m: float, fence: Fence, limits: Limits) -> float:
    upper = stopping_speed_m_s(fence.high_m - altitude_m, limits.braking_m_s2, limits.reaction_s)
    lower = -stopping_speed_m_s(altitude_m - fence.low_m, limits.braking_m_s2, limits.reaction_s)
    return max(lower, min(upper, climb))


def _inward(velocity: Vector, position: Vector, limits: Limits, fence: Fence, beyond_m: float) -> tuple[Vector, str]:
    """Outside in plan, in altitude or both: each part leads back, not out on the other side, or is zero."""
    braking, (low, high) = Braking(limits.braking_m_s2, limits.reaction_s), (fence.low_m, fence.high_m)
    east, north = back_in(velocity[:2], position[:2], fence, braking) if beyond_m > 0.0 else (0.0, 0.0)
    up, where = 0.0, [f'{beyond_m:.1f} m in plan'] if beyond_m > 0.0 else []
    if position[2] < low:
        up, where = max(0.0, _between(velocity[2], low, fence, limits)), [*where, f'{low - position[2]:.1f} m too low']
    elif position[2] > high:
        up, where = min(0.0, _between(velocity[2], high, fence, limits)), [*where, f'{position[2] - high:.1f} m too high']
    return (east, north, up), f'outside the fence ({", ".join(where)}): only motion back inward is flown'
