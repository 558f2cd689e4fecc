"""The vehicle as PX4 runs it: OFFBOARD that lives by a stream of setpoints, and what happens when it ends."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.config import SimulatorConfig
from advise_ros.sim.control import Target
from advise_ros.sim.estimator import Wander
from advise_ros.sim.modes import PX4_ARMABLE, Px4Mode, known_px4
from advise_ros.sim.px4_flight import TAKEOFF_M, Px4Flight
from advise_ros.sim.satellites import Px4Filter
from advise_ros.sim.setpoints import Setpoint
from advise_ros.sim.vehicle import DONE, RequestOutcome, SimulatedVehicle

REACHED_M = 0.2
# A stream this young does not arm in OFFBOARD, nor bring OFFBOARD back.
ARMS_AFTER_S = 0.08
RESUME_S, STICKS_LOST_S, GROUND_STATION_LOST_S = 0.05, 0.65, 10.0
OFFBOARD_EXCEPTED = 4
# COM_OBL_RC_ACT; without sticks its default means return.
# 2 of 69 landings on SIH.
MISSED_LANDINGS, MISSED_FOR_S = 2 / 69, 30.0
HOLDS_AT_FENCE = 2
# GF_ACTION; 0 and 1 change nothing.
FENCE_ACTIONS = {HOLDS_AT_FENCE: Px4Mode.LOITER, 3: Px4Mode.RTL, 5: Px4Mode.LAND}
LOSS_ACTIONS = {4: Px4Mode.LAND, 5: Px4Mode.LOITER}


class Px4Vehicle(SimulatedVehicle):
    """PX4's manners around arming, OFFBOARD and its losses.

    Attributes:
        intended: the mode that was commanded last; a failsafe flies another one.
        ground_station_s, sticks_s: simulated times of the last heartbeat of type 6 and MANUAL_CONTROL, None: never.
        offboard_loss_action, sticks_exceptions, ground_station_loss_action: COM_OBL_RC_ACT, COM_RCL_EXCEPT, NAV_DLL_ACT.
    """

    autopilot_id: ClassVar[int] = int(mavlink.MAV_AUTOPILOT_PX4)
    flight: Px4Flight

    def __init__(self, config: SimulatorConfig, rng: np.random.Generator) -> None:
        super().__init__(config, rng)
        self.offboard_loss_action = self.sticks_exceptions = self.ground_station_loss_action = 0
        self.fence_action = HOLDS_AT_FENCE

    def boot(self) -> None:
        super().boot()
        self.ground_station_s: float | None = None
        self.sticks_s: float | None = None
        self.intended = self.mode
        self._after_disarming = self.mode
        self._held_by_fence = False
        self._streamed_s = self._stream_began_s = -100.0

    def _new_filter(self) -> None:
        rng, step_s = self._filter_rng, self._config.step_s
        self.estimator = Px4Filter(Wander(self._config.drift_m_s, rng, step_s), rng, step_s)

    @property
    def in_failsafe(self) -> bool:
        """OFFBOARD was commanded, and something else is flown."""
        return self.armed and self.intended is Px4Mode.OFFBOARD and self.mode is not Px4Mode.OFFBOARD

    @property
    def has_position(self) -> bool:
        return self.sees_satellites

    @property
    def _estimate_is_sound(self) -> bool:
        return not self.estimator.lands

    def _new_flight(self, home_m: tuple[float, float]) -> Px4Flight:
        return Px4Flight(timeout_s=1.0, home_m=home_m)

    @property
    def stamp_ms(self) -> int:
        """Multiples of 4 ms."""
        return self.now_ns // 4_000_000 * 4

    @property
    def mode(self) -> Px4Mode:
        return self.flight.mode

    @property
    def healthy(self) -> bool:
        """In OFFBOARD the checks before arming ask for a stream, and take any setpoint."""
        return super().healthy and (self.mode is not Px4Mode.OFFBOARD or self.streaming)

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
            self.flight.take(setpoint, self.now_s, self.state if not self.airborne else None)

    def arm(self, *, force: bool = False) -> RequestOutcome:
        if self.armed:
            return DONE
        if not force and (why := self._unarmable()):
            return RequestOutcome(False, f'Arming denied: {why}')
        self.armed, self._idle_since_s = True, self.now_s
        if self.mode is Px4Mode.TAKEOFF:
            self.flight.take_off(self.flight.takeoff_to_m or TAKEOFF_M, self.now_s)
        return RequestOutcome(True, 'Armed by external command')

    def _unarmable(self) -> str:
        if not self.ready or self.battery.remaining <= 0.0:
            return 'Resolve system health failures first'
        if self.ground_station_loss_action and not self._hears_ground_station():
            return 'No connection to the ground control station'
        if self.mode is Px4Mode.OFFBOARD and not self._streamed_for(ARMS_AFTER_S):
            return 'No offboard signal'
        return '' if self.mode in PX4_ARMABLE else f'mode {self.mode.name} cannot be armed in'

    def _hears_ground_station(self) -> bool:
        return self.ground_station_s is not None and self.now_s - self.ground_station_s <= GROUND_STATION_LOST_S

    def set_mode(self, number: int) -> RequestOutcome:
        mode = known_px4(number)
        if mode is None:
            return RequestOutcome(False, f'Mode {number:#010x} is not simulated')
        if mode is Px4Mode.OFFBOARD and self.armed and not self.streaming:
            return RequestOutcome(False, 'Switching to Offboard is currently not available: no offboard signal')
        if mode is Px4Mode.POSCTL and self.sticks_s is None:
            return RequestOutcome(False, 'Switching to Position is currently not available: no manual control input')
        self._intend(mode)
        self._held_by_fence = False
        if mode is not self.mode:
            self.flight.enter(mode)
        return DONE

    def _intend(self, mode: Px4Mode) -> None:
        """Note the mode that was asked for; the last one that can be armed in is gone back to once disarmed."""
        self.intended = mode
        if mode in PX4_ARMABLE:
            self._after_disarming = mode

    def take_off_to(self, altitude_m: float | None) -> RequestOutcome:
        """Enter TAKEOFF; it climbs once armed.

        Args:
            altitude_m: above home; None: that of its parameter.
        """
        if self.airborne:
            return RequestOutcome(False, 'Takeoff denied: already in the air')
        altitude_m = TAKEOFF_M if altitude_m is None else max(altitude_m, TAKEOFF_M)
        self.flight.enter(Px4Mode.TAKEOFF)
        self.flight.takeoff_to_m = altitude_m
        self._intend(Px4Mode.TAKEOFF)
        if self.armed:
            self.flight.take_off(altitude_m, self.now_s)
        return DONE

    def step(self) -> None:
        super().step()
        to = self.flight.takeoff_to_m
        if self.mode is Px4Mode.TAKEOFF and self.airborne and (to is None or self.altitude_left_m(to) < REACHED_M):
            self._intend(Px4Mode.LOITER)
            self.flight.enter(Px4Mode.LOITER)

    def altitude_left_m(self, altitude_m: float) -> float:
        return altitude_m - self.state.estimated_altitude_m

    def _estimate(self) -> None:
        self.estimator.step(satellites=self.satellites)
        self._believe(self.estimator)

    def _target(self) -> Target | None:
        return self.flight.target(self.state, self.now_s) if self.armed and self._flies() else None

    def _flies(self) -> bool:
        return self.airborne or self.mode in (Px4Mode.OFFBOARD, Px4Mode.TAKEOFF)

    def landing_takes_s(self) -> float:
        """Where the height drifts, some landings are not noticed for a long time: armed, in LAND, on the ground."""
        missed = self._config.drift_m_s > 0.0 and self._landing_rng.random() < MISSED_LANDINGS
        return MISSED_FOR_S if missed else super().landing_takes_s()

    def _landed(self) -> None:
        self._disarm()

    def _disarm(self) -> None:
        """After a landing out of OFFBOARD, commanded or by a failsafe, OFFBOARD comes back, stream or no stream."""
        super()._disarm()
        stays = self._config.offboard_after_landing or self.mode is Px4Mode.OFFBOARD or self.streaming
        if self._after_disarming is Px4Mode.OFFBOARD and not stays:
            self._after_disarming = Px4Mode.LOITER
        self._intend(self._after_disarming)
        self.flight.enter(self._after_disarming)

    def _idle(self) -> None:
        lifting = self.mode is Px4Mode.OFFBOARD and self.flight._lift_at_s > 0.0
        if lifting or (self.mode is Px4Mode.TAKEOFF and self.flight.takeoff_to_m is not None):
            self._idle_since_s = self.now_s
        super()._idle()

    def watch_losses(self) -> None:
        """OFFBOARD is left when the stream or the sticks are lost, and comes back with them."""
        if not self.armed:
            return
        if self.estimator.lands and self.airborne:
            self._give_up_position()
            return
        if self.crosses_fence() and self.fence_action in FENCE_ACTIONS:
            self.say('Geofence exceeded')
            self._held_by_fence = True
            self.flight.enter(FENCE_ACTIONS[self.fence_action])
        sticks_lost = self._sticks_lost()
        if self.mode is Px4Mode.OFFBOARD and (sticks_lost or not self.streaming):
            action = Px4Mode.LOITER if sticks_lost else LOSS_ACTIONS.get(self.offboard_loss_action, Px4Mode.RTL)
            self.say('Failsafe activated')
            self.flight.enter(action)
        elif self._in_failsafe and not sticks_lost and self._streamed_for(RESUME_S):
            self.flight.enter(Px4Mode.OFFBOARD)
        elif self.ground_station_loss_action and self.airborne and self._lost_ground_station_in_flight():
            self.say('Failsafe activated')
            self.flight.enter(Px4Mode.LOITER)
            self._intend(Px4Mode.LOITER)

    def _give_up_position(self) -> None:
        if self.mode is not Px4Mode.LAND:
            self.say('Failsafe activated')
            self.flight.enter(Px4Mode.LAND)

    @property
    def _in_failsafe(self) -> bool:
        """OFFBOARD is wanted and something else is flown, for a reason that may pass."""
        passes = self.battery.remaining > 0.0 and not self._held_by_fence
        return passes and self.intended is Px4Mode.OFFBOARD and self.mode is not Px4Mode.OFFBOARD

    def _streamed_for(self, seconds: float) -> bool:
        return self.streaming and self.now_s - self._stream_began_s >= seconds

    def _sticks_lost(self) -> bool:
        excepted = self.sticks_exceptions & OFFBOARD_EXCEPTED
        return self.sticks_s is not None and not excepted and self.now_s - self.sticks_s > STICKS_LOST_S

    def _lost_ground_station_in_flight(self) -> bool:
        return self.mode is Px4Mode.OFFBOARD and not self._hears_ground_station()
