"""Missions in the files of other tools: read as those tools mean them, written as they read them."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink import mavwp

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid, optimal_actions
from advise_ros.missions.files import WRITERS, read_mission, write_mission
from advise_ros.missions.from_grid import cells_flown, mission_of
from advise_ros.missions.mission import FlightMission
from advise_ros.recording.place import Place

LATITUDE, LONGITUDE = 47.3977, 8.5456
PLACE = Place(LATITUDE, LONGITUDE, 20.0)
GRID = Grid(4.0, 5, 4, (-2.0, -2.0), 6.0, (4, 19, 0), blocked=(7,))


def learnt() -> FlightMission:
    greedy = [(optimal_actions(GRID, state) or (0,))[0] for state in range(GRID.n_states)]
    return mission_of(GRID, PLACE, cells_flown(GRID, greedy))


def item(command: int, *params: float | None, frame: int = 3) -> dict[str, Any]:
    """As QGroundControl 4 and 5 write it."""
    return {
        'AMSLAltAboveTerrain': None, 'Altitude': params[-1], 'AltitudeMode': 1, 'autoContinue': True, 'command': command,
        'doJumpId': 1, 'frame': frame, 'params': list(params), 'type': 'SimpleItem',
    }


def plan(items: list[dict[str, Any]], **fence: Any) -> str:
    return json.dumps({
        'fileType': 'Plan', 'geoFence': {'circles': [], 'polygons': [], 'version': 2, **fence}, 'groundStation': 'QGroundControl',
        'mission': {
            'cruiseSpeed': 15, 'firmwareType': 12, 'globalPlanAltitudeMode': 1, 'hoverSpeed': 5, 'items': items,
            'plannedHomePosition': [LATITUDE, LONGITUDE, 488.0], 'vehicleType': 2, 'version': 2,
        },
        'rallyPoints': {'points': [[LATITUDE, LONGITUDE, 50]], 'version': 2}, 'version': 1,
    })


# -- QGroundControl --------------------------------------------------------------------------------
def test_a_plan_gives_its_waypoints_areas_and_home_and_names_what_was_not_read(tmp_path: Path) -> None:
    survey = {'TransectStyleComplexItem': {'Items': []}, 'complexItemType': 'survey', 'type': 'ComplexItem', 'version': 5}
    square = [[LATITUDE, LONGITUDE], [LATITUDE + 1e-3, LONGITUDE], [LATITUDE + 1e-3, LONGITUDE + 1e-3]]
    path = tmp_path / 'a.plan'
    path.write_text(plan(
        [
            item(22, 15, 0, 0, None, LATITUDE, LONGITUDE, 10), item(16, 0, 0, 0, None, LATITUDE + 1e-4, LONGITUDE, 10),
            survey, item(19, 5, 0, 0, 1, LATITUDE + 2e-4, LONGITUDE, 498, frame=0), item(20, 0, 0, 0, 0, 0, 0, 0, frame=2),
        ],
        polygons=[{'inclusion': True, 'polygon': square, 'version': 1}],
        circles=[{'circle': {'center': [LATITUDE, LONGITUDE], 'radius': 20.0}, 'inclusion': False, 'version': 1}],
    ))
    found = read_mission(path)
    assert [tuple(one) for one in found.waypoints] == [(LATITUDE + 1e-4, LONGITUDE, 10.0), (LATITUDE + 2e-4, LONGITUDE, 10.0)]
    assert found.home == (LATITUDE, LONGITUDE, 0.0)
    assert [len(ring) for ring in found.stay_in] == [3]
    north_m = [(one.latitude_deg - LATITUDE) * 111_195 for one in found.keep_out[0]]
    assert max(north_m) == pytest.approx(20.0, rel=1e-3)
    notes = '\n'.join(found.notes)
    for said in ('item 1 (TAKEOFF)', 'item 3 (survey) is a pattern', 'not the loitering', 'item 5 (RETURN_TO_LAUNCH)', '1 rally'):
        assert said in notes


@pytest.mark.parametrize(('text', 'said'), [
    ('', 'none of the known kinds'), ('{"mission": {}}', 'no plan of QGroundControl'), ('{"mission": 3}', 'no plan'),
    ('QGC WPL 110\n0\t1\t0\n', 'no sound waypoint file'), ('QGC WPL 300\n', 'no sound waypoint file'),
    ('<html></html>', 'no KML'),
    ('<kml><Document>', 'no sound KML'), ('{"type": "Nothing"}', 'no sound GeoJSON'), ('[1, 2]', 'no sound GeoJSON'),
    ('{"type": "Point", "coordinates": ["a"]}', 'no sound GeoJSON'),
    ('{"type": "Point", "coordinates": [47.4, 98.5]}', 'longitude first'),
    ('<!DOCTYPE kml [<!ENTITY a "b">]><kml></kml>', 'entities'),
])
def test_what_is_no_mission_is_refused_in_one_sentence(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / 'file'
    path.write_text(text)
    with pytest.raises(InputError, match=said) as refused:
        read_mission(path)
    assert str(refused.value).startswith(str(path)) and '\n' not in str(refused.value).strip()
    path.write_bytes(bytes(range(128, 256)))
    with pytest.raises(InputError, match='none of the known kinds'):
        read_mission(path)
    with pytest.raises(InputError, match='cannot be read'):
        read_mission(tmp_path / 'nowhere.plan')


# -- Mission Planner -------------------------------------------------------------------------------
def test_a_waypoint_file_of_mission_planner(tmp_path: Path) -> None:
    rows = [
        (0, 1, 0, 16, 0, 0, 0, 0, LATITUDE, LONGITUDE, 488.0, 1), (1, 0, 3, 22, 0, 0, 0, 0, 0, 0, 8.0, 1),
        (2, 0, 3, 16, 0, 0, 0, 0, LATITUDE + 1e-4, LONGITUDE, 8.0, 1),
        (3, 0, 10, 16, 0, 0, 0, 0, LATITUDE, LONGITUDE + 1e-4, 8.0, 1),
        (4, 0, 3, 177, 2, 3, 0, 0, 0, 0, 0, 1),
    ]
    path = tmp_path / 'mission.txt'
    path.write_text('QGC WPL 110\r\n' + ''.join('\t'.join(map(str, row)) + '\r\n' for row in rows))
    found = read_mission(path)
    assert [one.height_m for one in found.waypoints] == [8.0, 8.0] and found.home == (LATITUDE, LONGITUDE, 0.0)
    assert len(found.notes) == 2 and 'item 4 (DO_JUMP)' in found.notes[1]


# -- maps ------------------------------------------------------------------------------------------
KML = f"""<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2"><Document><name>site.kml</name>
<StyleMap id="m"><Pair><key>normal</key><styleUrl>#s</styleUrl></Pair></StyleMap>
<Folder><name>Flug</name>
<Placemark><name>Route</name><styleUrl>#m</styleUrl><LineString><tessellate>1</tessellate><altitudeMode>relativeToGround</altitudeMode>
<coordinates>
{LONGITUDE},{LATITUDE},5 {LONGITUDE + 1e-3},{LATITUDE},5 {LONGITUDE + 1e-3},{LATITUDE + 1e-3},5
</coordinates></LineString></Placemark>
<Placemark><name>Keep-out: garden</name><Polygon><outerBoundaryIs><LinearRing><coordinates>
{LONGITUDE + 4e-4},{LATITUDE - 2e-4},0 {LONGITUDE + 6e-4},{LATITUDE - 2e-4},0 {LONGITUDE + 6e-4},{LATITUDE + 2e-4},0 \
{LONGITUDE + 4e-4},{LATITUDE - 2e-4},0
</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>
<Placemark><name>House</name><Point><coordinates>{LONGITUDE},{LATITUDE},0</coordinates></Point></Placemark>
</Folder></Document></kml>
"""


def test_a_map_of_google_earth_packed_or_not(tmp_path: Path) -> None:
    path, packed = tmp_path / 'site.kml', tmp_path / 'site.kmz'
    path.write_text(KML)
    with zipfile.ZipFile(packed, 'w', zipfile.ZIP_DEFLATED) as file:
        file.writestr('doc.kml', KML)
        file.writestr('files/icon.png', b'')
    found = read_mission(path)
    assert found == read_mission(packed)
    assert [one.height_m for one in found.waypoints] == [5.0] * 3 and len(found.keep_out) == 1 and not found.stay_in
    assert "1 points were not read: the route is the line 'Route'" in found.notes


def test_points_of_geojson_io_in_their_order_and_areas_by_their_names(tmp_path: Path) -> None:
    def feature(kind: str, coordinates: Any, **properties: Any) -> dict[str, Any]:
        return {'type': 'Feature', 'properties': properties, 'geometry': {'type': kind, 'coordinates': coordinates}}

    corners = [[LONGITUDE, LATITUDE], [LONGITUDE + 1e-3, LATITUDE], [LONGITUDE + 1e-3, LATITUDE + 1e-3], [LONGITUDE, LATITUDE]]
    path = tmp_path / 'map.geojson'
    path.write_text(json.dumps({'type': 'FeatureCollection', 'features': [
        *(feature('Point', one) for one in corners[:3]), feature('Polygon', [corners], name='no-fly road'),
        feature('MultiPolygon', [[corners]], name='field'), feature('Polygon', [corners], inclusion=False),
        {'type': 'Feature', 'properties': {}, 'geometry': None},
    ]}))
    found = read_mission(path)
    assert [one[:2] for one in found.waypoints] == [(latitude, longitude) for longitude, latitude in corners[:3]]
    assert (len(found.keep_out), len(found.stay_in)) == (2, 1) and len(found.notes) == 3


# -- the learnt route, out and back ----------------------------------------------------------------
@pytest.mark.parametrize('ending', WRITERS)
def test_a_learnt_route_comes_back_from_every_form(tmp_path: Path, ending: str) -> None:
    route, path = learnt(), tmp_path / f'route{ending}'
    write_mission(route, path)
    found = read_mission(path)
    here, back = (np.array([one[:2] for one in mission.waypoints]) for mission in (route, found))
    assert here.shape == back.shape and np.abs(here - back).max() < 2e-8
    if ending != '.geojson':  # Its heights would count from the ellipsoid: they are a property there.
        assert {one.height_m for one in found.waypoints} == {6.0}
    if ending != '.waypoints':
        assert (len(found.stay_in), len(found.keep_out)) == (1, 1)


def test_pymavlink_reads_the_waypoint_file_as_it_is_meant(tmp_path: Path) -> None:
    route = learnt()
    write_mission(route, tmp_path / 'route.waypoints')
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(tmp_path / 'route.waypoints')) == len(route.waypoints) + 2
    assert [(loader.wp(index).command, loader.wp(index).frame) for index in range(3)] == [(16, 0), (22, 3), (16, 3)]
    assert loader.wp(2).z == 6.0 and loader.wp(2).autocontinue == 1


def test_a_plan_that_is_written_has_what_other_importers_of_plans_ask_for(tmp_path: Path) -> None:
    """MAVSDK's and QGroundControl's: version 1 and 2, seven parameters, whole numbers for commands and frames."""
    write_mission(learnt(), tmp_path / 'route.plan')
    written = json.loads((tmp_path / 'route.plan').read_text())
    assert (written['fileType'], written['version'], written['mission']['version']) == ('Plan', 1, 2)
    for one in written['mission']['items']:
        assert one['type'] == 'SimpleItem' and type(one['command']) is int and type(one['frame']) is int
        assert len(one['params']) == 7 and all(isinstance(value, float) for value in one['params'])
    assert written['geoFence']['version'] == written['rallyPoints']['version'] == 2


def test_a_route_has_its_corners_and_waypoints_or_every_cell() -> None:
    greedy = [(optimal_actions(GRID, state) or (0,))[0] for state in range(GRID.n_states)]
    cells = cells_flown(GRID, greedy)
    assert cells[0] == cells[-1] == 0 and {4, 19} < set(cells)
    assert len(mission_of(GRID, PLACE, cells, every_cell=True).waypoints) == len(cells)
    assert len(mission_of(GRID, PLACE, cells).waypoints) < len(cells)
    with pytest.raises(InputError, match='on the way to waypoint 1 of 3'):
        cells_flown(GRID, [2] * GRID.n_states)


def test_a_name_without_a_known_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r'\.plan, \.waypoints'):
        write_mission(learnt(), tmp_path / 'route.txt')
    with pytest.raises(InputError, match='cannot be written'):
        write_mission(learnt(), tmp_path / 'nowhere' / 'route.plan')
