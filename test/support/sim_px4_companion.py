"""A companion that talks to a simulated PX4 object, without a socket."""

from __future__ import annotations

import struct
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.sim.modes import Px4Mode
from advise_ros.sim.px4 import SimulatedPx4
from support.sim_companion import ACCEPTED, ARM, SET_MODE, Companion

OFFBOARD, LOITER_MODE, LAND_MODE, RTL_MODE, POSCTL = (6, 0), (4, 3), (4, 6), (4, 5), (3, 0)
UP, STILL, NORTH = (0.0, 0.0, -1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)


class Px4Companion(Companion):
    """Speaks to a PX4."""

    def __init__(self, **values: Any) -> None:
        super().__init__(dialect=SimulatedPx4, **{'ready_after_s': 2.0, 'offboard_after_landing': True, **values})
        self.run(3.0)

    @property
    def mode(self) -> Px4Mode:
        return self.vehicle.mode  # type: ignore[no-any-return]

    def ask_mode(self, mode: tuple[int, int], fourth: float = 0.0) -> int | None:
        return self.command(SET_MODE, 1, *mode, fourth)

    def call_ground_station(self) -> None:
        self.say(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))

    def lift(self) -> Px4Companion:
        """In OFFBOARD by the sequence that works, a few metres up."""
        self.run(1.0, *STILL)
        assert self.ask_mode(OFFBOARD) == ACCEPTED
        assert self.command(ARM, 1) == ACCEPTED
        self.run(7.0, *UP)
        assert self.altitude > 2.0
        return self

    def set(self, name: str, value: int) -> None:
        """A whole number travels as the bytes of a float."""
        carried = struct.unpack('<f', struct.pack('<i', value))[0]
        (told,) = self.say(mavlink.MAVLink_param_set_message(1, 1, name.encode(), carried, mavlink.MAV_PARAM_TYPE_INT32))
        assert struct.unpack('<i', struct.pack('<f', told.param_value))[0] == value

    def set_real(self, name: str, value: float) -> None:
        (told,) = self.say(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, mavlink.MAV_PARAM_TYPE_REAL32))
        assert told.param_value == value

    def real(self, name: str) -> float:
        (told,) = self.say(mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
        return float(told.param_value)
