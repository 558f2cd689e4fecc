"""How a parameter's value travels in PARAM_VALUE and PARAM_SET.

ArduPilot sends whole numbers as floats; PX4 sends the bytes of the whole number in the place of the float:
https://mavlink.io/en/services/parameter.html#parameter-encoding
"""

from __future__ import annotations

import struct

from advise_ros.mavlink.messages import Message, dialect

INTEGERS = {
    int(dialect.MAV_PARAM_TYPE_INT8), int(dialect.MAV_PARAM_TYPE_UINT8), int(dialect.MAV_PARAM_TYPE_INT16),
    int(dialect.MAV_PARAM_TYPE_UINT16), int(dialect.MAV_PARAM_TYPE_INT32), int(dialect.MAV_PARAM_TYPE_UINT32),
}


def decode(message: Message, *, bytewise: bool) -> float:
    """The value of a PARAM_VALUE."""
    if bytewise and message.param_type in INTEGERS:
        return float(struct.unpack('<i', struct.pack('<f', message.param_value))[0])
    return float(message.param_value)


def encode(value: float, kind: int, *, bytewise: bool) -> float:
    """What stands in the float of a PARAM_SET for a value of MAV_PARAM_TYPE `kind`.

    Args:
        value: of the parameter.
        kind: its MAV_PARAM_TYPE.
        bytewise: as PX4 does; else as ArduPilot does.
    """
    if bytewise and kind in INTEGERS:
        return float(struct.unpack('<f', struct.pack('<i', round(value)))[0])
    return value


def as_carried(value: float, kind: int) -> float:
    """The value that comes back of one that is written: whole, or rounded to 32 bits.

    Args:
        value: that is written.
        kind: its MAV_PARAM_TYPE.
    """
    if kind in INTEGERS:
        return float(round(value))
    return float(struct.unpack('<f', struct.pack('<f', value))[0])
