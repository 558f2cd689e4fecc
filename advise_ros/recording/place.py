"""Where a grid lies on the earth, and positions on the earth as metres on the grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from advise_ros.core.errors import LogError

Floats = npt.NDArray[np.float64]
# Nobody flies further from the grid: another place was meant.
FARTHEST_M = 50_000.0
# So many fixes at the beginning and at the end of a recording say how high the ground is.
AT_REST = 3


@dataclass(frozen=True)
class Place:
    """The place and the heading of a grid's axes.

    Attributes:
        latitude_deg, longitude_deg: of the origin of the grid's metres (WGS 84).
        heading_deg: of the grid's y axis, clockwise from true north.
    """

    latitude_deg: float
    longitude_deg: float
    heading_deg: float = 0.0

    def turned(self, vectors_enu: Floats) -> Floats:
        """Vectors along east, north and up as vectors along the grid's axes.

        Args:
            vectors_enu: (n, 3).
        """
        heading = np.deg2rad(self.heading_deg)
        east, north, up = vectors_enu.T
        cos, sin = np.cos(heading), np.sin(heading)
        return np.column_stack([east * cos - north * sin, east * sin + north * cos, up])

    def positions(self, latitudes_deg: Floats, longitudes_deg: Floats, heights_m: Floats) -> Floats:
        """Positions on the grid's axes; not a number where there was no fix (latitude and longitude 0).

        Args:
            latitudes_deg, longitudes_deg: (n,) WGS 84.
            heights_m: (n,) above the ground at the origin.

        Returns:
            (n, 3) [m].

        Raises:
            LogError: all of them are far away.
        """
        from pymap3d import geodetic2enu  # noqa: PLC0415  most grids have no place

        east, north, _ = geodetic2enu(latitudes_deg, longitudes_deg, 0.0, self.latitude_deg, self.longitude_deg, 0.0)
        found = np.column_stack([east, north, heights_m]).astype(np.float64)
        found[(np.abs(latitudes_deg) < 1e-6) & (np.abs(longitudes_deg) < 1e-6)] = np.nan
        away_m = np.hypot(found[:, 0], found[:, 1])
        known = away_m[np.isfinite(away_m)]
        if known.size and known.min() > FARTHEST_M:
            raise LogError(
                f'its positions lie {known.min() / 1000:.0f} km from origin_wgs84 [{self.latitude_deg}, {self.longitude_deg}] '
                'of the grid file, which is [latitude, longitude]; the first is at '
                f'[{latitudes_deg[np.isfinite(away_m)][0]:.6f}, {longitudes_deg[np.isfinite(away_m)][0]:.6f}]'
            )
        return self.turned(found)

    def on_earth(self, positions_m: Floats) -> Floats:
        """Latitudes and longitudes [deg] (n, 2) of positions (n, 2) along the grid's axes: the way back of `positions`."""
        from pymap3d import enu2geodetic  # noqa: PLC0415  most grids have no place

        heading = np.deg2rad(self.heading_deg)
        x, y = np.asarray(positions_m, dtype=np.float64).T
        east, north = x * np.cos(heading) + y * np.sin(heading), y * np.cos(heading) - x * np.sin(heading)
        latitudes, longitudes, _ = enu2geodetic(east, north, 0.0, self.latitude_deg, self.longitude_deg, 0.0)
        return np.column_stack([latitudes, longitudes])

    def fixes(self, fixes: Floats) -> tuple[Floats, float]:
        """Positions of a satellite receiver, whose altitudes are above the ellipsoid or the sea.

        Args:
            fixes: (n, 3) latitude, longitude [deg] and altitude [m]; not a number without a fix.

        Returns:
            (n, 3) [m] along the grid's axes, and the altitude [m] they count from: the lower one of where it began and ended.

        Raises:
            LogError: all of them are far away, or there is none.
        """
        heights = fixes[np.isfinite(fixes).all(axis=1), 2]
        if not heights.size:
            raise LogError('none of its positions has a fix; record where the sky is to be seen, or name another topic')
        ground_m = float(min(np.median(heights[:AT_REST]), np.median(heights[-AT_REST:])))
        return self.positions(fixes[:, 0], fixes[:, 1], fixes[:, 2] - ground_m), ground_m

    def moved(self, positions_enu_m: Floats, latitudes_deg: Floats, longitudes_deg: Floats) -> Floats:
        """Positions from origins of their own as positions from the grid's.

        Args:
            positions_enu_m: (n, 3) east, north and up of their origins.
            latitudes_deg, longitudes_deg: (n,) of these.

        Returns:
            (n, 3) [m] along the grid's axes.

        Raises:
            LogError: all of them are far away.
        """
        origins = self.positions(latitudes_deg, longitudes_deg, np.zeros(len(positions_enu_m)))
        return self.turned(positions_enu_m) + origins
