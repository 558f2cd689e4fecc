"""What moves the vehicle in a flight mode: commands, a person's sticks or the autopilot itself.

Modes: ArduCopter https://ardupilot.org/copter/docs/flight-modes.html, PX4 https://docs.px4.io/main/en/flight_modes_mc/.
"""

from __future__ import annotations

from enum import Enum


class Mover(Enum):
    """What moves the vehicle."""

    UNKNOWN = 'the mode is not known'
    COMMANDS = 'velocity commands'
    STICKS = 'a person by sticks, or a companion whose commands are not ours'
    ITSELF = 'the autopilot flies itself'


COMMANDED = frozenset(('GUIDED', 'OFFBOARD'))
STICKS = frozenset((
    'STABILIZE', 'STABILIZED', 'ACRO', 'ALT_HOLD', 'ALTHOLD', 'ALTCTL', 'POSHOLD', 'POSCTL', 'LOITER', 'DRIFT', 'SPORT',
    'FLOWHOLD', 'MANUAL', 'RATTITUDE', 'GUIDED_NOGPS',
))
ITSELF = frozenset((
    'AUTO', 'MISSION', 'RTL', 'SMART_RTL', 'AUTO_RTL', 'LAND', 'PRECLAND', 'TAKEOFF', 'HOLD', 'BRAKE', 'CIRCLE', 'ORBIT',
    'FOLLOW', 'FOLLOW_TARGET', 'THROW', 'FLIP', 'AVOID_ADSB', 'AUTOTUNE', 'ZIGZAG', 'SYSTEMID', 'AUTOROTATE', 'TURTLE',
    'READY', 'DESCEND', 'TERMINATION',
))
# MAVROS names the modes in which PX4 flies itself so: AUTO.RTL, AUTO.LOITER, ...
OF_PX4 = 'AUTO.'


def mover(mode: str, autopilot: str = '', owner: str = '') -> Mover:
    """What moves the vehicle.

    Args:
        mode: as advise_msgs/VehicleStatus or mavros_msgs/State name it; '' where it is not known.
        autopilot: 'ardupilot' or 'px4'; LOITER is flown by sticks on the one and by itself on the other.
        owner: 'others' where somebody else's setpoints are obeyed.
    """
    name = mode.upper()
    if name.startswith(OF_PX4) or (name == 'LOITER' and autopilot == 'px4') or name in ITSELF:
        return Mover.ITSELF
    if name in COMMANDED:
        return Mover.STICKS if owner == 'others' else Mover.COMMANDS
    return Mover.STICKS if name in STICKS else Mover.UNKNOWN
