"""The few of an autopilot's parameters that a companion asks for.

Messages: https://mavlink.io/en/services/parameter.html
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.config import SimulatorConfig
from advise_ros.sim import flight, px4_flight, vehicle

Message = Any
Range = tuple[float, float]

REAL, INTEGER = mavlink.MAV_PARAM_TYPE_REAL32, mavlink.MAV_PARAM_TYPE_INT32


@dataclass
class Parameters:
    """Names and values; those in `settable` can be changed within their range, the others keep their value.

    Attributes:
        values: name -> value.
        settable: name -> lowest and highest value.
        integers: names of whole numbers.
        bytewise: a whole number travels as the bytes of the float that carries it (PX4), not as its value.
    """

    values: dict[str, float]
    settable: dict[str, Range]
    integers: frozenset[str] = field(default_factory=frozenset)
    bytewise: bool = False

    def __getitem__(self, name: str) -> float:
        return self.values[name]

    def everything(self) -> list[Message]:
        """A PARAM_VALUE for each."""
        return [self._value(name) for name in self.values]

    def read(self, name: str, index: int) -> list[Message]:
        """One PARAM_VALUE, by index or, if that is -1, by name; none if there is no such parameter."""
        names = list(self.values)
        if index >= 0:
            name = names[index] if index < len(names) else ''
        return [self._value(name)] if name in self.values else []

    def set(self, name: str, value: float) -> list[Message]:
        """Change a value if that is allowed; the answer holds the value that now counts."""
        if self.bytewise and name in self.integers:
            value = float(struct.unpack('<i', struct.pack('<f', value))[0])
        if name in self.settable and self.settable[name][0] <= value <= self.settable[name][1]:
            self.values[name] = value
        return self.read(name, -1)

    def _value(self, name: str) -> Message:
        value, whole = self.values[name], name in self.integers
        if self.bytewise and whole:
            value = struct.unpack('<f', struct.pack('<i', round(value)))[0]
        return mavlink.MAVLink_param_value_message(
            name.encode(), value, INTEGER if whole else REAL, len(self.values), list(self.values).index(name),
        )


def of_arducopter(config: SimulatorConfig) -> Parameters:
    """ArduCopter's, as it comes out of the box; GUID_TIMEOUT as configured."""
    return Parameters({
        'SYSID_THISMAV': float(config.system_id),
        'GUID_TIMEOUT': config.guided_timeout_s,
        'FS_GCS_ENABLE': 0.0,
        'FS_GCS_TIMEOUT': 5.0,
        'FENCE_ENABLE': 0.0,
        'FENCE_TYPE': 7.0,
        'FENCE_ACTION': 1.0,
        'FENCE_RADIUS': 300.0,
        'FENCE_ALT_MAX': 100.0,
        'ARMING_CHECK': 1.0,
        'DISARM_DELAY': vehicle.DISARM_DELAY_S,
        'WPNAV_SPEED': config.max_speed_m_s * 100.0,
        'WPNAV_ACCEL': config.acceleration_m_s2 * 100.0,
        'LAND_SPEED': flight.LAND_M_S * 100.0,
        'RTL_ALT': flight.RTL_ALTITUDE_M * 100.0,
    }, {
        'GUID_TIMEOUT': (0.1, 60.0), 'FS_GCS_ENABLE': (0.0, 7.0), 'FS_GCS_TIMEOUT': (2.0, 120.0), 'FENCE_ENABLE': (0.0, 1.0),
        'FENCE_TYPE': (0.0, 15.0), 'FENCE_ACTION': (0.0, 8.0), 'FENCE_RADIUS': (30.0, 10_000.0), 'FENCE_ALT_MAX': (10.0, 1000.0),
    })


def of_px4(config: SimulatorConfig) -> Parameters:
    """PX4's, as it comes out of the box."""
    whole = {
        'MAV_SYS_ID': float(config.system_id), 'COM_OBL_RC_ACT': 0.0, 'COM_RCL_EXCEPT': 0.0, 'NAV_DLL_ACT': 0.0, 'GF_ACTION': 2.0,
    }
    return Parameters({
        **whole, 'COM_OF_LOSS_T': 1.0, 'COM_DISARM_PRFLT': vehicle.DISARM_DELAY_S, 'MIS_TAKEOFF_ALT': px4_flight.TAKEOFF_M,
        'GF_MAX_HOR_DIST': 0.0, 'GF_MAX_VER_DIST': 0.0,
    }, {
        'COM_OBL_RC_ACT': (0.0, 7.0), 'COM_RCL_EXCEPT': (0.0, 31.0), 'NAV_DLL_ACT': (0.0, 6.0), 'GF_ACTION': (0.0, 5.0),
        'COM_OF_LOSS_T': (0.0, 60.0), 'GF_MAX_HOR_DIST': (0.0, 10_000.0), 'GF_MAX_VER_DIST': (0.0, 10_000.0),
    }, frozenset(whole), bytewise=True)
