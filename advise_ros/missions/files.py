"""Missions in files: what a file is, its contents say; what is to be written, its name."""

from __future__ import annotations

import json
from pathlib import Path

from advise_ros.core.errors import InputError
from advise_ros.missions.geojson_file import read_geojson, write_geojson
from advise_ros.missions.kml_file import MOST_BYTES, ZIP, read_kml, write_kml
from advise_ros.missions.mission import FORMS, FlightMission
from advise_ros.missions.plan_file import read_plan, write_plan
from advise_ros.missions.waypoint_file import read_waypoints, write_waypoints

WRITERS = dict(zip(FORMS, (write_plan, write_waypoints, write_kml, write_geojson), strict=True))
KNOWN = "QGroundControl's .plan, .waypoints (QGC WPL), .kml, .kmz and .geojson"


def read_mission(path: str | Path) -> FlightMission:
    """The mission in a file of another tool.

    Raises:
        InputError: it cannot be read or is of no known kind; one sentence with the file, what is wrong and the remedy.
    """
    file = Path(path)
    try:
        data = file.read_bytes()
    except OSError as problem:
        raise InputError(f'{path} cannot be read ({problem.strerror}); name a file: {KNOWN}') from None
    try:
        return _read(file, data)
    except InputError as problem:
        raise InputError(f'{path}: {problem}') from problem


def _read(file: Path, data: bytes) -> FlightMission:
    if len(data) > MOST_BYTES:
        raise InputError(f'it has {len(data) / 1e6:.0f} MB; that is no route')
    if data.startswith(b'QGC WPL'):
        return read_waypoints(file)
    if data.startswith(ZIP):
        return read_kml(data)
    try:
        text = data.decode('utf-8-sig')
    except UnicodeDecodeError:
        raise InputError(f'it is none of the known kinds: {KNOWN}') from None
    if text.lstrip().startswith('<'):
        if '<kml' not in text[:4000]:
            raise InputError(f'it is XML, but no KML; known are {KNOWN}')
        return read_kml(text.encode())
    try:
        values = json.loads(text)
    except ValueError:
        raise InputError(f'it is none of the known kinds: {KNOWN}') from None
    if isinstance(values, dict) and 'mission' in values:
        return read_plan(text)
    return read_geojson(text)


def write_mission(mission: FlightMission, path: str | Path) -> None:
    """Write a mission in the form that the file's name ends with.

    Raises:
        InputError: its name says no known form, or it cannot be written.
    """
    file = Path(path)
    if file.suffix.lower() not in WRITERS:
        raise InputError(f"{path}: a file's name ends with what it is to be: {', '.join(WRITERS)}")
    try:
        file.write_text(WRITERS[file.suffix.lower()](mission), encoding='utf-8')
    except OSError as problem:
        raise InputError(f'{path} cannot be written ({problem.strerror}); name another file') from None
