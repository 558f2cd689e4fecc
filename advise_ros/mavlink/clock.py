"""The autopilot's time as a clock for others, which never runs backward."""

from __future__ import annotations

from advise_ros.mavlink.stamps import NS_PER_MS, REBOOT_MS


class AutopilotClock:
    """Nanoseconds since the autopilot's first boot that was seen; after a reboot it goes on where it stood."""

    def __init__(self) -> None:
        self._boot_ms = -1
        self._before_ms = 0

    def advance_ns(self, time_boot_ms: int) -> int | None:
        """What to publish for a message of this time; None if it is no later than what was published."""
        if self._boot_ms - REBOOT_MS <= time_boot_ms <= self._boot_ms:
            return None
        if time_boot_ms < self._boot_ms:
            self._before_ms += self._boot_ms
        self._boot_ms = time_boot_ms
        return (self._before_ms + time_boot_ms) * NS_PER_MS
