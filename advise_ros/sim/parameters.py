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
Entry = float | tuple[float, float, float]

REAL, INTEGER = mavlink.MAV_PARAM_TYPE_REAL32, mavlink.MAV_PARAM_TYPE_INT32


@dataclass
class AutopilotParameters:
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
        """Change a value if that is allowed; the answer holds the value that now counts.

        Args:
            name: of the parameter.
            value: wanted.
        """
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


def _made(table: dict[str, Entry], **more: Any) -> AutopilotParameters:
    """Parameters of name -> (value, lowest, highest), or the value alone where it cannot be changed."""
    values = {name: entry[0] if isinstance(entry, tuple) else entry for name, entry in table.items()}
    settable = {name: (entry[1], entry[2]) for name, entry in table.items() if isinstance(entry, tuple)}
    return AutopilotParameters(values, settable, **more)


def of_arducopter(config: SimulatorConfig) -> AutopilotParameters:
    """ArduCopter's, as it comes out of the box; GUID_TIMEOUT as configured. Altitudes and speeds in cm and cm/s."""
    return _made({
        'SYSID_THISMAV': float(config.system_id),
        'GUID_TIMEOUT': (config.guided_timeout_s, 0.1, 60.0),
        'FS_GCS_ENABLE': (0.0, 0.0, 7.0), 'FS_GCS_TIMEOUT': (5.0, 2.0, 120.0), 'FS_EKF_ACTION': (1.0, 1.0, 3.0),
        'FENCE_ENABLE': (0.0, 0.0, 1.0), 'FENCE_TYPE': (7.0, 0.0, 15.0), 'FENCE_ACTION': (1.0, 0.0, 8.0),
        'FENCE_RADIUS': (300.0, 30.0, 10_000.0), 'FENCE_ALT_MAX': (100.0, 10.0, 1000.0), 'FENCE_MARGIN': (2.0, 1.0, 10.0),
        'ARMING_CHECK': (1.0, 0.0, 1_048_575.0),
        'DISARM_DELAY': vehicle.DISARM_DELAY_S,
        'WPNAV_SPEED': config.max_speed_m_s * 100.0,
        'WPNAV_ACCEL': config.acceleration_m_s2 * 100.0,
        'LAND_SPEED': flight.LAND_M_S * 100.0,
        'RTL_ALT': (flight.RTL_ALTITUDE_M * 100.0, 30.0, 300_000.0), 'RTL_CONE_SLOPE': (3.0, 0.5, 10.0),
        # What SITL simulates wrongly when asked; degrees of latitude and longitude, under the newer and the older name.
        'SIM_GPS1_GLTCH_X': (0.0, -1.0, 1.0), 'SIM_GPS1_GLTCH_Y': (0.0, -1.0, 1.0), 'SIM_GPS1_ENABLE': (1.0, 0.0, 1.0),
        'SIM_GPS_GLITCH_X': (0.0, -1.0, 1.0), 'SIM_GPS_GLITCH_Y': (0.0, -1.0, 1.0), 'SIM_GPS_DISABLE': (0.0, 0.0, 1.0),
    })


def of_px4(config: SimulatorConfig) -> AutopilotParameters:
    """PX4's, as a multicopter on SIH comes out of the box."""
    whole: dict[str, Entry] = {
        'MAV_SYS_ID': float(config.system_id), 'COM_OBL_RC_ACT': (0.0, 0.0, 7.0), 'COM_RCL_EXCEPT': (0.0, 0.0, 31.0),
        'NAV_DLL_ACT': (0.0, 0.0, 6.0), 'GF_ACTION': (2.0, 0.0, 5.0), 'SIM_GPS_USED': (10.0, 0.0, 50.0),
    }
    return _made({
        **whole,
        'COM_OF_LOSS_T': (1.0, 0.0, 60.0), 'COM_DISARM_PRFLT': vehicle.DISARM_DELAY_S, 'MIS_TAKEOFF_ALT': px4_flight.TAKEOFF_M,
        'GF_MAX_HOR_DIST': (0.0, 0.0, 10_000.0), 'GF_MAX_VER_DIST': (0.0, 0.0, 10_000.0),
        'RTL_RETURN_ALT': (px4_flight.RETURN_ALTITUDE_M, 0.0, 150.0),
        'MPC_XY_VEL_MAX': (px4_flight.FASTEST_M_S, 0.0, 20.0),
        'MPC_XY_CRUISE': (5.0, 0.5, 20.0), 'MPC_VEL_MANUAL': (10.0, 0.5, 20.0),
    }, integers=frozenset(whole), bytewise=True)
