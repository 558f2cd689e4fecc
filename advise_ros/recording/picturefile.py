"""A picture of the ground, an orthophoto or a floor plan, placed by its corners, or drawn from a map.

Corners are the lower left and the upper right one of a picture that stands upright, or all four from the upper left one
clockwise: in metres of the grid, or as latitude and longitude.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from advise_ros.core.errors import InputError, LogError
from advise_ros.core.grid.raster import Raster
from advise_ros.core.numerics import Floats
from advise_ros.recording.place import Place

# Longest edge [px] that a browser gets; what is larger is made smaller.
MOST_PX = 4096
# Four corners may lie so far beside a rectangle, as a share of its diagonal.
SKEWED = 0.03
# Shade of what a map does not know, as map_server's.
UNKNOWN_SHADE = 205
FORMS = {
    False: ("'X,Y X,Y' in metres", "'0,0 60,40'"),
    True: ("'LAT,LON LAT,LON' in degrees", "'47.3975,8.5450 47.3979,8.5458'"),
}


@dataclass(frozen=True)
class Corners:
    """Where the corners of a picture lie: from the upper left one clockwise.

    Attributes:
        points: (x, y) [m] on the grid's axes, or (latitude, longitude) [deg].
        on_earth: the latter.
    """

    points: tuple[tuple[float, float], ...]
    on_earth: bool = False

    def on_grid(self, place: Place | None) -> list[list[float]]:
        """(4, 2) [m] on the grid's axes.

        Args:
            place: of the grid on the earth.

        Raises:
            InputError: the grid has none, or lies elsewhere.
        """
        points = np.array(self.points, dtype=np.float64)
        if self.on_earth and place is None:
            raise InputError('the picture lies at a latitude and longitude, and the grid has none; name its origin_wgs84')
        if self.on_earth and place is not None:
            try:
                points = place.positions(points[:, 0], points[:, 1], np.zeros(len(points)))[:, :2]
            except LogError as problem:
                raise InputError(f'the picture is not where the grid is: {problem}') from None
        return [[round(float(value), 4) for value in point] for point in points]


def corners_from_text(text: str, *, on_earth: bool) -> Corners:
    """The corners that a person wrote.

    Args:
        text: two or four points, as in FORMS.
        on_earth: they are latitudes and longitudes.

    Raises:
        InputError: they are none, or no rectangle.
    """
    points = [_point(word, text, on_earth=on_earth) for word in text.replace(';', ' ').split()]
    if len(points) not in (2, 4):
        raise InputError(f'corners are {text!r}; {_wanted(on_earth=on_earth)}')
    if len(points) == 4:
        _check_rectangle(points, on_earth=on_earth)
        return Corners(tuple(points), on_earth)
    (low_x, low_y), (high_x, high_y) = (_seen(point, on_earth=on_earth) for point in points)
    if not (low_x < high_x and low_y < high_y):
        raise InputError(f'corners are {text!r}; the first is the lower left one, the second lies above it and to its right')
    upright = [(low_x, high_y), (high_x, high_y), (high_x, low_y), (low_x, low_y)]
    return Corners(tuple(_seen(point, on_earth=on_earth) for point in upright), on_earth)


def _seen(point: tuple[float, float], *, on_earth: bool) -> tuple[float, float]:
    """To the right and up, of latitude and longitude; and back."""
    return (point[1], point[0]) if on_earth else point


def _point(word: str, text: str, *, on_earth: bool) -> tuple[float, float]:
    try:
        first, second = (float(number) for number in word.split(','))
    except ValueError:
        raise InputError(f'corners are {text!r}; {_wanted(on_earth=on_earth)}') from None
    if not (math.isfinite(first) and math.isfinite(second)):
        raise InputError(f'corners are {text!r}; {word} is no place')
    if on_earth and not (-90 <= first <= 90 and -180 <= second <= 180):
        raise InputError(f'corners are {text!r}; {word} must be latitude,longitude in degrees, within 90 and 180')
    return first, second


def _wanted(*, on_earth: bool) -> str:
    form, example = FORMS[on_earth]
    return f'name the lower left and the upper right one, {form}, as {example}, or all four from the upper left one clockwise'


def _check_rectangle(points: list[tuple[float, float]], *, on_earth: bool) -> None:
    corners = np.array([_seen(point, on_earth=on_earth) for point in points])
    if on_earth:  # A degree of longitude is shorter.
        corners[:, 0] *= math.cos(math.radians(corners[:, 1].mean()))
    across, down, diagonal = corners[1] - corners[0], corners[3] - corners[0], corners[2] - corners[0]
    size = float(np.hypot(*diagonal))
    area = abs(across[0] * down[1] - across[1] * down[0])
    if size == 0.0 or area < 1e-6 * size**2:
        raise InputError('the four corners enclose nothing; name them from the upper left one clockwise')
    if float(np.hypot(*(across + down - diagonal))) > SKEWED * size:
        raise InputError('the four corners are no rectangle; name those of the whole picture from the upper left one clockwise')
    if across[0] * down[1] - across[1] * down[0] > 0:
        raise InputError('the four corners go round the wrong way; name them from the upper left one clockwise')


@dataclass(frozen=True)
class GroundPicture:
    """A picture as a browser shows it.

    Attributes:
        data, kind: its bytes, and their media type.
        corners: where it lies.
    """

    data: bytes
    kind: str
    corners: Corners


def read_picture(path: str | Path, corners: Corners) -> GroundPicture:
    """A picture in any of the usual formats (PNG, JPEG, TIFF, WebP, BMP, GIF); a very large one becomes smaller.

    Args:
        path: the file.
        corners: where it lies.

    Raises:
        InputError: it cannot be read.
    """
    try:
        data = Path(path).read_bytes()
        with Image.open(BytesIO(data)) as opened:
            opened.thumbnail((MOST_PX, MOST_PX))
            opaque = opened.convert('RGB' if opened.mode not in ('RGBA', 'LA', 'P') else 'RGBA')
    except UnidentifiedImageError:
        raise InputError(f'picture {path} is no picture that can be shown; save it as PNG or JPEG') from None
    except Image.DecompressionBombError:
        raise InputError(f'picture {path} has too many points; save a part of it, or a smaller one') from None
    except OSError as problem:
        reason = problem.strerror or 'it is damaged or cut off'
        raise InputError(f'picture {path} cannot be read ({reason.lower()}); name a PNG or JPEG file') from None
    return GroundPicture(*_encoded(opaque), corners)


def picture_of_map(raster: Raster) -> GroundPicture:
    """A map as map_server's tools draw it: obstacles dark, free places light, grey where nothing is known.

    Args:
        raster: 0 free to 1 occupied, NaN unknown.
    """
    shades = np.where(np.isfinite(raster.values), 254.0 * (1.0 - np.nan_to_num(raster.values)), UNKNOWN_SHADE)
    drawn = Image.fromarray(shades[::-1].astype(np.uint8))
    drawn.thumbnail((MOST_PX, MOST_PX))
    return GroundPicture(*_encoded(drawn), corners_of_map(raster))


def corners_of_map(raster: Raster) -> Corners:
    """Where a map lies, turned as it is."""
    rows, columns = raster.values.shape
    wide, high = columns * raster.resolution_m, rows * raster.resolution_m
    cos, sin = math.cos(raster.yaw_rad), math.sin(raster.yaw_rad)
    box: Floats = np.array([(0.0, high), (wide, high), (wide, 0.0), (0.0, 0.0)])
    turned = box @ np.array([[cos, sin], [-sin, cos]]) + np.array(raster.origin_enu_m)
    return Corners(tuple((float(x), float(y)) for x, y in turned))


def _encoded(picture: Image.Image) -> tuple[bytes, str]:
    out = BytesIO()
    lossless = picture.mode != 'RGB'
    picture.save(out, 'PNG' if lossless else 'JPEG', **({} if lossless else {'quality': 88}))
    return out.getvalue(), 'image/png' if lossless else 'image/jpeg'
