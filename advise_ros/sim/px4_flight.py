"""What each of PX4's modes flies: mode, setpoint and simulated time -> a target for the motion control."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar

from advise_ros.sim.control import Target
from advise_ros.sim.flight import HOLD, SPOOL_UP_S, SimulatedFlight, descend
from advise_ros.sim.modes import Px4Mode
from advise_ros.sim.quadcopter import State
from advise_ros.sim.setpoints import Setpoint

TAKEOFF_M = 2.5
# What is flown of the velocity that is asked for, as seen: 0.81 of 1 m/s.
SPEED_SHARE = 0.81
CLIMB_SEEN_M_S = 0.05
SINK_M_S = 0.7
RETURN_ALTITUDE_M = 30.0
FASTEST_M_S = 12.0


@dataclass
class Px4Flight(SimulatedFlight):
    """What each of PX4's modes flies; setpoints do not grow stale here, OFFBOARD is left instead."""

    obedient: ClassVar[IntEnum] = Px4Mode.OFFBOARD

    mode: Px4Mode = Px4Mode.LOITER
    # MPC_XY_VEL_MAX: nothing else bounds what a position setpoint flies.
    fastest_m_s: float = FASTEST_M_S
    return_altitude_m: float = RETURN_ALTITUDE_M

    def target(self, state: State, now_s: float) -> Target | None:
        if self.mode is Px4Mode.OFFBOARD:
            return self._offboard(state, now_s)
        if self.mode is Px4Mode.TAKEOFF:
            return self._climb(state, now_s)
        if self.mode is Px4Mode.LAND:
            return descend(state)
        if self.mode is Px4Mode.RTL:
            return self._return(state, now_s)
        return Target((0.0, 0.0, -SINK_M_S)) if self.mode is Px4Mode.POSCTL else HOLD

    def _offboard(self, state: State, now_s: float) -> Target | None:
        if self._setpoint is None:
            return HOLD
        setpoint = self._setpoint[0]
        if state.touches_ground and (not climbs(setpoint, state) or now_s < self._lift_at_s):
            return None
        share = SPEED_SHARE if setpoint.position_enu_m is None else 1.0
        east, north, up = (share * part for part in setpoint.velocity_enu_m_s or (0.0, 0.0, 0.0))
        altitude = setpoint.altitude_m if setpoint.position_enu_m is None else setpoint.position_enu_m[2]
        return Target(
            (east, north, up), None if setpoint.position_enu_m is None else setpoint.position_enu_m[:2], altitude,
            setpoint.yaw_enu_rad, setpoint.yaw_rate_enu_rad_s, cascade=True, speed_m_s=self.fastest_m_s,
        )

    def take(self, setpoint: Setpoint, now_s: float, grounded: State | None) -> None:
        """Keep a setpoint; the first one that climbs starts the rotors of a vehicle on the ground.

        Args:
            setpoint: decoded.
            now_s: simulated time.
            grounded: state of a vehicle on the ground, else None.
        """
        if grounded is not None and climbs(setpoint, grounded) and self._lift_at_s == 0.0:
            self._lift_at_s = now_s + SPOOL_UP_S
        self.keep(setpoint, now_s)

    def forget(self) -> None:
        super().forget()
        self._lift_at_s = 0.0


def climbs(setpoint: Setpoint, state: State) -> bool:
    """Whether a setpoint leads up from where the vehicle believes itself."""
    up = (setpoint.velocity_enu_m_s or (0.0, 0.0, 0.0))[2]
    altitude = setpoint.altitude_m if setpoint.position_enu_m is None else setpoint.position_enu_m[2]
    return up + (0.0 if altitude is None else altitude - state.estimated_altitude_m) >= CLIMB_SEEN_M_S
