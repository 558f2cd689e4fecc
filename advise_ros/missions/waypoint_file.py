"""Waypoint files ("QGC WPL 110"), as Mission Planner, mavproxy and MAVROS write them; pymavlink reads them.

https://mavlink.io/en/file_formats/
"""

from __future__ import annotations

from pathlib import Path

from pymavlink import mavwp

from advise_ros.core.errors import InputError
from advise_ros.missions.items import OF_THE_SEA, WAYPOINT, MissionItem, items_of, waypoints_of
from advise_ros.missions.mission import EarthPosition, FlightMission


def read_waypoints(path: Path) -> FlightMission:
    """The mission of a waypoint file, whose first item is home.

    Raises:
        InputError: it is none; without the file's name.
    """
    loader = mavwp.MAVWPLoader()
    try:
        count = loader.load(str(path))
    except (mavwp.MAVWPError, ValueError, IndexError, UnicodeDecodeError) as problem:
        raise InputError(f'it is no sound waypoint file ({problem}); save it again') from None
    items = [_item(loader.wp(index)) for index in range(count)]
    if not items:
        return FlightMission(())
    first = items[0]
    home = EarthPosition(first.latitude_deg, first.longitude_deg, first.height_m) if first.frame in OF_THE_SEA else None
    numbered = list(enumerate(items))[1 if home else 0 :]
    waypoints, notes = waypoints_of(numbered, home.height_m if home else None)
    known = home if home and (home.latitude_deg or home.longitude_deg) else None
    return FlightMission(waypoints, home=known._replace(height_m=0.0) if known else None, notes=tuple(notes))


def _item(wp: object) -> MissionItem:
    values = {name: getattr(wp, name) for name in ('command', 'frame', 'param1', 'param2', 'param3', 'param4', 'x', 'y', 'z')}
    params = tuple(float(values[f'param{index}']) for index in range(1, 5))
    return MissionItem(int(values['command']), int(values['frame']), params, *(float(values[name]) for name in 'xyz'))


def write_waypoints(mission: FlightMission) -> str:
    """Home, take-off and the waypoints at their heights above it; areas have no place in such a file.

    pymavlink would write six decimals, which are 11 cm.
    """
    home = mission.home or mission.waypoints[0]
    first = MissionItem(WAYPOINT, OF_THE_SEA[0], (0.0, 0.0, 0.0, 0.0), home.latitude_deg, home.longitude_deg, 0.0)
    rows = [
        (number, int(number == 0), item.frame, item.command, *(f'{value:g}' for value in item.params),
         f'{item.latitude_deg:.9f}', f'{item.longitude_deg:.9f}', f'{item.height_m:.3f}', 1)
        for number, item in enumerate((first, *items_of(mission.waypoints)))
    ]
    return 'QGC WPL 110\n' + ''.join('\t'.join(map(str, row)) + '\n' for row in rows)
