"""What stands behind the page that draws a grid: the loader's sentences, and files that are never lost."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from advise_ros.commands import grid as command
from advise_ros.console.grid_editor import HEAD, GridEditor
from advise_ros.core.errors import InputError
from advise_ros.core.grid.raster import Raster
from advise_ros.recording.gridfile import load_grid, load_place
from advise_ros.recording.mapfile import map_texts
from advise_ros.recording.picturefile import Corners, GroundPicture, picture_of_map
from support.paths import ROOT

SHIPPED = ROOT / 'config' / 'grid_6x6.yaml'
DRAWN = {
    'resolution': 2, 'width': 4, 'height': 3, 'origin': [0, 0], 'altitude': 3, 'waypoints': [[3, 2], [0, 0]], 'blocked': [[1, 1]],
}


def editor(folder: Path, **given: Any) -> GridEditor:
    return GridEditor(folder=folder, **given)


def saved(made: GridEditor, values: dict[str, Any], name: str = 'a.yaml', **more: Any) -> dict[str, Any]:
    return made.act('save', {'values': values, 'name': name, **more})


@pytest.mark.parametrize('change', [
    {'waypoints': []}, {'waypoints': [[1, 1]]}, {'waypoints': [[0, 0], [0, 0]]}, {'waypoints': [[9, 0]]}, {'altitude': None},
    {'resolution': 'two'}, {'width': 0}, {'origin_wgs84': [95, 8]}, {'heading_deg': 20}, {'colour': 'red'},
    {'waypoints': [[0.5, 1]]},
    {'waypoints': [[3, 2], [0, 0]], 'blocked': [[1, 0], [0, 1], [1, 1]]}, {'altitude': -1}, {'blocked': 7}, {'origin': [1]},
])
def test_it_says_what_the_loader_says(tmp_path: Path, change: dict[str, Any]) -> None:
    made = editor(tmp_path)
    found = made.act('check', {'values': {**DRAWN, **change}})
    assert not found['ok']
    (tmp_path / 'by_hand.yaml').write_text(made.text({**DRAWN, **change}))
    with pytest.raises(InputError) as problem:
        load_grid(tmp_path / 'by_hand.yaml')
    assert str(problem.value) == f'grid file {tmp_path / "by_hand.yaml"}: {found["message"]}'
    assert saved(made, {**DRAWN, **change})['message'] == found['message']
    assert [one.name for one in tmp_path.iterdir()] == ['by_hand.yaml']


def test_what_is_saved_is_the_drawing_and_twice_the_same_bytes(tmp_path: Path) -> None:
    made = editor(tmp_path)
    assert made.act('check', {'values': DRAWN}) == {'ok': True, 'message': '', 'steps': 10, 'metres': 20.0}
    reply = saved(made, {**DRAWN, 'origin_wgs84': [47.4, 8], 'heading_deg': 30})
    assert reply['ok'] and reply['next'] == f'./advise fly --grid {tmp_path / "a.yaml"}'
    grid, place = load_grid(tmp_path / 'a.yaml'), load_place(tmp_path / 'a.yaml')
    assert (grid.width, grid.height, grid.waypoints, grid.blocked) == (4, 3, (11, 0), (5,))
    assert place is not None and (place.latitude_deg, place.longitude_deg, place.heading_deg) == (47.4, 8.0, 30.0)
    assert command.run(['show', str(tmp_path / 'a.yaml')]) == 0
    again = GridEditor(tmp_path / 'a.yaml')
    assert saved(again, again.start()['values'])['ok'], 'the same bytes need no other file'
    assert saved(again, again.start()['values'], 'b.yaml')['ok']
    assert (tmp_path / 'a.yaml').read_bytes() == (tmp_path / 'b.yaml').read_bytes()
    assert (tmp_path / 'a.yaml').read_text().startswith(HEAD)


def test_a_file_of_somebody_s_hand_stays_to_the_byte_until_it_is_changed(tmp_path: Path) -> None:
    shipped = SHIPPED.read_bytes().replace(b'\n', b'\r\n')
    (tmp_path / 'mine.yaml').write_bytes(shipped)
    made = GridEditor(tmp_path / 'mine.yaml')
    values = made.start()['values']
    assert saved(made, values, 'copy.yaml')['lost'] is False
    assert (tmp_path / 'copy.yaml').read_bytes() == shipped
    assert saved(made, {**values, 'altitude': 6}, 'other.yaml')['lost'] is True, 'its comments are gone, and that is said'
    assert load_grid(tmp_path / 'other.yaml').altitude_m == 6.0


def test_no_file_is_lost_unless_that_is_wished(tmp_path: Path) -> None:
    (tmp_path / 'a.yaml').write_text('precious')
    (tmp_path / 'a_2.yaml').write_text('precious, too')
    made = editor(tmp_path)
    reply = saved(made, DRAWN)
    assert (reply['ok'], reply['exists'], reply['other']) == (False, True, 'a_3.yaml')
    assert (tmp_path / 'a.yaml').read_text() == 'precious'
    assert saved(made, DRAWN, 'a.yaml', replace=True)['ok']
    assert load_grid(tmp_path / 'a.yaml').width == 4


@pytest.mark.parametrize('name', ['', '../a.yaml', '/tmp/a.yaml', 'a.txt', '.yaml', '.a.yaml', 'a\0.yaml', None])
def test_a_name_that_is_none_or_leads_elsewhere_is_refused(tmp_path: Path, name: str | None) -> None:
    reply = editor(tmp_path).act('save', {'values': DRAWN, 'name': name})
    assert not reply['ok'] and f'it is written to {tmp_path}' in reply['message']
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    assert 'No such file or directory' in saved(GridEditor(tmp_path / 'no' / 'a.yaml'), DRAWN)['message']


def test_a_wrong_route_can_be_mended_but_a_wrong_shape_cannot_be_drawn(tmp_path: Path) -> None:
    path = tmp_path / 'a.yaml'
    path.write_text(SHIPPED.read_text().replace('blocked: []', 'blocked: [[5, 0]]'))
    assert 'is a blocked cell' in GridEditor(path).act('check', {'values': GridEditor(path).start()['values']})['message']
    for right, wrong, said in (
        ('width: 6', 'width: x', 'positive whole number'), ('[[5, 0]', '[[a, 0]', 'two whole numbers'),
        ('blocked: []', 'blocked: 7', 'must be a list of cells'),
    ):
        path.write_text(SHIPPED.read_text().replace(right, wrong))
        with pytest.raises(InputError, match=f'grid file {path}.*{said}'):
            GridEditor(path)


def test_too_many_cells_for_a_page_are_named(tmp_path: Path) -> None:
    reply = editor(tmp_path).act('check', {'values': {**DRAWN, 'width': 500, 'height': 500}})
    assert '500 x 500 cells are more than the 40000' in reply['message'] and 'larger cells' in reply['message']


def test_a_page_that_is_loaded_again_goes_on(tmp_path: Path) -> None:
    made = editor(tmp_path)
    made.act('check', {'values': DRAWN})
    made.act('check', {'values': {**DRAWN, 'resolution': None}})
    assert made.start()['values'] == DRAWN


# -- over a picture and over a map --------------------------------------------------------------------
def test_a_new_drawing_lies_on_its_picture(tmp_path: Path) -> None:
    picture = GroundPicture(b'', 'image/png', Corners(((5.0, 45.0), (65.0, 45.0), (65.0, 5.0), (5.0, 5.0))))
    values = editor(tmp_path, picture=picture).start()['values']
    assert (values['resolution'], values['width'], values['height'], values['origin']) == (2.0, 30, 20, [5.0, 5.0])
    earth = Corners(((47.4, 8.5), (47.4, 8.501), (47.399, 8.501), (47.399, 8.5)), on_earth=True)
    placed = editor(tmp_path, picture=GroundPicture(b'', 'image/png', earth)).start()
    assert placed['values']['origin_wgs84'] == [47.399, 8.5]
    assert placed['corners'][3] == pytest.approx([0.0, 0.0], abs=1e-3)


def test_a_picture_moves_with_the_place_and_is_placed_anew(tmp_path: Path) -> None:
    made, there = editor(tmp_path), {**DRAWN, 'origin_wgs84': [47.399, 8.5], 'heading_deg': 0}
    wish = {'corners': '47.399,8.5 47.4,8.501', 'on_earth': True}
    assert made.act('place', {**wish, 'values': DRAWN})['message'].endswith('name its origin_wgs84')
    assert made.act('place', {**wish, 'values': there})['corners'][1] == pytest.approx([75.5, 111.2], abs=0.2)
    turned = made.act('check', {'values': {**there, 'heading_deg': 90}})
    assert turned['corners'][1] == pytest.approx([-111.2, 75.5], abs=0.2)
    away = made.act('check', {'values': {**there, 'origin_wgs84': [1, 1]}})
    assert away['ok'] and away['corners'] is None and 'not where the grid is' in away['hidden']


def test_walls_are_read_off_a_map(tmp_path: Path) -> None:
    walls = Raster(np.array([[0.0] * 8, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, np.nan, 0.5]]), 1.0, (0.0, 0.0))
    made = editor(tmp_path, picture=picture_of_map(walls), walls=walls)
    assert made.act('obstacles', {'values': {**DRAWN, 'waypoints': []}})['blocked'] == [[1, 0]]
    assert 'drag the area over it' in made.act('obstacles', {'values': {**DRAWN, 'origin': [99, 0]}})['message']
    assert '--map' in editor(tmp_path).act('obstacles', {'values': DRAWN})['message']


# -- the command line ---------------------------------------------------------------------------------
@pytest.mark.parametrize(('words', 'said'), [
    (['--map', 'x.yaml', '--picture', 'x.png'], 'draw on one of them'), (['--corners', '0,0 1,1'], 'name it by --picture'),
    (['--picture', 'x.png'], '--corners and --corners-wgs84 are not given'),
    (['--picture', 'x.png', '--corners', '0,0 1,1', '--corners-wgs84', '0,0 1,1'], 'both given'),
    (['--picture', 'x.png', '--corners', '1,1'], "corners are '1,1'"),
    (['--picture', 'x.png', '--corners', '-9,-9 1,1'], 'no such file'),
    (['--map', 'x.yaml'], 'map file x.yaml: there is no such file'), (['--port', '70000'], '--port is 70000'),
    ([str(ROOT / 'README.md')], 'that ends in .yaml'), (['no_such_folder/a.yaml'], 'there is no folder no_such_folder'),
    ([str(ROOT / 'config' / 'advise.yaml')], "it has no mapping 'grid'"),
])
def test_what_cannot_be_served_is_refused(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.run(['draw', *words]) == 2
    assert said in capsys.readouterr().err


def test_a_damaged_map_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, image = map_texts('m.pgm', Raster(np.zeros((4, 4)), 1.0, (0.0, 0.0)))
    (tmp_path / 'm.yaml').write_text(text)
    (tmp_path / 'm.pgm').write_bytes(image[:-3])
    assert command.run(['draw', '--map', str(tmp_path / 'm.yaml')]) == 2
    assert 'cut off or damaged' in capsys.readouterr().err
