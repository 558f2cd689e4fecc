"""Maps as nav2's map_server and map_saver have them: a YAML file beside an image.

https://docs.nav2.org/configuration/packages/configuring-map-server.html. Modes: `trinary` and `scale` by thresholds on the
darkness of a pixel, `raw` with per cent in the pixel and unknown above 100. Images: PGM (P2, P5) and PNG.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from advise_ros.core.errors import InputError
from advise_ros.core.grid.raster import Raster
from advise_ros.core.numerics import Floats
from advise_ros.yaml_problem import in_words

MODES = ('trinary', 'scale', 'raw')
NEEDED = ('image', 'resolution', 'origin', 'negate', 'occupied_thresh', 'free_thresh')
# A pixel of mode raw that is not per cent.
UNKNOWN_PIXEL = 255
HEAD = '# Per cent in the pixels, 255 where unknown.\n'
# Magic number, width, height and largest value, with comments between.
PGM_HEAD = re.compile(rb'(P[25])(?:\s|#[^\n]*\n)+?(\d+)(?:\s|#[^\n]*\n)+?(\d+)(?:\s|#[^\n]*\n)+?(\d+)\s')
MOST_PIXELS = 100_000_000


@dataclass(frozen=True)
class MapFile:
    """The keys of a map's YAML file."""

    image: Path
    mode: str
    resolution_m: float
    origin: tuple[float, float, float]
    negate: bool
    occupied_thresh: float
    free_thresh: float


def read_map(path: str | Path) -> Raster:
    """A map: 0 free to 1 occupied, NaN unknown.

    Args:
        path: its YAML file.

    Raises:
        InputError: a file is missing or damaged, or a key is missing or of the wrong type; names file, key and remedy.
    """
    try:
        described = _described(Path(path))
        shades, alpha = _pixels(described.image)
        values = _occupancy(described, shades, alpha)
    except InputError as problem:
        raise InputError(f'map file {path}: {problem}') from problem
    x, y, yaw = described.origin
    return Raster(values[::-1], described.resolution_m, (x, y), yaw)


def map_texts(name: str, raster: Raster) -> tuple[str, bytes]:
    """What the YAML file and the image (`name`, PGM) of a map hold, in mode raw.

    Args:
        name: of the image, in the folder of the YAML file.
        raster: 0 to 1, NaN unknown.
    """
    known = np.isfinite(raster.values)
    pixels = np.full(raster.values.shape, UNKNOWN_PIXEL, dtype=np.uint8)
    pixels[known] = np.round(100.0 * np.clip(raster.values[known], 0.0, 1.0)).astype(np.uint8)
    rows, columns = raster.values.shape
    values = {
        'image': name, 'mode': 'raw', 'resolution': raster.resolution_m, 'origin': [*raster.origin_enu_m, raster.yaw_rad],
        'negate': 0, 'occupied_thresh': 0.65, 'free_thresh': 0.25,
    }
    image = b'P5\n%d %d\n255\n' % (columns, rows) + pixels[::-1].tobytes()
    return HEAD + yaml.safe_dump(values, sort_keys=False, default_flow_style=None), image


# -- the YAML file ---------------------------------------------------------------------------------
def _described(path: Path) -> MapFile:
    try:
        values = yaml.safe_load(path.read_text(encoding='utf-8'))
    except FileNotFoundError:
        raise InputError('there is no such file; name the YAML file of a map that map_saver wrote') from None
    except OSError as problem:
        raise InputError(f'it cannot be read ({problem.strerror})') from None
    except (yaml.YAMLError, UnicodeDecodeError) as problem:
        raise InputError(f'{in_words(problem)}; name the YAML file of the map, not its image') from None
    if not isinstance(values, dict):
        raise InputError('it holds no keys of a map; name the YAML file of a map that map_saver wrote')
    for key in NEEDED:
        if key not in values:
            raise InputError(f"key '{key}' is missing; a map has {', '.join(NEEDED)}")
    mode = values.get('mode', MODES[0])
    if mode not in MODES:
        raise InputError(f"key 'mode' is {mode!r}; it must be one of {', '.join(MODES)}")
    resolution_m, occupied, free = (_number(values, key) for key in ('resolution', 'occupied_thresh', 'free_thresh'))
    if resolution_m <= 0:
        raise InputError(f"key 'resolution' is {resolution_m}; it must be a positive number of metres")
    if mode != 'raw' and not 0 <= free < occupied <= 1:
        raise InputError(f'free_thresh is {free} and occupied_thresh {occupied}; both lie in 0 to 1, and free_thresh is lower')
    image, origin, negate = path.parent / str(values['image']), _origin(values['origin']), _negate(values['negate'])
    return MapFile(image, mode, resolution_m, origin, negate, occupied, free)


