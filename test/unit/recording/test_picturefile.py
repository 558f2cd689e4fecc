"""Pictures of the ground: where their corners lie, and a sentence for what is none."""

from __future__ import annotations

import math
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from advise_ros.core.errors import InputError
from advise_ros.core.grid.raster import Raster
from advise_ros.recording.picturefile import Corners, corners_from_text, picture_of_map, read_picture
from advise_ros.recording.place import Place

HOME = Place(47.3977, 8.5456)
BOX = Corners(((0.0, 40.0), (60.0, 40.0), (60.0, 0.0), (0.0, 0.0)))


def test_two_corners_are_those_of_an_upright_picture() -> None:
    assert corners_from_text('0,0 60,40', on_earth=False) == BOX
    assert corners_from_text(' 0,40; 60,40; 60,0; 0,0 ', on_earth=False) == BOX


def test_corners_on_the_earth_turn_with_the_grid() -> None:
    places = HOME.on_earth(np.array([(0.0, 0.0), (60.0, 40.0)]))
    text = ' '.join(f'{latitude:.9f},{longitude:.9f}' for latitude, longitude in places)
    corners = corners_from_text(text, on_earth=True)
    assert np.abs(np.array(corners.on_grid(HOME)) - np.array(BOX.points)).max() < 0.01
    turned = np.array(corners.on_grid(Place(HOME.latitude_deg, HOME.longitude_deg, 90.0)))
    assert turned[1] == pytest.approx((-40.0, 60.0), abs=0.01), 'the y axis points east: what lies north lies to the left'


@pytest.mark.parametrize(('text', 'on_earth', 'said'), [
    ('', False, "lower left and the upper right one, 'X,Y X,Y' in metres"), ('0,0', False, 'or all four'),
    ('0,0 5', False, "'0,0 60,40'"), ('0,0 x,y', False, "corners are '0,0 x,y'"), ('0,0 inf,4', False, 'inf,4 is no place'),
    ('60,40 0,0', False, 'the first is the lower left one'), ('0,0 0,40', False, 'to its right'),
    ('91,8 92,9', True, 'within 90 and 180'), ('47,8 47', True, "'LAT,LON LAT,LON' in degrees"),
    ('0,40 60,40 50,0 0,0', False, 'no rectangle'), ('0,0 60,0 60,40 0,40', False, 'the wrong way'),
    ('0,0 0,0 0,0 0,0', False, 'enclose nothing'),
])
def test_corners_that_are_none_are_named(text: str, on_earth: bool, said: str) -> None:
    with pytest.raises(InputError) as problem:
        corners_from_text(text, on_earth=on_earth)
    assert said in str(problem.value)


def test_a_place_far_away_or_none_is_named() -> None:
    corners = corners_from_text('1.0,8.0 1.1,8.1', on_earth=True)
    with pytest.raises(InputError, match=r'not where the grid is: .* km from origin_wgs84'):
        corners.on_grid(HOME)
    with pytest.raises(InputError, match='name its origin_wgs84'):
        corners.on_grid(None)


@pytest.mark.parametrize(('mode', 'kind', 'read_as'), [
    ('RGB', 'PNG', 'image/jpeg'), ('RGBA', 'PNG', 'image/png'), ('L', 'TIFF', 'image/jpeg'), ('P', 'GIF', 'image/png'),
    ('CMYK', 'JPEG', 'image/jpeg'), ('I;16', 'TIFF', 'image/jpeg'),
])
def test_the_usual_formats_are_shown(tmp_path: Path, mode: str, kind: str, read_as: str) -> None:
    Image.new(mode, (5000, 30)).save(tmp_path / 'ortho', kind)
    found = read_picture(tmp_path / 'ortho', BOX)
    assert found.kind == read_as and found.corners == BOX
    assert Image.open(BytesIO(found.data)).size == (4096, 25), 'made smaller'


@pytest.mark.parametrize(('data', 'said'), [
    (b'', 'no picture that can be shown'), (b'a text', 'save it as PNG or JPEG'), (None, 'no such file'),
    ('cut', 'cannot be read'),
])
def test_a_picture_that_is_none_is_named(tmp_path: Path, data: bytes | str | None, said: str) -> None:
    path = tmp_path / 'ortho.png'
    if data == 'cut':
        out = BytesIO()
        Image.effect_noise((90, 90), 50).save(out, 'PNG')
        data = out.getvalue()[:900]
    if isinstance(data, bytes):
        path.write_bytes(data)
    with pytest.raises(InputError, match=f'picture {path}.*{said}'):
        read_picture(path, BOX)


def test_a_map_is_drawn_as_it_lies() -> None:
    values = np.array([[0.0, 1.0], [np.nan, 0.0]])
    found = picture_of_map(Raster(values, 2.0, (10.0, 20.0)))
    assert np.asarray(Image.open(BytesIO(found.data))).tolist() == [[205, 254], [254, 0]], 'the northern row is the upper one'
    assert found.corners.points == ((10.0, 24.0), (14.0, 24.0), (14.0, 20.0), (10.0, 20.0))
    turned = picture_of_map(Raster(values, 2.0, (10.0, 20.0), math.pi / 2)).corners.points
    assert np.allclose(turned, [(6.0, 20.0), (6.0, 24.0), (10.0, 24.0), (10.0, 20.0)])
