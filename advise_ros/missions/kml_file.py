"""KML and KMZ (OGC 07-147r2), as Google Earth and QGIS write them; fastkml reads and writes them."""

from __future__ import annotations

import zipfile
from io import BytesIO
from typing import Any
from xml.parsers import expat

from fastkml import KML, Document, Placemark
from fastkml.enums import AltitudeMode
from fastkml.geometry import LineString, Polygon
from fastkml.utils import find_all
from pygeoif import geometry

from advise_ros.core.errors import InputError
from advise_ros.missions.mission import FlightMission
from advise_ros.missions.shapes import Shape, mission_of, ring_coordinates, route_coordinates

# No map drawn by hand is larger; a packed one could unpack to any size.
MOST_BYTES = 50_000_000
ZIP = b'PK\x03\x04'


def read_kml(data: bytes) -> FlightMission:
    """The lines, points and areas of a KML or KMZ file.

    Raises:
        InputError: it is none; without the file's name.
    """
    text = _unpacked(data) if data.startswith(ZIP) else data
    if b'<!ENTITY' in text:
        raise InputError('it defines entities of its own, which no map does; save it again')
    try:
        expat.ParserCreate().Parse(text, True)  # fastkml takes what is whole of a file that is cut off, without a word.
        document = KML.parse(BytesIO(text), strict=False, validate=False)
        placemarks = list(find_all(document, of_type=Placemark))
        return mission_of([shape for placemark in placemarks for shape in _shapes(placemark)])
    except InputError:
        raise
    except Exception as problem:  # fastkml and the XML parser let many types through
        raise InputError(f'it is no sound KML ({problem}); save it again') from problem


def _unpacked(data: bytes) -> bytes:
    try:
        with zipfile.ZipFile(BytesIO(data)) as packed:
            inside = [info for info in packed.infolist() if info.filename.lower().endswith('.kml')]
            if not inside:
                raise InputError('it holds no .kml; export it again')
            if inside[0].file_size > MOST_BYTES:
                raise InputError(f'its .kml has {inside[0].file_size / 1e6:.0f} MB; that is no route')
            return packed.read(inside[0])
    except (zipfile.BadZipFile, OSError) as problem:
        raise InputError(f'it is no sound KMZ ({problem}); export it again') from None


def _shapes(placemark: Any) -> list[Shape]:
    if placemark.geometry is None:
        return []
    mode = getattr(placemark.kml_geometry, 'altitude_mode', None)
    return _parts(placemark.name or '', placemark.geometry, of_ground=mode == AltitudeMode.relative_to_ground)


def _parts(name: str, shape: Any, *, of_ground: bool) -> list[Shape]:
    kind = shape.geom_type
    if kind.startswith('Multi') or kind == 'GeometryCollection':
        return [one for part in shape.geoms for one in _parts(name, part, of_ground=of_ground)]
    if kind == 'Polygon':
        return [Shape(name, kind, tuple(shape.exterior.coords), of_ground, len(list(shape.interiors)))]
    return [Shape(name, kind, tuple(shape.coords), of_ground)]


def write_kml(mission: FlightMission) -> str:
    """The route as a line, its heights above the ground, and the areas."""
    document = Document(name='route')
    line = LineString(
        geometry=geometry.LineString(route_coordinates(mission)), altitude_mode=AltitudeMode.relative_to_ground,
    )
    document.append(Placemark(name='route', kml_geometry=line))
    for name, rings in (('stay in', mission.stay_in), ('keep out', mission.keep_out)):
        for ring in rings:
            document.append(Placemark(name=name, kml_geometry=Polygon(geometry=geometry.Polygon(ring_coordinates(ring)))))
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + str(KML(features=[document]).to_string(prettyprint=True))
