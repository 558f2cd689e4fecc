"""TIMESYNC as newer autopilots answer it: with the asker's ids behind the times, which the dialect here lacks.

Source: https://mavlink.io/en/messages/common.html#TIMESYNC
"""

from __future__ import annotations

import struct
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink


class AddressedTimesync(mavlink.MAVLink_timesync_message):  # type: ignore[misc]
    """An answer for one peer; ids are extension fields, which the checksum's seed does not cover."""

    def __init__(self, tc1: int, ts1: int, target_system: int, target_component: int) -> None:
        super().__init__(tc1, ts1)
        self._target = target_system, target_component

    def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
        """The frame, as pymavlink makes those of its own messages."""
        payload = struct.pack('<qqBB', self.tc1, self.ts1, *self._target)
        return bytes(self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1))
