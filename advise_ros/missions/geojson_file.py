"""GeoJSON (RFC 7946), as QGIS and geojson.io write it; the package geojson checks what is read."""

from __future__ import annotations

import json
from typing import Any

import geojson

from advise_ros.core.errors import InputError
from advise_ros.missions.mission import FlightMission
from advise_ros.missions.shapes import Shape, mission_of, ring_coordinates, route_coordinates


def read_geojson(text: str) -> FlightMission:
    """The lines, points and areas of a file; the property `name` is their name.

    Raises:
        InputError: it is none; without the file's name.
    """
    try:
        found = _shapes(json.loads(text), '')
    except (ValueError, TypeError, KeyError, AttributeError, IndexError) as problem:
        raise InputError(f'it is no sound GeoJSON ({problem}); save it again') from None
    return mission_of(found)


def _shapes(thing: Any, name: str) -> list[Shape]:
    kind = thing['type']
    if kind == 'FeatureCollection':
        return [shape for feature in thing['features'] for shape in _shapes(feature, '')]
    if kind == 'Feature':
        return _shapes(thing['geometry'], _name(thing.get('properties') or {})) if thing['geometry'] else []
    if kind == 'GeometryCollection':
        return [shape for part in thing['geometries'] for shape in _shapes(part, name)]
    single = kind.removeprefix('Multi')
    if single not in ('Point', 'LineString', 'Polygon'):
        raise ValueError(f'type {kind!r} is unknown')
    if problems := geojson.loads(json.dumps(thing)).errors():  # It also rounds, so nothing but its judgement is taken.
        raise ValueError(f'{name or kind}: {problems}')
    parts = thing['coordinates'] if kind.startswith('Multi') else [thing['coordinates']]
    return [_shape(name, single, part) for part in parts]


def _name(properties: dict[str, Any]) -> str:
    named = str(properties.get('name') or properties.get('Name') or properties.get('title') or '')
    return f'{named} (exclusion)' if properties.get('inclusion') is False else named


def _shape(name: str, kind: str, part: Any) -> Shape:
    """Heights of RFC 7946 count from the ellipsoid, so they say nothing here."""
    if kind == 'Polygon':
        return Shape(name, kind, tuple(map(tuple, part[0])), holes=len(part) - 1)
    return Shape(name, kind, tuple(map(tuple, [part] if kind == 'Point' else part)))


def write_geojson(mission: FlightMission) -> str:
    """The route as a line, its heights above the ground in property `height_m`, and the areas."""
    heights = [one.height_m or 0.0 for one in mission.waypoints]
    line = geojson.LineString([one[:2] for one in route_coordinates(mission)], precision=9)
    features = [geojson.Feature(geometry=line, properties={'name': 'route', 'height_m': heights})]
    for name, inside, rings in (('stay in', True, mission.stay_in), ('keep out', False, mission.keep_out)):
        for ring in rings:
            area = geojson.Polygon([ring_coordinates(ring)], precision=9)
            features.append(geojson.Feature(geometry=area, properties={'name': name, 'inclusion': inside}))
    return str(geojson.dumps(geojson.FeatureCollection(features), indent=2)) + '\n'
