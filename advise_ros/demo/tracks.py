"""Positions heard during the demo, cut into flights."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from geometry_msgs.msg import PoseStamped

from advise_ros.core.people.known_site import Site
from advise_ros.core.units import NS


class TrackLog:
    """Every position of the run, in order of arrival."""

    def __init__(self) -> None:
        self._stamps_ns: list[int] = []
        self._positions_enu_m: list[tuple[float, float]] = []

    def on_pose(self, pose: PoseStamped) -> None:
        self._stamps_ns.append(pose.header.stamp.sec * NS + pose.header.stamp.nanosec)
        self._positions_enu_m.append((pose.pose.position.x, pose.pose.position.y))

    def last_stamp_ns(self) -> int:
        return self._stamps_ns[-1] if self._stamps_ns else 0

    def between(self, start_ns: int, end_ns: int) -> npt.NDArray[np.float64]:
        """(n, 2) positions with start <= stamp <= end."""
        stamps = np.array(self._stamps_ns, dtype=np.int64)
        positions = np.array(self._positions_enu_m, dtype=np.float64).reshape(-1, 2)
        return positions[: len(stamps)][(stamps >= start_ns) & (stamps <= end_ns)]


def entered_cells(site: Site, positions_enu_m: npt.NDArray[np.float64]) -> tuple[int, ...]:
    """Cells to keep out of that hold any of the positions (n, 2), ascending."""
    cells = {site.grid.cell_at(east, north) for east, north in positions_enu_m.tolist()}
    return tuple(sorted(cell for cell in cells if cell is not None and site.keep_out[cell]))
