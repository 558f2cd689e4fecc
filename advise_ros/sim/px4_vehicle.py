"""The vehicle as PX4 runs it: OFFBOARD that lives by a stream of setpoints, and what happens when it ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.config import SimulatorConfig
from advise_ros.sim.control import Target
from advise_ros.sim.flight import HOLD, SPOOL_UP_S, Flight, descend
from advise_ros.sim.modes import PX4_ARMABLE, Px4Mode, known_px4
from advise_ros.sim.quadcopter import State
from advise_ros.sim.setpoints import Setpoint
from advise_ros.sim.vehicle import DONE, Outcome, Vehicle

TAKEOFF_M, REACHED_M = 2.5, 0.2
# What is flown of the velocity that is asked for, as seen: 0.81 of 1 m/s.
SPEED_SHARE = 0.81
CLIMB_SEEN_M_S = 0.05
SINK_M_S = 0.7
RESUME_S, STICKS_LOST_S, GROUND_STATION_LOST_S = 0.05, 0.65, 10.0
OFFBOARD_EXCEPTED = 4
# COM_OBL_RC_ACT; without sticks its default means return.
LOSS_ACTIONS = {4: Px4Mode.LAND, 5: Px4Mode.LOITER}


@dataclass
class Px4Flight(Flight):
    """What each of PX4's modes flies; setpoints do not grow stale here, OFFBOARD is left instead."""

    mode: Px4Mode = Px4Mode.LOITER

    def moving_setpoint_age_s(self, now_s: float) -> float:
        if self.mode is not Px4Mode.OFFBOARD or self._setpoint is None or not any(self._setpoint[0].velocity_enu_m_s or ()):
            return 0.0
        return now_s - self._setpoint[1]

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
        east, north, up = setpoint.velocity_enu_m_s or (0.0, 0.0, 0.0)
        if state.touches_ground and (up < CLIMB_SEEN_M_S or now_s < self._lift_at_s):
            return None
        velocity = SPEED_SHARE * east, SPEED_SHARE * north, SPEED_SHARE * up
        return Target(velocity, yaw_enu_rad=setpoint.yaw_enu_rad, yaw_rate_rad_s=setpoint.yaw_rate_enu_rad_s)

    def take(self, setpoint: Setpoint, now_s: float, *, grounded: bool) -> None:
        """Keep a setpoint; on the ground the first one that climbs starts the rotors."""
        climbs = (setpoint.velocity_enu_m_s or (0.0, 0.0, 0.0))[2] >= CLIMB_SEEN_M_S
        if grounded and climbs and self._lift_at_s == 0.0:
            self._lift_at_s = now_s + SPOOL_UP_S
        self._setpoint = setpoint, now_s

    def forget(self) -> None:
        super().forget()
        self._lift_at_s = 0.0


