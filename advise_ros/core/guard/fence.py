"""A fence: a simple polygon in plan and a band of altitude, and how fast one may move inside it.

Each edge is kept off by the half-plane through its nearest point: the edge is convex, so it lies wholly
behind that line. A vehicle whose motion toward each line fits the distance to it therefore crosses no edge,
whatever the polygon's shape.
"""

from __future__ import annotations

import math
from itertools import combinations
from typing import NamedTuple

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import Vector

Point = tuple[float, float]
Edge = tuple[Point, Point]
# Direction from a point to the line through the nearest point of an edge, and its distance.
Line = tuple[Point, float]

TOUCHING_M = 1e-9
# Slowing down for one edge may turn the velocity toward another; after these rounds it is shortened as a whole.
ROUNDS = 4
# Edges that push a point to either side with less than this share of a margin balance each other.
BALANCED = 0.05
# A place inside is looked for in steps of a margin's part, this many at most.
STEPS, LONGEST_WAY = 8, 200
# A fence around a grid keeps this far from the ground (altitude 0), or from half the grid's altitude if that is lower.
CLEARANCE_M = 1.0
FORM = "corners in metres east and north, e.g. '-1,-1 11,-1 11,11 -1,11'"


class Fence(NamedTuple):
    """Corners counter-clockwise in the map frame (ENU), metres, and altitudes; the border belongs to it."""

    corners_enu_m: tuple[Point, ...]
    low_m: float
    high_m: float

    @property
    def edges(self) -> tuple[Edge, ...]:
        return tuple(zip(self.corners_enu_m, (*self.corners_enu_m[1:], self.corners_enu_m[0]), strict=True))


class Braking(NamedTuple):
    """Deceleration that the vehicle can be trusted to have, and the time until it begins."""

    braking_m_s2: float
    reaction_s: float


def box(low_enu_m: Vector, high_enu_m: Vector) -> Fence:
    """The fence of a box.

    Args:
        low_enu_m, high_enu_m: opposite corners, (east, north, up).
    """
    (west, south, low), (east, north, high) = low_enu_m, high_enu_m
    return Fence(((west, south), (east, south), (east, north), (west, north)), low, high)


def fence_around(grid: Grid, margin_m: float, altitude_band_m: float) -> Fence:
    """The grid's rectangle grown by a margin, and a band around its altitude that does not reach the ground.

    Args:
        grid: cells and altitude.
        margin_m: horizontal.
        altitude_band_m: above and below the grid's altitude.
    """
    west, south = grid.origin_enu_m
    east, north = west + grid.width * grid.resolution_m, south + grid.height * grid.resolution_m
    low = grid.altitude_m - altitude_band_m
    if grid.altitude_m > 0.0:
        low = max(low, min(CLEARANCE_M, grid.altitude_m / 2.0))
    return box(
        (west - margin_m, south - margin_m, low),
        (east + margin_m, north + margin_m, grid.altitude_m + altitude_band_m),
    )


def corners_from_text(text: str) -> tuple[Point, ...]:
    """The corners of a parameter, counter-clockwise.

    Raises:
        InputError: fewer than three corners, no numbers, no area, or edges that cross.
    """
    try:
        found = tuple((float(east), float(north)) for east, north in (corner.split(',') for corner in text.split()))
    except ValueError:
        found = ()
    if len(found) < 3 or not all(math.isfinite(value) for corner in found for value in corner):
        raise InputError(f"fence_polygon is '{text}'; it must be at least three {FORM}")
    area = _area(found)
    if abs(area) < TOUCHING_M or _crosses_itself(found):
        raise InputError(f"fence_polygon '{text}' has no area or crosses itself; name its {FORM}, in order around it")
    return found if area > 0 else found[::-1]


def _area(corners: tuple[Point, ...]) -> float:
    pairs = zip(corners, (*corners[1:], corners[0]), strict=True)
    return sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in pairs) / 2.0


