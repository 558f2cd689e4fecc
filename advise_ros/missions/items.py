"""FlightMission items of MAVLink (MAV_CMD, MAV_FRAME), as .plan and .waypoints files hold them and vehicles are sent them.

https://mavlink.io/en/messages/common.html#mav_commands
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from advise_ros.mavlink.messages import dialect
from advise_ros.missions.mission import EarthPosition

WAYPOINT, TAKE_OFF = int(dialect.MAV_CMD_NAV_WAYPOINT), int(dialect.MAV_CMD_NAV_TAKEOFF)
# Commands that are flown to; a vehicle also stays a while at some of them, or passes on a curve.
FLOWN_TO = {
    WAYPOINT: '', int(dialect.MAV_CMD_NAV_SPLINE_WAYPOINT): '',
    int(dialect.MAV_CMD_NAV_LOITER_UNLIM): 'loitering', int(dialect.MAV_CMD_NAV_LOITER_TURNS): 'loitering',
    int(dialect.MAV_CMD_NAV_LOITER_TIME): 'loitering',
}
# Height above home; above the sea; above the ground.
RELATIVE = (int(dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT), int(dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT),
            int(dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT), int(dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT))
OF_THE_SEA = (int(dialect.MAV_FRAME_GLOBAL), int(dialect.MAV_FRAME_GLOBAL_INT))


class MissionItem(NamedTuple):
    """One item.

    Attributes:
        command: MAV_CMD.
        frame: MAV_FRAME.
        params: the first four.
        latitude_deg, longitude_deg, height_m: the last three; not a number where the file has none.
    """

    command: int
    frame: int
    params: tuple[float, ...]
    latitude_deg: float
    longitude_deg: float
    height_m: float


def name_of(command: int) -> str:
    """The command in words: 'RETURN_TO_LAUNCH'."""
    known = dialect.enums['MAV_CMD'].get(command)
    return str(known.name).removeprefix('MAV_CMD_').removeprefix('NAV_') if known else f'command {command}'


def waypoints_of(items: Iterable[tuple[int, MissionItem]], home_m: float | None) -> tuple[tuple[EarthPosition, ...], list[str]]:
    """The places that are flown to, and one sentence on each item that is something else.

    Args:
        items: each with its number in the file.
        home_m: height of home above the sea, where it is known.
    """
    found: list[EarthPosition] = []
    notes: list[str] = []
    for number, item in items:
        if item.command not in FLOWN_TO:
            notes.append(f'item {number} ({name_of(item.command)}) is no waypoint and was not read')
        elif not _is_a_place(item):
            notes.append(f'item {number} ({name_of(item.command)}) names no place and was not read')
        else:
            found.append(EarthPosition(item.latitude_deg, item.longitude_deg, _height(item, home_m)))
            if FLOWN_TO[item.command]:
                notes.append(f'item {number}: only the place was read, not the {FLOWN_TO[item.command]} there')
    return tuple(found), notes


def _is_a_place(item: MissionItem) -> bool:
    at = item.latitude_deg, item.longitude_deg
    on_earth = item.frame in (*RELATIVE, *OF_THE_SEA)
    return on_earth and all(map(math.isfinite, at)) and abs(at[0]) <= 90 and abs(at[1]) <= 180 and at != (0.0, 0.0)


def _height(item: MissionItem, home_m: float | None) -> float | None:
    if not math.isfinite(item.height_m):
        return None
    if item.frame in RELATIVE:
        return item.height_m
    return None if home_m is None else item.height_m - home_m


def items_of(route: Iterable[EarthPosition]) -> list[MissionItem]:
    """Take-off at the first place, and then each of them, at their heights above home."""
    places = list(route)
    return [
        MissionItem(
            WAYPOINT if index else TAKE_OFF, RELATIVE[0], (0.0, 0.0, 0.0, 0.0),
            place.latitude_deg, place.longitude_deg, place.height_m or 0.0,
        )
        for index, place in enumerate(places[:1] + places)
    ]
