"""What a bridge logs of its vehicle: each change once."""

from __future__ import annotations

from advise_ros.mavlink.companion import Status
from advise_ros.ros.change_log import ChangeLog

FAILED = 'another try: '


class VehicleLog:
    """Logs the link, whose the vehicle is, its failsafe, and goals that failed after they had begun."""

    def __init__(self, log: ChangeLog) -> None:
        self._log = log
        self._met = self._armed = False

    def look(self, status: Status, now_s: float, *, under_way: bool = False) -> None:
        """Take in the vehicle's state, and whether a goal of ours is under way; call it as often as you like."""
        lost = self._met and not status.connected
        self._met = self._met or status.connected
        self._log.note('the loss of the link', status.waiting_for.removeprefix('heartbeat: ') if lost else '', now_s)
        if not status.connected:
            return
        self._log.note('the failsafe', f'the autopilot is in a failsafe: {status.failsafe}' if status.failsafe else '', now_s)
        failed = status.waiting_for.removeprefix(FAILED) if status.waiting_for.startswith(FAILED) else ''
        self._log.note('the last failure', failed, now_s)
        self._note_owner(status, under_way=under_way)

    def _note_owner(self, status: Status, *, under_way: bool) -> None:
        self._armed = self._armed or status.armed
        if status.owner == 'ours':
            self._log.now('owner', "it is this bridge's: it took off or was taken over here")
        elif status.owner == 'others' and status.in_air and not under_way:
            why = status.waiting_for.removeprefix('mavlink_bridge/take_over: ')
            self._log.now('owner', f"it is others', and gets no commands from here: {why}", calm=False)
        elif self._armed and not status.armed:
            self._log.now('owner', "it is disarmed, and nobody's")
