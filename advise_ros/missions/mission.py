"""A mission as other tools know it: waypoints on the earth, and areas to stay in or to keep out of."""

from __future__ import annotations

import re
from typing import NamedTuple

# Endings of the files that a mission is written to.
FORMS = ('.plan', '.waypoints', '.kml', '.geojson')
# What the name of an area says where the file has no better way to say it.
KEEP_OUT = re.compile(r'keep.?out|exclu|no.?fly|forbid|restrict|sperr|verbot', re.IGNORECASE)


class EarthPosition(NamedTuple):
    """A place on the earth.

    Attributes:
        latitude_deg, longitude_deg: WGS 84.
        height_m: above home or the ground; None where the file does not say.
    """

    latitude_deg: float
    longitude_deg: float
    height_m: float | None = None


# Corners in order; the last is joined to the first.
Ring = tuple[EarthPosition, ...]


class FlightMission(NamedTuple):
    """What a file holds.

    Attributes:
        waypoints: in the order of flight.
        stay_in: areas of which the vehicle may be in any; () for no limit.
        keep_out: areas to keep out of.
        home: where it takes off, if the file says so.
        notes: what the file holds beside that and what was not read, one sentence each.
    """

    waypoints: tuple[EarthPosition, ...]
    stay_in: tuple[Ring, ...] = ()
    keep_out: tuple[Ring, ...] = ()
    home: EarthPosition | None = None
    notes: tuple[str, ...] = ()


def as_areas(named: list[tuple[str, Ring]]) -> tuple[tuple[Ring, ...], tuple[Ring, ...], tuple[str, ...]]:
    """Areas by their names: those to stay in, those to keep out of, and a sentence on each.

    Args:
        named: name and corners.
    """
    out = [bool(KEEP_OUT.search(name)) for name, _ in named]
    notes = tuple(
        f"area '{name}' was taken as one to {'keep out of' if excluded else 'stay in'}"
        + ('' if excluded else ' (a name with "keep out" or "exclusion" makes it one to keep out of)')
        for (name, _), excluded in zip(named, out, strict=True)
    )
    stay_in = tuple(ring for (_, ring), excluded in zip(named, out, strict=True) if not excluded)
    keep_out = tuple(ring for (_, ring), excluded in zip(named, out, strict=True) if excluded)
    return stay_in, keep_out, notes
