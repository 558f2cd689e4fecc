"""A mission onto a vehicle, by MAVLink. Starts nothing, changes no mode."""

from __future__ import annotations

import time
from collections.abc import Callable

from advise_ros.core.errors import AdviseError, InputError
from advise_ros.mavlink.companion import Companion, Settings, Status
from advise_ros.mavlink.exchange import exchange, serve_until
from advise_ros.mavlink.link import Link
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.mission_transfer import MissionTransfer, WireItem
from advise_ros.missions.items import OF_THE_SEA, WAYPOINT, MissionItem, items_of
from advise_ros.missions.mission import FlightMission

# Beside the bridge (191), the recorder (192) and fly_check (193).
OWN = Settings(component_id=194)
TURN_S = 0.01
# A heartbeat comes once a second.
WAIT_S = 10.0
# Modes in which a vehicle flies its mission: changing that under it is no upload.
MISSION_MODES = ('AUTO', 'MISSION')
MOST_ITEMS = 650


class UploadError(AdviseError):
    """The vehicle did not take the mission, or not as it was sent."""


def upload(mission: FlightMission, url: str, baud: int = 115200, say: Callable[[str], object] = lambda text: None) -> str:
    """Send take-off and the waypoints to the vehicle at the other end of a link, read them back and compare.

    Args:
        mission: with heights above home.
        url: connection string, e.g. udpin:127.0.0.1:14550.
        baud: of a serial device.
        say: takes progress.

    Returns:
        What was done, for people.

    Raises:
        InputError: the link cannot be opened, or nothing answers there.
        UploadError: it was not taken, or not as it was sent.
    """
    link = Link(url, baud=baud, system_id=OWN.system_id, component_id=OWN.component_id)
    try:
        link.start()
        return _Upload(link, mission).run(say)
    finally:
        link.close()


class _Upload:
    def __init__(self, link: Link, mission: FlightMission) -> None:
        self._link, self._mission = link, mission
        self._companion = Companion(OWN)
        self._transfer: MissionTransfer | None = None

    def run(self, say: Callable[[str], object]) -> str:
        self._until(lambda: bool(self._status.autopilot), WAIT_S)
        if not self._status.autopilot:
            raise InputError(f'no autopilot answers within {WAIT_S:g} s on {self._link.url}; start it, or name its own address')
        transfer = self._transfer = self._begin()
        sent = -1
        while not transfer.over:
            self._turn()
            if self._is_flown():
                raise UploadError('it began to fly its mission meanwhile; land it, or change its mode, and send it again')
            if transfer.sent > sent:
                sent = transfer.sent
                say(f'sent {sent} items')
            time.sleep(TURN_S)
        self._turn()
        if transfer.failure:
            raise UploadError(f'{self._name}: {transfer.failure}')
        return (
            f'{self._name} has the route: take-off and {len(self._mission.waypoints)} waypoints, read back and compared; '
            'it starts when somebody sets its mode'
        )

    def _begin(self) -> MissionTransfer:
        if self._is_flown():
            raise UploadError(f'{self._name} flies its mission now (mode {self._status.mode}); land it and send it again')
        items = [_on_the_wire(item) for item in items_of(self._mission.waypoints)]
        own_first = self._status.autopilot == 'ardupilot'
        if own_first:
            home = self._mission.waypoints[0]
            none = (0.0, 0.0, 0.0, 0.0)
            items.insert(0, _on_the_wire(MissionItem(WAYPOINT, OF_THE_SEA[0], none, home.latitude_deg, home.longitude_deg, 0.0)))
        if len(items) > MOST_ITEMS:
            raise InputError(f'the route has {len(items)} items; vehicles keep {MOST_ITEMS} at most, leave out --every-cell')
        target = self._companion.vehicle.target
        assert target is not None
        return MissionTransfer(target, (OWN.system_id, OWN.component_id), items, own_first=own_first)

    @property
    def _status(self) -> Status:
        return self._companion.status(time.monotonic())

    @property
    def _name(self) -> str:
        target = self._companion.vehicle.target
        return f'vehicle {target[0] if target else 0} ({self._companion.vehicle.name})'

    def _is_flown(self) -> bool:
        status = self._status
        return status.armed and status.mode.upper() in MISSION_MODES

    def _until(self, condition: Callable[[], bool], seconds: float) -> None:
        serve_until(condition, self._turn, seconds, TURN_S)

    def _turn(self) -> None:
        exchange(self._link, self._companion, self._take, self._due)

    def _take(self, message: Message, at_s: float) -> None:
        if self._transfer is not None:
            self._transfer.observe(message)

    def _due(self, now_s: float) -> list[Message]:
        return [] if self._transfer is None else self._transfer.step(now_s)


def _on_the_wire(item: MissionItem) -> WireItem:
    """By MISSION_ITEM_INT: whole numbers for the place, single precision for the height."""
    return WireItem(item.frame, item.command, round(item.latitude_deg * 1e7), round(item.longitude_deg * 1e7), item.height_m)
