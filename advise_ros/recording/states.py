"""The vehicle's state in the messages of a bag: our own, those of MAVROS and of PX4's uXRCE-DDS client."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from advise_ros.core.demonstrations.samples import VehicleEvent
from advise_ros.core.units import NS

NS_PER_US = 1000
ADVISE, MAVROS, PX4 = 'advise_msgs/msg/VehicleStatus', 'mavros_msgs/msg/State', 'px4_msgs/msg/VehicleStatus'
# Where each is looked for if no topic is named; a name without leading '/' is that of any namespace.
STATES = (
    (ADVISE, 'vehicle_status'), (MAVROS, 'state'), (PX4, 'fmu/out/vehicle_status'),
    *((PX4, f'fmu/out/vehicle_status_v{version}') for version in range(1, 5)),  # To 1.18.
)
# https://docs.px4.io/main/en/msg_docs/VehicleStatus.html
PX4_ARMED = 2
PX4_MODES = {
    0: 'MANUAL', 1: 'ALTCTL', 2: 'POSCTL', 3: 'AUTO.MISSION', 4: 'AUTO.LOITER', 5: 'AUTO.RTL', 6: 'POSCTL', 10: 'ACRO',
    12: 'DESCEND', 13: 'TERMINATION', 14: 'OFFBOARD', 15: 'STABILIZED', 17: 'AUTO.TAKEOFF', 18: 'AUTO.LAND',
    19: 'AUTO.FOLLOW_TARGET', 20: 'AUTO.PRECLAND', 21: 'ORBIT', 22: 'AUTO.VTOL_TAKEOFF',
}


def status_names(type_name: str) -> tuple[str, ...]:
    """Names of the topics on which messages of a type are looked for."""
    return tuple(name for kind, name in STATES if kind == type_name)


def stamp_ns(message: Any) -> int:
    """Of a message with a header."""
    return int(message.header.stamp.sec) * NS + int(message.header.stamp.nanosec)


def _advise(message: Any) -> VehicleEvent:
    """Bags of earlier versions have no owner."""
    return VehicleEvent(
        stamp_ns(message), bool(message.armed), bool(message.in_air), str(message.mode), str(message.autopilot),
        str(getattr(message, 'owner', '')), bool(message.connected),
    )


def _mavros(message: Any) -> VehicleEvent:
    """MAVROS does not say whether the vehicle is in the air; LOITER is ArduPilot's, PX4's is AUTO.LOITER."""
    return VehicleEvent(
        stamp_ns(message), bool(message.armed), None, str(message.mode), connected=bool(message.connected),
    )


def _px4(message: Any) -> VehicleEvent:
    number = int(message.nav_state)
    mode = PX4_MODES.get(number, f'mode {number}')
    return VehicleEvent(int(message.timestamp) * NS_PER_US, message.arming_state == PX4_ARMED, None, mode, 'px4')


EVENT_OF: Mapping[str, Callable[[Any], VehicleEvent]] = {ADVISE: _advise, MAVROS: _mavros, PX4: _px4}
