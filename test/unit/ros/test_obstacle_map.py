"""A map message as obstacles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from nav_msgs.msg import OccupancyGrid

from advise_ros.core.errors import InputError
from advise_ros.ros.obstacle_map import raster_of


def message(**changes: object) -> OccupancyGrid:
    found = OccupancyGrid()
    found.header.frame_id = 'map'
    found.info.resolution, found.info.width, found.info.height = 0.05, 2, 1
    found.info.origin.position.x, found.info.origin.orientation.w = 3.0, 1.0
    found.data = [100, -1]
    for name, value in changes.items():
        setattr(found.header if name == 'frame_id' else found.info if hasattr(found.info, name) else found, name, value)
    return found


def test_per_cent_become_shares_and_minus_one_unknown() -> None:
    found = raster_of(message())
    assert np.allclose(found.values, [[1.0, np.nan]], equal_nan=True)
    assert (found.resolution_m, found.origin_enu_m, found.yaw_rad) == (0.05, (3.0, 0.0), 0.0)


def test_a_turned_map_is_turned() -> None:
    turned = message()
    turned.info.origin.orientation.z, turned.info.origin.orientation.w = math.sin(0.2), math.cos(0.2)
    assert raster_of(turned).yaw_rad == pytest.approx(0.4)


@pytest.mark.parametrize(('changes', 'words'), [
    ({'frame_id': 'odom'}, "it is in frame 'odom'; it must be in 'map'"),
    ({'width': 3}, 'it says 3 x 1 cells of 0.05 m and holds 2'),
    ({'resolution': 0.0}, 'cells of 0 m'),
])
def test_a_map_that_says_nothing_of_places_is_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        raster_of(message(**changes))
