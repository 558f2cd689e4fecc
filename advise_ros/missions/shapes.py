"""Lines, points and areas of a map, as KML and GeoJSON hold them: longitude, latitude and maybe height."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from advise_ros.core.errors import InputError
from advise_ros.missions.mission import EarthPosition, FlightMission, Ring, as_areas


class Shape(NamedTuple):
    """One of them.

    Attributes:
        name: '' where it has none.
        kind: Point, LineString or Polygon.
        coordinates: (longitude, latitude[, height]) of each corner.
        of_ground: the heights count from the ground, not from the sea.
        holes: of an area.
    """

    name: str
    kind: str
    coordinates: tuple[Sequence[float], ...]
    of_ground: bool = False
    holes: int = 0


def mission_of(shapes: Sequence[Shape]) -> FlightMission:
    """The longest line is the route; without a line the points are, in their order. Areas are told apart by their names.

    Raises:
        InputError: a coordinate is none on the earth; without the file's name.
    """
    lines = [one for one in shapes if one.kind in ('LineString', 'LinearRing')]
    points = [one for one in shapes if one.kind == 'Point']
    areas = [one for one in shapes if one.kind == 'Polygon']
    route = max(lines, key=lambda one: len(one.coordinates), default=None)
    others = [one for one in lines if one is not route]
    notes = [f"line '{one.name}' was not read: the route is '{route.name if route else ''}'" for one in others]
    if route is not None and points:
        notes.append(f"{len(points)} points were not read: the route is the line '{route.name}'")
    notes += [f"{one.holes} holes in area '{one.name}' were not read" for one in areas if one.holes]
    waypoints = _positions(route) if route is not None else tuple(position for one in points for position in _positions(one))
    stay_in, keep_out, said = as_areas([(one.name, _positions(one._replace(of_ground=False))) for one in areas])
    return FlightMission(waypoints, stay_in, keep_out, notes=(*notes, *said))


def _positions(shape: Shape) -> tuple[EarthPosition, ...]:
    found = []
    for longitude, latitude, *height in shape.coordinates:
        if not (abs(latitude) <= 90 and abs(longitude) <= 180):
            raise InputError(
                f"'{shape.name}' has the place longitude {longitude:g}, latitude {latitude:g}; "
                'coordinates are WGS 84 degrees, longitude first'
            )
        found.append(EarthPosition(latitude, longitude, float(height[0]) if shape.of_ground and height else None))
    return tuple(found)


def route_coordinates(mission: FlightMission) -> list[tuple[float, float, float]]:
    """(longitude, latitude, height) of each waypoint."""
    return [(one.longitude_deg, one.latitude_deg, one.height_m or 0.0) for one in mission.waypoints]


def ring_coordinates(ring: Ring) -> list[tuple[float, float]]:
    """(longitude, latitude) of each corner, the first again at the end."""
    return [(one.longitude_deg, one.latitude_deg) for one in (*ring, ring[0])]
