"""ArduCopter's flight modes as far as the simulator flies them."""

from __future__ import annotations

from enum import IntEnum


class Mode(IntEnum):
    """custom_mode of ArduCopter's HEARTBEAT."""

    STABILIZE = 0
    GUIDED = 4
    LOITER = 5
    RTL = 6
    LAND = 9
    BRAKE = 17


ARMABLE = frozenset({Mode.STABILIZE, Mode.GUIDED, Mode.LOITER})
DESCENDING = frozenset({Mode.LAND, Mode.RTL})


def known(number: int) -> Mode | None:
    """The mode of a custom_mode number, or None."""
    return Mode(number) if number in Mode._value2member_map_ else None
