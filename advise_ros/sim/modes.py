"""ArduCopter's and PX4's flight modes as far as the simulator flies them."""

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


class Px4Mode(IntEnum):
    """custom_mode of PX4's HEARTBEAT: main mode << 16 | sub mode << 24."""

    POSCTL = 0x00030000
    OFFBOARD = 0x00060000
    TAKEOFF = 0x02040000
    LOITER = 0x03040000
    RTL = 0x05040000
    LAND = 0x06040000


PX4_ARMABLE = frozenset({Px4Mode.POSCTL, Px4Mode.OFFBOARD, Px4Mode.TAKEOFF, Px4Mode.LOITER})


def known_px4(number: int) -> Px4Mode | None:
    """The mode of PX4's custom_mode number, or None."""
    return Px4Mode(number) if number in Px4Mode._value2member_map_ else None