class Px4Vehicle(Vehicle):
    """PX4's manners around arming, OFFBOARD and its losses.

    Attributes:
        ground_station_s, sticks_s: simulated times of the last heartbeat of type 6 and MANUAL_CONTROL, None: never.
        offboard_loss_action, sticks_exceptions, ground_station_loss_action: COM_OBL_RC_ACT, COM_RCL_EXCEPT, NAV_DLL_ACT.
    """

    autopilot_id: ClassVar[int] = int(mavlink.MAV_AUTOPILOT_PX4)
    flight: Px4Flight

    def __init__(self, config: SimulatorConfig, rng: np.random.Generator) -> None:
        super().__init__(config, rng)
        self.ground_station_s: float | None = None
        self.sticks_s: float | None = None
        self.offboard_loss_action = self.sticks_exceptions = self.ground_station_loss_action = 0
        self._wants_offboard = False
        self._streamed_s = self._stream_began_s = -100.0

    def _new_flight(self, home_m: tuple[float, float]) -> Px4Flight:
        return Px4Flight(timeout_s=1.0, home_m=home_m)

    @property
    def streaming(self) -> bool:
        """Setpoints are the proof of life that OFFBOARD asks for."""
        return self.now_s - self._streamed_s <= self.flight.timeout_s

    def follow(self, setpoint: Setpoint) -> None:
        """Every sound setpoint keeps the stream alive; it is flown in OFFBOARD only."""
        if not self.streaming:
            self._stream_began_s = self.now_s
        self._streamed_s = self.now_s
        if self.mode is Px4Mode.OFFBOARD and self.armed:
            self.flight.take(setpoint, self.now_s, grounded=not self.airborne)

    def arm(self, *, force: bool = False) -> Outcome:
        if self.armed:
            return DONE
        if not force and (why := self._unarmable()):
            return Outcome(False, f'Arming denied: {why}')
        self.armed, self._idle_since_s = True, self.now_s
        if self.mode is Px4Mode.TAKEOFF:
            self.flight.take_off(self.flight.takeoff_to_m or TAKEOFF_M, self.now_s)
        return Outcome(True, 'Armed by external command')

    def _unarmable(self) -> str:
        if not self.ready or self.battery.remaining <= 0.0:
            return 'Resolve system health failures first'
        if self.ground_station_loss_action and not self._hears_ground_station():
            return 'No connection to the ground control station'
        if self.mode is Px4Mode.OFFBOARD and not self.streaming:
            return 'No offboard signal'
        return '' if self.mode in PX4_ARMABLE else f'mode {self.mode.name} cannot be armed in'

    def _hears_ground_station(self) -> bool:
        return self.ground_station_s is not None and self.now_s - self.ground_station_s <= GROUND_STATION_LOST_S

    def set_mode(self, number: int) -> Outcome:
        mode = known_px4(number)
        if mode is None:
            return Outcome(False, f'Mode {number:#010x} is not simulated')
        if mode is Px4Mode.OFFBOARD and self.armed and not self.streaming:
            return Outcome(False, 'Switching to Offboard is currently not available: no offboard signal')
        if mode is Px4Mode.POSCTL and self.sticks_s is None:
            return Outcome(False, 'Switching to Position is currently not available: no manual control input')
        self._wants_offboard = mode is Px4Mode.OFFBOARD
        if mode is not self.mode:
            self.flight.enter(mode)
        return DONE

    def take_off_to(self, altitude_m: float | None) -> Outcome:
        """Enter TAKEOFF; it climbs once armed. None: the altitude of its parameter."""
        if self.airborne:
            return Outcome(False, 'Takeoff denied: already in the air')
        altitude_m = TAKEOFF_M if altitude_m is None else max(altitude_m, TAKEOFF_M)
        self.flight.enter(Px4Mode.TAKEOFF)
        self.flight.takeoff_to_m, self._wants_offboard = altitude_m, False
        if self.armed:
            self.flight.take_off(altitude_m, self.now_s)
        return DONE

    def step(self) -> None:
        super().step()
        to = self.flight.takeoff_to_m
        if self.mode is Px4Mode.TAKEOFF and self.airborne and (to is None or self.altitude_left_m(to) < REACHED_M):
            self.flight.enter(Px4Mode.LOITER)

    def altitude_left_m(self, altitude_m: float) -> float:
        return altitude_m - self.state.altitude_m

    def _target(self) -> Target | None:
        return self.flight.target(self.state, self.now_s) if self.armed and self._flies() else None

    def _flies(self) -> bool:
        return self.airborne or self.mode in (Px4Mode.OFFBOARD, Px4Mode.TAKEOFF)

    def _landed(self) -> None:
        """With the stream still running, the mode that was left for the landing comes back."""
        back = self.mode is Px4Mode.OFFBOARD or self.streaming
        self._disarm()
        self.flight.enter(Px4Mode.OFFBOARD if back else Px4Mode.LOITER)
        self._wants_offboard = back

    def _idle(self) -> None:
        lifting = self.mode is Px4Mode.OFFBOARD and self.flight._lift_at_s > 0.0
        if lifting or (self.mode is Px4Mode.TAKEOFF and self.flight.takeoff_to_m is not None):
            self._idle_since_s = self.now_s
        super()._idle()

    def watch_losses(self) -> None:
        """OFFBOARD is left when the stream or the sticks are lost, and comes back with them."""
        if not self.armed:
            return
        sticks_lost = self._sticks_lost()
        if self.mode is Px4Mode.OFFBOARD and (sticks_lost or not self.streaming):
            action = Px4Mode.LOITER if sticks_lost else LOSS_ACTIONS.get(self.offboard_loss_action, Px4Mode.RTL)
            self.say('Failsafe activated: manual control lost' if sticks_lost else 'Failsafe activated: no offboard signal')
            self.flight.enter(action)
        elif self._wants_offboard and self.mode is not Px4Mode.OFFBOARD and not sticks_lost and self._resumed():
            self.flight.enter(Px4Mode.OFFBOARD)
        elif self.ground_station_loss_action and self.airborne and self._lost_ground_station_in_flight():
            self.say('Failsafe activated: ground station lost')
            self.flight.enter(Px4Mode.LOITER)
            self._wants_offboard = False

    def _resumed(self) -> bool:
        return self.streaming and self.now_s - self._stream_began_s >= RESUME_S

    def _sticks_lost(self) -> bool:
        excepted = self.sticks_exceptions & OFFBOARD_EXCEPTED
        return self.sticks_s is not None and not excepted and self.now_s - self.sticks_s > STICKS_LOST_S

    def _lost_ground_station_in_flight(self) -> bool:
        return self.mode is Px4Mode.OFFBOARD and not self._hears_ground_station()
