"""CURRENT_MODE (436), by which PX4 reports its mode ten times a second, and whether it is the one that was commanded.

The dialect `ardupilotmega` lacks it, and `development`, which has it, takes a second and 80 MB to import.
Source: https://mavlink.io/en/messages/development.html#CURRENT_MODE
"""

from __future__ import annotations

import struct
from typing import Any, ClassVar

from pymavlink.dialects.v20 import ardupilotmega

NUMBER = 436


class CurrentMode(ardupilotmega.MAVLink_message):  # type: ignore[misc]
    """The mode that is flown, and the one that was commanded; they differ in a failsafe (0: not said)."""

    id = NUMBER
    msgname = 'CURRENT_MODE'
    fieldnames: ClassVar = ['standard_mode', 'custom_mode', 'intended_custom_mode']
    ordered_fieldnames: ClassVar = ['custom_mode', 'intended_custom_mode', 'standard_mode']
    fieldtypes: ClassVar = ['uint8_t', 'uint32_t', 'uint32_t']
    fielddisplays_by_name: ClassVar[dict[str, str]] = {}
    fieldenums_by_name: ClassVar[dict[str, str]] = {}
    fieldunits_by_name: ClassVar[dict[str, str]] = {}
    native_format = bytearray(b'<IIB')
    orders: ClassVar = [2, 0, 1]
    lengths: ClassVar = [1, 1, 1]
    array_lengths: ClassVar = [0, 0, 0]
    crc_extra = 193
    unpacker = struct.Struct('<IIB')
    instance_field = None
    instance_offset = -1

    def __init__(self, standard_mode: int, custom_mode: int, intended_custom_mode: int) -> None:
        super().__init__(NUMBER, self.msgname)
        self._fieldnames = self.fieldnames
        self._instance_field, self._instance_offset = self.instance_field, self.instance_offset
        self.standard_mode = standard_mode
        self.custom_mode = custom_mode
        self.intended_custom_mode = intended_custom_mode

    def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
        """The frame, as pymavlink makes those of its own messages."""
        payload = self.unpacker.pack(self.custom_mode, self.intended_custom_mode, self.standard_mode)
        return bytes(self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1))


def register() -> None:
    """Let decoders of the dialect know it."""
    ardupilotmega.mavlink_map.setdefault(NUMBER, CurrentMode)
