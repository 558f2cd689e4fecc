"""A mission on the earth becomes a grid: cells, blocked ones, its place, and a sentence on what does not fit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from advise_ros.commands import grid as command
from advise_ros.core.errors import InputError
from advise_ros.missions.mission import EarthPosition, FlightMission
from advise_ros.missions.to_grid import GridOptions, grid_of
from advise_ros.recording.gridfile import load_grid, load_place
from advise_ros.recording.place import Place

HOME = Place(47.3977, 8.5456)


def at(*points_m: tuple[float, float], height_m: float | None = 6.0, place: Place = HOME) -> tuple[EarthPosition, ...]:
    """Places that lie so many metres east and north of home."""
    on_earth = place.on_earth(np.array(points_m, dtype=np.float64))
    return tuple(EarthPosition(float(latitude), float(longitude), height_m) for latitude, longitude in on_earth)


ROUTE = at((0, 0), (40, 0), (40, 30), (0, 30))


def test_waypoints_lie_in_their_cells_and_the_place_is_the_first_one() -> None:
    found = grid_of(FlightMission(ROUTE), GridOptions(5.0))
    centres = [found.grid.centre_enu_m(cell) for cell in found.grid.waypoints]
    assert np.abs(np.array(centres) - [(0, 0), (40, 0), (40, 30), (0, 30)]).max() < 1e-2
    assert (found.grid.width, found.grid.height, found.grid.altitude_m) == (9 + 4, 7 + 4, 6.0)
    assert (found.place.latitude_deg, found.place.longitude_deg) == pytest.approx((47.3977, 8.5456), abs=1e-6)
    assert not found.notes


def test_what_an_area_touches_is_blocked_and_what_lies_outside_too() -> None:
    garden, field = at((12, 12), (18, 12), (18, 18), (12, 18)), at((-6, -6), (46, -6), (46, 36), (-6, 36))
    found = grid_of(FlightMission(ROUTE, (field,), (garden,)), GridOptions(5.0)).grid
    blocked_m = {tuple(np.round(found.centre_enu_m(cell), 1)) for cell in found.blocked}
    assert blocked_m == {(x, y) for x in (10.0, 15.0, 20.0) for y in (10.0, 15.0, 20.0)}
    low = np.array(found.origin_enu_m)
    high = low + 5.0 * np.array([found.width, found.height])
    assert (low >= -6.0).all() and (high <= (46.0, 36.0)).all()


def test_the_heading_turns_the_axes_with_the_longest_leg() -> None:
    turned = at((0, 0), (40, 0), (40, 30), (0, 30), place=Place(HOME.latitude_deg, HOME.longitude_deg, 25.0))
    found = grid_of(FlightMission(turned), GridOptions(5.0, heading_deg=None))
    assert found.place.heading_deg == pytest.approx(25.0, abs=0.1)
    assert (found.grid.width, found.grid.height) == (13, 11)


@pytest.mark.parametrize(('mission', 'options', 'said'), [
    (FlightMission(()), GridOptions(5.0), 'no waypoints'),
    (FlightMission(ROUTE), GridOptions(0.0), 'positive number of metres'),
    (FlightMission(ROUTE), GridOptions(0.05), r'pass larger ones \(--cell'),
    (FlightMission(at((0, 0), (9, 0), height_m=None)), GridOptions(5.0), '--altitude 5'),
    (FlightMission(ROUTE, keep_out=(at((-3, -3), (3, -3), (3, 3)),)), GridOptions(5.0), 'waypoint 1 lies in a cell'),
    (FlightMission(ROUTE, (at((-9, -9), (20, -9), (20, 40), (-9, 40)),)), GridOptions(5.0), 'waypoint 2 lies in a cell'),
    (FlightMission(ROUTE, home=EarthPosition(8.0, 47.0)), GridOptions(5.0), '50 km and more from its home'),
    (FlightMission(ROUTE, keep_out=(at((17, -99), (23, -99), (23, 99), (17, 99)),)), GridOptions(5.0), 'no way from waypoint'),
])
def test_what_makes_no_grid_is_refused_with_the_remedy(mission: FlightMission, options: GridOptions, said: str) -> None:
    with pytest.raises(InputError, match=said):
        grid_of(mission, options)


def test_what_the_grid_cannot_say_is_named() -> None:
    route = (*at((0, 0), (1, 0), (40, 2)), *at((40, 30), height_m=9.0), *at((0, 0)))
    notes = '\n'.join(grid_of(FlightMission(route), GridOptions(5.0)).notes)
    for said in ('1 of 5 waypoints have another height than 6 m', 'waypoint 2 lies in the cell of the one before',
                 'up to 2.0 m from', 'the first waypoint is the last one'):
        assert said in notes


# -- the command -----------------------------------------------------------------------------------
def test_from_a_file_to_a_grid_file_that_loads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = {'type': 'LineString', 'coordinates': [[one.longitude_deg, one.latitude_deg] for one in ROUTE]}
    (tmp_path / 'a.geojson').write_text(json.dumps(line))
    order = ['from', str(tmp_path / 'a.geojson'), '--cell', '5', '--out', str(tmp_path / 'grid.yaml')]
    assert command.run(order) == 2 and '--altitude 5' in capsys.readouterr().err
    assert command.run([*order, '--altitude', '4']) == 0
    said = capsys.readouterr().out
    assert '13 x 11 cells of 5 m, 4 waypoints' in said and './advise fly --grid' in said
    grid, place = load_grid(tmp_path / 'grid.yaml'), load_place(tmp_path / 'grid.yaml')
    assert grid.altitude_m == 4.0 and place is not None
    assert command.run([*order, '--altitude', '4']) == 2 and 'exists already' in capsys.readouterr().err
    assert command.run(['show', str(tmp_path / 'grid.yaml')]) == 0
    assert '1' in capsys.readouterr().out
    assert command.run(['show', str(tmp_path / 'nowhere.yaml')]) == 2