def _crosses_itself(corners: tuple[Point, ...]) -> bool:
    edges = Fence(corners, 0.0, 0.0).edges
    apart = ((i, j) for i, j in combinations(range(len(edges)), 2) if j - i not in (1, len(edges) - 1))
    return any(_crosses(edges[i], edges[j]) for i, j in apart)


def _crosses(one: Edge, other: Edge) -> bool:
    return _side(one, other[0]) * _side(one, other[1]) <= 0.0 and _side(other, one[0]) * _side(other, one[1]) <= 0.0


def _side(edge: Edge, point: Point) -> float:
    (x0, y0), (x1, y1) = edge
    return (x1 - x0) * (point[1] - y0) - (y1 - y0) * (point[0] - x0)


def nearest(edge: Edge, point: Point) -> Point:
    """The point of an edge that is nearest to a point."""
    (x0, y0), (x1, y1) = edge
    dx, dy = x1 - x0, y1 - y0
    along = ((point[0] - x0) * dx + (point[1] - y0) * dy) / (dx * dx + dy * dy)
    share = min(1.0, max(0.0, along))
    return x0 + share * dx, y0 + share * dy


def outside_m(fence: Fence, point: Point) -> float:
    """How far a point lies outside in plan, metres; 0 inside and on the border."""
    distance = min(math.dist(nearest(edge, point), point) for edge in fence.edges)
    return 0.0 if distance <= TOUCHING_M or _encloses(fence, point) else distance


def _encloses(fence: Fence, point: Point) -> bool:
    """By the number of edges that a ray to the east crosses."""
    inside = False
    for (x0, y0), (x1, y1) in fence.edges:
        if (y0 > point[1]) != (y1 > point[1]) and point[0] < x0 + (point[1] - y0) / (y1 - y0) * (x1 - x0):
            inside = not inside
    return inside


def stopping_speed_m_s(distance_m: float, braking_m_s2: float, reaction_s: float) -> float:
    """Highest speed v from which v * reaction + v^2 / (2 braking) fits into a distance.

    Args:
        distance_m: to the limit.
        braking_m_s2: deceleration.
        reaction_s: before braking begins.
    """
    if distance_m <= 0.0:
        return 0.0
    # The root in the form that loses no digits for short distances.
    return 2.0 * distance_m / (reaction_s + math.sqrt(reaction_s**2 + 2.0 * distance_m / braking_m_s2))


def keep_in(velocity: Point, at: Point, fence: Fence, braking: Braking) -> Point:
    """The velocity in plan, slowed toward each edge so that the vehicle can stop before it. `at` is inside."""
    lines = _lines(fence, at)
    for _ in range(ROUNDS):
        before = velocity
        for outward, distance in lines:
            toward, limit = _toward(velocity, outward, distance, braking)
            if toward > limit:
                cut = toward - limit
                velocity = velocity[0] - cut * outward[0], velocity[1] - cut * outward[1]
        if velocity == before:
            return velocity
    return _shortened(velocity, lines, braking)


def can_stop(velocity: Point, at: Point, fence: Fence, braking: Braking) -> bool:
    """Whether a vehicle that moves so stands before every edge. `at` is inside."""
    return all(toward <= limit for toward, limit in (_toward(velocity, *line, braking) for line in _lines(fence, at)))


def _lines(fence: Fence, at: Point) -> list[Line]:
    """What keeps each edge off a point inside or on the border."""
    return [(_outward(edge, at), math.dist(nearest(edge, at), at)) for edge in fence.edges]


def _shortened(velocity: Point, lines: list[Line], braking: Braking) -> Point:
    share = 1.0
    for outward, distance in lines:
        toward, limit = _toward(velocity, outward, distance, braking)
        if toward > limit:
            share = min(share, limit / toward)
    return velocity[0] * share, velocity[1] * share


