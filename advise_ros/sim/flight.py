"""What each mode flies: mode, setpoint and simulated time -> a target for the motion control."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from enum import IntEnum
from typing import ClassVar

from advise_ros.sim.control import Target
from advise_ros.sim.modes import Mode
from advise_ros.sim.quadcopter import State
from advise_ros.sim.setpoints import Setpoint

SPOOL_UP_S = 1.9
TAKEOFF_ACCELERATION_M_S2 = 1.0
TAKEOFF_REACHED_M = 0.1
LAND_M_S = 0.5
LAND_SLOWLY_BELOW_M = 10.0
LAND_FAST_M_S = 1.5
RTL_ALTITUDE_M = 15.0
RTL_LOITER_S = 5.0
ARRIVED_M = 0.5
HOME = (0.0, 0.0)
SHOWN_AFTER_S = 0.06

HOLD = Target()


@dataclass
class SimulatedFlight:
    """The flying half of the autopilot; the other half decides whether it may fly at all."""

    # The mode in which it follows setpoints.
    obedient: ClassVar[IntEnum] = Mode.GUIDED

    timeout_s: float = 3.0
    mode: IntEnum = Mode.STABILIZE
    home_m: tuple[float, float] = HOME
    return_altitude_m: float = RTL_ALTITUDE_M
    # RTL_CONE_SLOPE: how steeply a return may have to climb; and what the autopilot's fence leaves of the height.
    return_slope: float = math.inf
    ceiling_m: float = math.inf
    # DO_CHANGE_SPEED: binds positions until the next velocity.
    position_speed_m_s: float = field(default=math.inf, init=False)
    takeoff_to_m: float | None = field(default=None, init=False)
    _lift_at_s: float = field(default=0.0, init=False)
    _setpoint: tuple[Setpoint, float] | None = field(default=None, init=False)
    _climbs_to_m: float | None = field(default=None, init=False)
    _climbed: bool = field(default=False, init=False)
    _taken: deque[tuple[Setpoint, float]] = field(default_factory=lambda: deque(maxlen=32), init=False)
    _arrived_at_s: float | None = field(default=None, init=False)

    def enter(self, mode: IntEnum) -> None:
        """Change the mode; what the old one was doing is forgotten."""
        self.mode = mode
        self.forget()

    def forget(self) -> None:
        """Back to the start of the mode: no take-off, no setpoint."""
        self.takeoff_to_m, self._setpoint, self._arrived_at_s, self._climbed = None, None, None, False
        self._climbs_to_m, self.position_speed_m_s = None, math.inf
        self._taken.clear()

    def take_off(self, altitude_m: float, now_s: float) -> None:
        """Climb to an altitude above home once the motors have spooled up.

        Args:
            altitude_m: above home.
            now_s: simulated time.
        """
        self.forget()
        self.takeoff_to_m, self._lift_at_s = altitude_m, now_s + SPOOL_UP_S

    def follow(self, setpoint: Setpoint, now_s: float) -> None:
        """Take a setpoint; it ends a take-off, as in ArduCopter.

        Args:
            setpoint: decoded.
            now_s: simulated time.
        """
        self.takeoff_to_m = None
        self.keep(setpoint, now_s)
        if setpoint.position_enu_m is None:
            self.position_speed_m_s = math.inf

    def keep(self, setpoint: Setpoint, now_s: float) -> None:
        """The setpoint that counts from now on.

        Args:
            setpoint: decoded.
            now_s: simulated time.
        """
        self._setpoint = setpoint, now_s
        self._taken.append(self._setpoint)

    def shown(self, now_s: float) -> Setpoint | None:
        """The setpoint that POSITION_TARGET_LOCAL_NED shows: what was taken a moment ago, of any sender.

        Args:
            now_s: simulated time.
        """
        return next((setpoint for setpoint, taken_s in reversed(self._taken) if now_s - taken_s >= SHOWN_AFTER_S), None)

    @property
    def seeks(self) -> bool:
        """A position is flown to."""
        return self._setpoint is not None and self._setpoint[0].position_enu_m is not None

    def moving_setpoint_age_s(self, now_s: float) -> float:
        """Simulated age of the velocity setpoint that moves the vehicle; 0 while none does.

        Args:
            now_s: simulated time.
        """
        if self.mode is not self.obedient or self._setpoint is None:
            return 0.0
        setpoint, received_s = self._setpoint
        return now_s - received_s if any(setpoint.velocity_enu_m_s or ()) else 0.0

    def target(self, state: State, now_s: float) -> Target | None:
        """What to fly at this instant; None while the motors still spool up.

        Args:
            state: of the craft.
            now_s: simulated time.
        """
        if self.mode is Mode.GUIDED:
            return self._guided(state, now_s)
        if self.mode is Mode.LAND:
            return descend(state)
        if self.mode is Mode.RTL:
            return self._return(state, now_s)
        return HOLD  # LOITER, BRAKE, and STABILIZE with its sticks centred

    def _guided(self, state: State, now_s: float) -> Target | None:
        if self.takeoff_to_m is not None:
            return self._climb(state, now_s)
        if self._setpoint is None:
            return HOLD
        setpoint, received_s = self._setpoint
        if setpoint.position_enu_m is not None:
            return seek(setpoint)._replace(speed_m_s=self.position_speed_m_s)
        stale = now_s - received_s > self.timeout_s
        if stale or setpoint.velocity_enu_m_s is None:
            return HOLD
        return Target(setpoint.velocity_enu_m_s, yaw_enu_rad=setpoint.yaw_enu_rad, yaw_rate_rad_s=setpoint.yaw_rate_enu_rad_s)

    def _climb(self, state: State, now_s: float) -> Target | None:
        altitude = self.takeoff_to_m
        assert altitude is not None
        if now_s < self._lift_at_s:
            return None
        target = Target(altitude_m=altitude, climb_acceleration_m_s2=TAKEOFF_ACCELERATION_M_S2)
        if abs(state.estimated_altitude_m - altitude) < TAKEOFF_REACHED_M:
            self.takeoff_to_m = None
            east, north, _ = (float(part) for part in state.reference.position_enu_m)
            self.keep(Setpoint(position_enu_m=(east, north, altitude)), now_s)
        return target

    def _return(self, state: State, now_s: float) -> Target | None:
        """Climb, fly home, wait, then land."""
        east, north = (float(part) for part in state.estimated_position_enu_m[:2])
        if self._climbs_to_m is None:
            distance_m = math.hypot(east - self.home_m[0], north - self.home_m[1])
            wanted_m = min(self.return_altitude_m, self.return_slope * distance_m, self.ceiling_m)
            self._climbs_to_m = max(wanted_m, state.estimated_altitude_m)
        if not self._climbed:
            self._climbed = state.estimated_altitude_m > self._climbs_to_m - ARRIVED_M
            return Target(altitude_m=self._climbs_to_m)
        near = abs(east - self.home_m[0]) < ARRIVED_M and abs(north - self.home_m[1]) < ARRIVED_M
        if near and self._arrived_at_s is None:
            self._arrived_at_s = now_s
        if self._arrived_at_s is not None and now_s - self._arrived_at_s > RTL_LOITER_S:
            return descend(state, self.home_m)
        return Target(east_north_m=self.home_m)


def seek(setpoint: Setpoint) -> Target:
    """Towards a setpoint's position."""
    assert setpoint.position_enu_m is not None
    east, north, up = setpoint.position_enu_m
    return Target(
        setpoint.velocity_enu_m_s or (0.0, 0.0, 0.0), (east, north), up, setpoint.yaw_enu_rad, setpoint.yaw_rate_enu_rad_s,
    )


def descend(state: State, over_m: tuple[float, float] | None = None) -> Target:
    """Straight down, or over a place.

    Args:
        state: of the craft.
        over_m: (east, north) to stay above; None: where it is.
    """
    speed = LAND_M_S if state.estimated_altitude_m < LAND_SLOWLY_BELOW_M else LAND_FAST_M_S
    return Target((0.0, 0.0, -speed), east_north_m=over_m)
