"""QGroundControl's .plan: JSON with the mission, the fence and rally points.

https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

from advise_ros.core.errors import InputError
from advise_ros.missions.items import MissionItem, items_of, waypoints_of
from advise_ros.missions.mission import EarthPosition, FlightMission, Ring

# A circle as a polygon of so many corners, around it.
CORNERS = 24
EARTH_M = 6_371_000.0
# MAV_AUTOPILOT_GENERIC and MAV_TYPE_QUADROTOR: any ground station loads it for its own vehicle.
ANY_AUTOPILOT, QUADROTOR = 0, 2
SPEED_M_S = 2.0


def read_plan(text: str) -> FlightMission:
    """The mission of a plan.

    Raises:
        InputError: it is no plan; without the file's name.
    """
    try:
        plan = json.loads(text)
        mission = plan['mission']
        items, notes = _simple_items(mission['items'])
        home = _position(mission.get('plannedHomePosition'))
        waypoints, said = waypoints_of(items, home.height_m if home else None)
        fence = plan.get('geoFence') or {}
        areas = [(bool(one.get('inclusion', True)), _ring(one['polygon'])) for one in fence.get('polygons') or ()]
        areas += [(bool(one.get('inclusion', True)), _around(one['circle'])) for one in fence.get('circles') or ()]
        rally = (plan.get('rallyPoints') or {}).get('points') or ()
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as problem:
        raise InputError(f'it is no plan of QGroundControl ({type(problem).__name__}: {problem}); save it there again') from None
    return FlightMission(
        waypoints, tuple(ring for inside, ring in areas if inside), tuple(ring for inside, ring in areas if not inside),
        home._replace(height_m=0.0) if home else None,
        (*notes, *said, *([f'{len(rally)} rally points were not read'] if rally else ())),
    )


def _simple_items(items: Sequence[Any]) -> tuple[list[tuple[int, MissionItem]], list[str]]:
    """The simple items with their numbers from 1, and what is said about the others."""
    found: list[tuple[int, MissionItem]] = []
    notes: list[str] = []
    for number, item in enumerate(items, start=1):
        if item.get('type') != 'SimpleItem':
            kind = item.get('complexItemType', item.get('type'))
            notes.append(f'item {number} ({kind}) is a pattern and was not read; make waypoints of it in QGroundControl')
            continue
        if 'params' in item:
            params = [math.nan if value is None else float(value) for value in item['params']]
        else:  # As the first versions wrote it.
            params = [float(item.get(f'param{index}', 0.0)) for index in range(1, 5)] + [float(v) for v in item['coordinate']]
        found.append((number, MissionItem(int(item['command']), int(item['frame']), tuple(params[:4]), *params[4:7])))
    return found, notes


def _position(values: Any) -> EarthPosition | None:
    if not values or values[0] is None or values[1] is None:
        return None
    latitude, longitude, *height = values
    return EarthPosition(float(latitude), float(longitude), float(height[0]) if height and height[0] is not None else None)


def _ring(corners: Sequence[Sequence[float]]) -> Ring:
    return tuple(EarthPosition(float(one[0]), float(one[1])) for one in corners)


def _around(circle: Any) -> Ring:
    """Corners on the circle."""
    (latitude, longitude), radius_m = circle['center'][:2], float(circle['radius'])
    north_deg = math.degrees(radius_m / EARTH_M)
    east_deg = north_deg / math.cos(math.radians(latitude))
    angles = [2.0 * math.pi * corner / CORNERS for corner in range(CORNERS)]
    return tuple(EarthPosition(latitude + north_deg * math.cos(a), longitude + east_deg * math.sin(a)) for a in angles)


def write_plan(mission: FlightMission) -> str:
    """A plan with take-off, the waypoints at their heights above home, and the areas as its fence."""
    items = items_of(mission.waypoints)
    home = mission.home or mission.waypoints[0]
    plan = {
        'fileType': 'Plan', 'version': 1, 'groundStation': 'advise_ros',
        'mission': {
            'version': 2, 'firmwareType': ANY_AUTOPILOT, 'vehicleType': QUADROTOR,
            'cruiseSpeed': SPEED_M_S, 'hoverSpeed': SPEED_M_S,
            'globalPlanAltitudeMode': 1, 'plannedHomePosition': [home.latitude_deg, home.longitude_deg, 0],
            'items': [_item(number, item) for number, item in enumerate(items, start=1)],
        },
        'geoFence': {
            'version': 2, 'circles': [],
            'polygons': [
                {'version': 1, 'inclusion': inside, 'polygon': [[one.latitude_deg, one.longitude_deg] for one in ring]}
                for inside, rings in ((True, mission.stay_in), (False, mission.keep_out)) for ring in rings
            ],
        },
        'rallyPoints': {'version': 2, 'points': []},
    }
    return json.dumps(plan, indent=4) + '\n'


def _item(number: int, item: MissionItem) -> dict[str, Any]:
    return {
        'type': 'SimpleItem', 'command': item.command, 'frame': item.frame, 'doJumpId': number, 'autoContinue': True,
        'params': [*item.params, item.latitude_deg, item.longitude_deg, item.height_m],
        'Altitude': item.height_m, 'AltitudeMode': 1, 'AMSLAltAboveTerrain': None,
    }