def _toward(velocity: Point, outward: Point, distance_m: float, braking: Braking) -> tuple[float, float]:
    """Speed toward a line, and its limit. Braking acts against the whole velocity: what runs along delays it."""
    toward = velocity[0] * outward[0] + velocity[1] * outward[1]
    along = abs(velocity[0] * outward[1] - velocity[1] * outward[0])
    delay_s = braking.reaction_s + along / (2.0 * braking.braking_m_s2)
    return toward, stopping_speed_m_s(distance_m, braking.braking_m_s2, delay_s)


def _outward(edge: Edge, at: Point) -> Point:
    """Direction from a point inside to an edge; on the edge, its outer normal."""
    near = nearest(edge, at)
    distance = math.dist(near, at)
    if distance > TOUCHING_M:
        return (near[0] - at[0]) / distance, (near[1] - at[1]) / distance
    return _normal(edge)


def _normal(edge: Edge) -> Point:
    """The outer normal of an edge."""
    (x0, y0), (x1, y1) = edge
    length = math.dist(*edge)
    return (y1 - y0) / length, (x0 - x1) / length


def way_deeper(at: Point, fence: Fence, margin_m: float) -> Point | None:
    """Unit vector away from all edges that are nearer than a margin; None where it has that, or can have no more.

    `at` is inside. Where edges face each other within twice the margin the middle between them is enough.

    Args:
        at: (east, north) [m], inside.
        fence: its corners.
        margin_m: distance from an edge that is enough.
    """
    near = [(outward, margin_m - distance) for outward, distance in _lines(fence, at) if distance < margin_m]
    east = -sum(outward[0] * lacking for outward, lacking in near)
    north = -sum(outward[1] * lacking for outward, lacking in near)
    size = math.hypot(east, north)
    return None if size <= BALANCED * margin_m else (east / size, north / size)


def place_inside(at: Point, fence: Fence, margin_m: float) -> Point:
    """The nearest place inside that is a margin off all edges, or as far as it can be. `at` is outside.

    From the nearest point of the fence it leads away from all that is near: out of a sharp corner along its bisector.

    Args:
        at: (east, north) [m], outside.
        fence: its corners.
        margin_m: distance from the edges that is wanted.
    """
    place = _nearest_of(at, fence)
    for _ in range(LONGEST_WAY):
        deeper = way_deeper(place, fence, margin_m)
        if deeper is None:
            break
        place = place[0] + margin_m / STEPS * deeper[0], place[1] + margin_m / STEPS * deeper[1]
    return place


def toward(place: Point, at: Point, fence: Fence, speed_m_s: float, braking: Braking) -> Point:
    """The velocity from a point outside to a place inside, so slow that it does not leave again behind it.

    Args:
        place: (east, north) [m], inside.
        at: (east, north) [m], outside.
        fence: its corners.
        speed_m_s: at most.
        braking: deceleration and reaction time.
    """
    size = math.dist(place, at)
    velocity = speed_m_s * (place[0] - at[0]) / size, speed_m_s * (place[1] - at[1]) / size
    return _shortened(velocity, _lines(fence, place), braking)


def _nearest_of(at: Point, fence: Fence) -> Point:
    return min((nearest(edge, at) for edge in fence.edges), key=lambda point: math.dist(point, at))


def back_in(velocity: Point, at: Point, fence: Fence, braking: Braking) -> Point:
    """The part of a velocity that leads straight back to the fence, or along the bisector of the corner next to it.

    It is so slow that the vehicle does not leave again by another edge. `at` is outside.
    """
    near = _nearest_of(at, fence)
    touching = [_normal(edge) for edge in fence.edges if math.dist(nearest(edge, near), near) <= TOUCHING_M]
    out = sum(normal[0] for normal in touching), sum(normal[1] for normal in touching)
    size = math.hypot(*out)
    inward = -out[0] / size, -out[1] / size
    share = max(0.0, velocity[0] * inward[0] + velocity[1] * inward[1])
    return _shortened((share * inward[0], share * inward[1]), _lines(fence, near), braking)