def _number(values: Mapping[str, Any], key: str) -> float:
    value = values[key]
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InputError(f"key '{key}' is {value!r}; it must be a number")
    return float(value)


def _origin(value: Any) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"key 'origin' is {value!r}; it must be [x, y, yaw] in metres and radians")
    x, y, yaw = (_number({'origin': one}, 'origin') for one in value)
    return x, y, yaw


def _negate(value: Any) -> bool:
    if value not in (0, 1):
        raise InputError(f"key 'negate' is {value!r}; it must be 0 or 1")
    return bool(value)


# -- the image -------------------------------------------------------------------------------------
def _pixels(path: Path) -> tuple[Floats, Floats | None]:
    """(rows, columns) brightness from 0 black to 1 white, top row first, and the opacity where there is one."""
    try:
        data = path.read_bytes()
    except OSError as problem:
        raise InputError(f'its image {path} cannot be read ({problem.strerror})') from None
    if data.startswith((b'P2', b'P5')):
        return _pgm(path, data), None
    if data.startswith(b'\x89PNG'):
        return _png(path, data)
    raise InputError(f'its image {path} is neither PGM (P2, P5) nor PNG; save it as one of these')


def _pgm(path: Path, data: bytes) -> Floats:
    head = PGM_HEAD.match(data)
    if head is None:
        raise InputError(f'its image {path} is a damaged PGM file; save the map again')
    columns, rows, most = int(head[2]), int(head[3]), int(head[4])
    if not 0 < columns * rows <= MOST_PIXELS or not 0 < most < 65536:
        raise InputError(f'its image {path} is a damaged PGM file; save the map again')
    body = data[head.end():]
    try:
        if head[1] == b'P2':
            pixels = np.array(body.split()[: rows * columns], dtype=np.float64)
        else:
            pixels = np.frombuffer(body, dtype='>u2' if most > 255 else 'u1', count=rows * columns).astype(np.float64)
        return pixels.reshape(rows, columns) / most
    except ValueError:
        raise InputError(f'its image {path} is cut off or damaged: it is to have {columns} x {rows} pixels') from None


def _png(path: Path, data: bytes) -> tuple[Floats, Floats | None]:
    from matplotlib.image import imread  # noqa: PLC0415 - seldom wanted, and slow to import

    try:
        pixels = np.asarray(imread(BytesIO(data), format='png'), dtype=np.float64)
    except (OSError, ValueError, SyntaxError):
        raise InputError(f'its image {path} is a damaged PNG file; save the map again') from None
    if pixels.ndim == 2:
        return pixels, None
    return pixels[:, :, :3].mean(axis=2), pixels[:, :, 3] if pixels.shape[2] > 3 else None


def _occupancy(described: MapFile, shades: Floats, alpha: Floats | None) -> Floats:
    """(rows, columns) occupancy by the rules of map_server."""
    if described.mode == 'raw':
        percent = np.round(shades * 255.0)
        return np.where(percent <= 100, percent / 100.0, np.nan)
    if described.mode == 'trinary' and alpha is not None:  # As map_server: opacity counts as one more colour.
        shades = (shades * 3.0 + alpha) / 4.0
    dark = shades if described.negate else 1.0 - shades
    low, high = described.free_thresh, described.occupied_thresh
    between = np.full(dark.shape, np.nan) if described.mode == 'trinary' else np.round((dark - low) / (high - low), 2)
    values = np.where(dark > high, 1.0, np.where(dark < low, 0.0, between))
    return values if described.mode == 'trinary' or alpha is None else np.where(alpha < 1.0, np.nan, values)
