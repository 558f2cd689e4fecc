"""The velocity that takes a vehicle along a line of cell centres at one altitude.

The law is made for late positions: between a position and the effect of its command lie the link, the
autopilot and, in a simulation that runs fast, whole tenths of a second. Speed is therefore what
can still be shed in the distance left, after a delay of `1 / approach_gain_1_s`, and positions are
extrapolated by `lead_s`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from advise_ros.core.grid.cell_tracker import TrackerSettings
from advise_ros.core.parameter import parameter, same_as
from advise_ros.core.units import ZERO, Vector

Point = tuple[float, float]


# A vehicle off its line by this share of a cell slows down, until at half a cell it nearly stands.
CROSS_FREE, CROSS_FULL, CROSS_SLOWEST = 0.2, 0.5, 0.15


@dataclass(frozen=True)
class SeekSettings:
    """How a vehicle is flown from cell centre to cell centre: parameters of /policy and /pilot."""

    speed_m_s: float = parameter(1.2, 'cruise speed', low=0.05, high=20.0)
    approach_gain_1_s: float = parameter(
        1.5, 'speed per metre of distance near a centre; lower it where commands act late', low=0.05, high=20.0,
    )
    braking_m_s2: float = parameter(1.5, 'deceleration planned for before turns and stops', low=0.1, high=20.0)
    altitude_gain_1_s: float = parameter(0.8, 'climb rate per metre of altitude error', low=0.0, high=20.0)
    climb_m_s: float = parameter(1.0, 'fastest climb and descent', low=0.0, high=10.0)
    lead_s: float = parameter(0.5, 'positions are extrapolated by this to make up for delays', low=0.0, high=5.0)
    corner_share: float = parameter(
        0.1, 'how far past the centre a turn may swing out, as a share of a cell', low=0.0, high=0.5,
    )
    arrival_radius_m: float = parameter(0.3, 'closer than this is at the centre', low=0.01, high=100.0)
    hysteresis_m: float = same_as(TrackerSettings, 'hysteresis_m')


class Leg(NamedTuple):
    """A straight piece from centre to centre.

    Attributes:
        start_enu_m, end_enu_m: the two centres; equal to go to a centre and stay there.
        cell_m: edge of a cell.
        run_on_m: way beyond the end that goes straight on.
        corner: a turn (a full one too) follows, not a stop: the end may be overshot a little.
    """

    start_enu_m: Point
    end_enu_m: Point
    cell_m: float
    run_on_m: float = 0.0
    corner: bool = False

    @property
    def direction(self) -> Point:
        """Unit vector (east, north); (0, 0) when start and end are one."""
        east, north = self.end_enu_m[0] - self.start_enu_m[0], self.end_enu_m[1] - self.start_enu_m[1]
        length = math.hypot(east, north)
        return (east / length, north / length) if length > 0 else (0.0, 0.0)

    def remaining_m(self, position_enu_m: Vector) -> float:
        """Distance to the end along the line, negative beyond it; the plain distance when there is no line.

        Args:
            position_enu_m: (east, north, up).
        """
        east, north = self.end_enu_m[0] - position_enu_m[0], self.end_enu_m[1] - position_enu_m[1]
        direction = self.direction
        if direction == (0.0, 0.0):
            return math.hypot(east, north)
        return east * direction[0] + north * direction[1]

    def cross_m(self, position_enu_m: Vector) -> float:
        """Distance from the line, positive to its left; 0 when there is no line.

        Args:
            position_enu_m: (east, north, up).
        """
        east, north = position_enu_m[0] - self.start_enu_m[0], position_enu_m[1] - self.start_enu_m[1]
        direction = self.direction
        return north * direction[0] - east * direction[1]


def approach_speed_m_s(distance_m: float, settings: SeekSettings) -> float:
    """Signed speed towards a point in front (positive) or behind (negative).

    The speed v that solves distance = v / gain + v^2 / (2 braking), at most the cruise speed: near the point it
    is gain * distance, far away the square-root law of steady braking.

    Args:
        distance_m: signed, positive in front.
        settings: gain, braking and cruise speed.
    """
    reaction = settings.braking_m_s2 / settings.approach_gain_1_s
    speed = math.sqrt(reaction * reaction + 2.0 * settings.braking_m_s2 * abs(distance_m)) - reaction
    return math.copysign(min(speed, settings.speed_m_s), distance_m)


def brake_distance_m(settings: SeekSettings) -> float:
    """How far before a stop the cruise speed ends."""
    speed = settings.speed_m_s
    return speed / settings.approach_gain_1_s + speed * speed / (2.0 * settings.braking_m_s2)


def seek(
    position_enu_m: Vector, velocity_enu_m_s: Vector, leg: Leg, altitude_m: float, settings: SeekSettings,
) -> Vector:
    """Velocity (east, north, up) that follows a leg at an altitude.

    Args:
        position_enu_m: where the vehicle was seen.
        velocity_enu_m_s: how it moved then, zero where that is not known.
        leg: where to go.
        altitude_m: height to hold.
        settings: limits and gains.

    Returns:
        Always finite, horizontally at most `speed_m_s`, vertically at most `climb_m_s`; zero when a position is
        not a number.
    """
    ahead = _extrapolated(position_enu_m, velocity_enu_m_s, settings.lead_s)
    if not all(math.isfinite(value) for value in (*ahead, altitude_m)):
        return ZERO
    climb = settings.altitude_gain_1_s * (altitude_m - position_enu_m[2])
    east, north = _horizontal(ahead, leg, settings)
    return (east, north, max(-settings.climb_m_s, min(settings.climb_m_s, climb)))


def _extrapolated(position_enu_m: Vector, velocity_enu_m_s: Vector, lead_s: float) -> Vector:
    x, y, z = (p + lead_s * v for p, v in zip(position_enu_m, velocity_enu_m_s, strict=True))
    return (x, y, z)


def _horizontal(ahead_enu_m: Vector, leg: Leg, settings: SeekSettings) -> Point:
    direction = leg.direction
    if direction == (0.0, 0.0):
        return _towards(ahead_enu_m, leg.end_enu_m, settings)
    cross_m = leg.cross_m(ahead_enu_m)
    along = _along_speed(leg.remaining_m(ahead_enu_m), cross_m, leg, settings)
    left = -approach_speed_m_s(cross_m, settings)
    return _limited(along * direction[0] - left * direction[1], along * direction[1] + left * direction[0], settings)


def _towards(ahead_enu_m: Vector, end_enu_m: Point, settings: SeekSettings) -> Point:
    east, north = end_enu_m[0] - ahead_enu_m[0], end_enu_m[1] - ahead_enu_m[1]
    distance = math.hypot(east, north)
    if distance <= 0.0:
        return (0.0, 0.0)
    speed = approach_speed_m_s(distance, settings)
    return _limited(east / distance * speed, north / distance * speed, settings)


def _along_speed(remaining_m: float, cross_m: float, leg: Leg, settings: SeekSettings) -> float:
    # A corner is passed as if the stop stood a little behind it: time saved, for a bounded overshoot.
    spill_m = settings.arrival_radius_m + settings.corner_share * leg.cell_m if leg.corner else 0.0
    off = (abs(cross_m) / leg.cell_m - CROSS_FREE) / (CROSS_FULL - CROSS_FREE)
    on_line = max(CROSS_SLOWEST, min(1.0, 1.0 - off))
    return approach_speed_m_s(remaining_m + leg.run_on_m + spill_m, settings) * on_line


def _limited(east_m_s: float, north_m_s: float, settings: SeekSettings) -> Point:
    speed = math.hypot(east_m_s, north_m_s)
    if not math.isfinite(speed):
        return (0.0, 0.0)
    scale = settings.speed_m_s / speed if speed > settings.speed_m_s else 1.0
    return (east_m_s * scale, north_m_s * scale)
