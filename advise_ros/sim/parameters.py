"""The few of ArduCopter's parameters that a companion asks for.

Messages: https://mavlink.io/en/services/parameter.html
"""

from __future__ import annotations

import math
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.config import SimulatorConfig
from advise_ros.sim import flight, vehicle

Message = Any

SETTABLE = {'GUID_TIMEOUT': (0.1, 60.0), 'FS_GCS_ENABLE': (0.0, 7.0), 'FS_GCS_TIMEOUT': (2.0, 120.0)}


class Parameters:
    """Names and values; those in SETTABLE can be changed within their range, the others keep their value."""

    def __init__(self, config: SimulatorConfig) -> None:
        self._values = {
            'SYSID_THISMAV': float(config.system_id),
            'GUID_TIMEOUT': config.guided_timeout_s,
            'FS_GCS_ENABLE': 0.0,
            'FS_GCS_TIMEOUT': 5.0,
            'DISARM_DELAY': vehicle.DISARM_DELAY_S,
            'WPNAV_SPEED': config.max_speed_m_s * 100.0,
            'WPNAV_ACCEL': config.acceleration_m_s2 * 100.0,
            'LAND_SPEED': flight.LAND_M_S * 100.0,
            'RTL_ALT': flight.RTL_ALTITUDE_M * 100.0,
        }

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def everything(self) -> list[Message]:
        """A PARAM_VALUE for each."""
        return [self._value(name) for name in self._values]

    def read(self, name: str, index: int) -> list[Message]:
        """One PARAM_VALUE, by index or, if that is -1, by name; none if there is no such parameter."""
        names = list(self._values)
        if index >= 0:
            name = names[index] if index < len(names) else ''
        return [self._value(name)] if name in self._values else []

    def set(self, name: str, value: float) -> list[Message]:
        """Change a value if that is allowed; the answer holds the value that now counts."""
        low, high = SETTABLE.get(name, (math.inf, -math.inf))
        if low <= value <= high:
            self._values[name] = value
        return self.read(name, -1)

    def _value(self, name: str) -> Message:
        return mavlink.MAVLink_param_value_message(
            name.encode(), self._values[name], mavlink.MAV_PARAM_TYPE_REAL32, len(self._values), list(self._values).index(name),
        )
