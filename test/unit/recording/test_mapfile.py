"""Maps of nav2's map_server."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from matplotlib.image import imsave

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.raster import Raster
from advise_ros.recording.gridfile import grid_to_mapping, load_grid
from advise_ros.recording.mapfile import map_texts, read_map

KEYS = {
    'image': 'map.pgm', 'mode': 'trinary', 'resolution': 0.05, 'origin': [-1.0, 2.0, 0.0], 'negate': 0,
    'occupied_thresh': 0.65, 'free_thresh': 0.25,
}
PIXELS = ((0, 254), (205, 100))
NAN = float('nan')


def write(folder: Path, data: bytes = b'P5\n2 2\n255\n' + bytes(np.array(PIXELS, dtype=np.uint8)), **keys: object) -> Path:
    values = {name: value for name, value in {**KEYS, **keys}.items() if value is not None}
    (folder / 'map.pgm').write_bytes(data)
    (folder / 'map.yaml').write_text(yaml.safe_dump(values))
    return folder / 'map.yaml'


@pytest.mark.parametrize(('keys', 'expected'), [
    ({}, [[0.0, NAN], [1.0, 0.0]]),
    ({'mode': None}, [[0.0, NAN], [1.0, 0.0]]),
    ({'free_thresh': 0.1}, [[NAN, NAN], [1.0, 0.0]]),
    ({'negate': 1}, [[1.0, NAN], [0.0, 1.0]]),
    ({'mode': 'scale', 'free_thresh': 0.1, 'occupied_thresh': 0.9}, [[0.12, 0.63], [1.0, 0.0]]),
    ({'mode': 'raw'}, [[NAN, 1.0], [0.0, NAN]]),
])
def test_pixels_mean_what_map_server_says(tmp_path: Path, keys: dict[str, object], expected: list[list[float]]) -> None:
    """Row 0 of the values is the southern one, which is the last of the image."""
    found = read_map(write(tmp_path, **keys))
    assert np.allclose(found.values, expected, equal_nan=True)
    assert (found.resolution_m, found.origin_enu_m, found.yaw_rad) == (0.05, (-1.0, 2.0), 0.0)


@pytest.mark.parametrize('image', [
    b'P2\n# by hand\n2 2\n255\n0 254\n205 100\n',
    b'P5 2 2 # columns, rows\n255\n' + bytes(np.array(PIXELS, dtype=np.uint8)),
    b'P5\n2 2\n65535\n' + (np.array(PIXELS, dtype='>u2') * 257).tobytes(),
])
def test_every_kind_of_pgm_is_read(tmp_path: Path, image: bytes) -> None:
    assert np.allclose(read_map(write(tmp_path, image)).values, [[0.0, NAN], [1.0, 0.0]], equal_nan=True)


def test_png_is_read_and_what_is_not_opaque_is_unknown_in_mode_scale(tmp_path: Path) -> None:
    pixels = np.zeros((2, 2, 4), dtype=np.uint8)
    pixels[:, :, :3] = np.array(PIXELS)[:, :, None]
    pixels[:, :, 3] = [[255, 255], [255, 0]]
    imsave(tmp_path / 'map.png', pixels)
    path = write(tmp_path, b'', mode='scale', free_thresh=0.1, occupied_thresh=0.9)
    path.write_text(path.read_text().replace('map.pgm', 'map.png'))
    assert np.allclose(read_map(path).values, [[0.12, NAN], [1.0, 0.0]], equal_nan=True)
    path.write_text(path.read_text().replace('scale', 'trinary').replace('0.1', '0.25').replace('0.9', '0.65'))
    assert np.allclose(read_map(path).values, [[0.0, 1.0], [1.0, 0.0]], equal_nan=True)


def test_what_is_written_is_read_back_to_the_per_cent(tmp_path: Path) -> None:
    values = np.array([[0.0, 0.07, 0.5], [0.996, 1.0, np.nan]])
    described, image = map_texts('map.pgm', Raster(values, 2.0, (-1.0, 3.5)))
    (tmp_path / 'map.yaml').write_text(described)
    (tmp_path / 'map.pgm').write_bytes(image)
    found = read_map(tmp_path / 'map.yaml')
    assert np.allclose(found.values, np.round(values, 2), equal_nan=True)
    assert (found.resolution_m, found.origin_enu_m) == (2.0, (-1.0, 3.5))
    assert image.endswith(bytes([100, 100, 255, 0, 7, 50])), 'the northern row comes first'


@pytest.mark.parametrize(('keys', 'words'), [
    ({'resolution': None}, "key 'resolution' is missing"),
    ({'resolution': 0}, "key 'resolution' is 0.0; it must be a positive number"),
    ({'resolution': 'fine'}, "key 'resolution' is 'fine'; it must be a number"),
    ({'origin': [1, 2]}, r"key 'origin' is \[1, 2\]; it must be \[x, y, yaw\]"),
    ({'mode': 'colour'}, "key 'mode' is 'colour'; it must be one of trinary, scale, raw"),
    ({'negate': 'no'}, "key 'negate' is 'no'; it must be 0 or 1"),
    ({'free_thresh': 0.7}, 'free_thresh is 0.7 and occupied_thresh 0.65'),
    ({'image': 'none.pgm'}, 'none.pgm cannot be read'),
    ({'image': 'map.yaml'}, 'is neither PGM .P2, P5. nor PNG'),
])
def test_wrong_keys_are_named(tmp_path: Path, keys: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_map(write(tmp_path, **keys))
    assert str(tmp_path / 'map.yaml') in str(caught.value)


@pytest.mark.parametrize(('image', 'words'), [
    (b'P5\n2 2\n255\n\0\0\0', 'cut off or damaged: it is to have 2 x 2 pixels'),
    (b'P2\n2 2\n255\n1 2 x 4', 'cut off or damaged'),
    (b'P5\n2\n', 'damaged PGM file'),
    (b'P5\n99999999 99999999\n255\n', 'damaged PGM file'),
    (b'\x89PNG\r\n', 'damaged PNG file'),
])
def test_damaged_images_are_named(tmp_path: Path, image: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_map(write(tmp_path, image))


def test_other_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / 'a.yaml').write_text('[1]')
    (tmp_path / 'b.yaml').write_text(':\n\t-')
    for name, words in (('none.yaml', 'no such file'), ('a.yaml', 'no keys of a map'), ('b.yaml', 'not a YAML')):
        with pytest.raises(InputError, match=words):
            read_map(tmp_path / name)
    with pytest.raises(InputError, match='cannot be read'):
        read_map(tmp_path)


def test_obstacles_of_a_map_are_blocked_cells_of_the_grid(tmp_path: Path) -> None:
    """Beside those that the grid file blocks itself."""
    grid = Grid(1.0, 4, 3, (0.0, 0.0), 5.0, (3, 11, 0), blocked=(4,))
    (tmp_path / 'grid.yaml').write_text(yaml.safe_dump({'grid': grid_to_mapping(grid)}))
    pixels = np.full((30, 40), 254, dtype=np.uint8)
    pixels[12:16, 22:27] = 0  # Row 12 from the top: 1.4 to 1.8 m north; 2.2 to 2.7 m east: cell (2, 1).
    file = write(tmp_path, b'P5\n40 30\n255\n' + pixels.tobytes(), resolution=0.1, origin=[0.0, 0.0, 0.0])
    assert load_grid(tmp_path / 'grid.yaml', file).blocked == (4, 6)
    file = write(tmp_path, b'P5\n40 30\n255\n' + bytes(1200), resolution=0.1, origin=[0.0, 0.0, 0.0])
    with pytest.raises(InputError, match=r'map.yaml: waypoint 1, cell \[3, 0\], is in an obstacle'):
        load_grid(tmp_path / 'grid.yaml', file)
