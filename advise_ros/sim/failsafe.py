"""ArduCopter's ground station failsafe: a ground station that was there and falls silent brings the vehicle home."""

from __future__ import annotations

from advise_ros.sim.modes import Mode

GROUND_STATION_SYSTEM_ID = 255
LAND_OPTION = 5.0


class GroundStationFailsafe:
    """Watches heartbeats of system 255. It acts once a silence; the mode before is not given back."""

    def __init__(self) -> None:
        self._heard_s: float | None = None
        self._acted = False

    def hear(self, now_s: float) -> None:
        """A heartbeat of the ground station."""
        self._heard_s, self._acted = now_s, False

    def wanted(self, option: float, timeout_s: float, now_s: float) -> Mode | None:
        """The mode to change to now, or None.

        Args:
            option: FS_GCS_ENABLE; 0: off, 5: land, any other: return.
            timeout_s: FS_GCS_TIMEOUT.
            now_s: simulated time.
        """
        silent = self._heard_s is not None and now_s - self._heard_s > timeout_s
        if option == 0.0 or self._acted or not silent:
            return None
        self._acted = True
        return Mode.LAND if option == LAND_OPTION else Mode.RTL
