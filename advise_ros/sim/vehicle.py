"""The vehicle as ArduCopter runs it: readiness, arming, modes, take-off, landing, disarming. PX4's builds on it.

A state machine in simulated time without messages: methods return an Outcome, `step` moves one tick.
"""

from __future__ import annotations

from enum import IntEnum
from typing import ClassVar, NamedTuple

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.config import SimulatorConfig
from advise_ros.core.units import NS
from advise_ros.sim.airframe import SimulatedBattery, Wind
from advise_ros.sim.control import ControlLimits, Target
from advise_ros.sim.failsafe import Geofence
from advise_ros.sim.flight import SimulatedFlight
from advise_ros.sim.modes import ARMABLE, DESCENDING, Mode, known
from advise_ros.sim.quadcopter import Quadcopter, State
from advise_ros.sim.satellites import ArduPilotFilter, Px4Filter
from advise_ros.sim.setpoints import Setpoint

DISARM_DELAY_S = 10.0
# Contact until the landing is believed and the motors are stopped.
LANDED_AFTER_S = 2.2
AIRBORNE_M = 0.1
# By how much ArduCopter's messages come earlier than their turn.
UNEVEN_MS = 2
# The simulated clock's zero as a unix time: any will do, and every run has the same.
BOOTED_AT_UNIX_S = 1_760_000_000
HIGHEST_M = 1000.0
# A local position arrives well before the vehicle may be armed: it is no sign of readiness.
POSITION_SHARE, FILTER_SHARE = 0.55, 0.9


class RequestOutcome(NamedTuple):
    """Whether a request was taken, and the words for a person if there are any."""

    accepted: bool
    text: str = ''


DONE = RequestOutcome(accepted=True)


class SimulatedVehicle:
    """One simulated vehicle. `rng` gives two numbers a tick, flying or not.

    Attributes:
        satellites, satellite_shift_m: whether there are any, and by how much they mislead, east and north.
        fence: the autopilot's own.
        failsafe_acted: one has set a mode, and its cause lasts.
    """

    autopilot_id: ClassVar[int] = int(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)

    def __init__(self, config: SimulatorConfig, rng: np.random.Generator) -> None:
        self._config = config
        self._rng = rng
        self._filter_rng, self._landing_rng = rng.spawn(2)
        self.satellites, self.satellite_shift_m = True, (0.0, 0.0)
        self.fence = Geofence()
        self.step_ns = round(config.step_s * NS)
        self._quadcopter = Quadcopter(
            limits=ControlLimits(
                speed_m_s=config.max_speed_m_s, acceleration_m_s2=config.acceleration_m_s2, jerk_m_s3=config.jerk_m_s3,
            ),
            wind=Wind((config.wind_east_m_s, config.wind_north_m_s), config.gust_m_s),
            step_s=config.step_s,
        )
        self.battery = SimulatedBattery(config.battery_s)
        self.boot()

    def boot(self) -> None:
        """Start anew at the start position, with a clock at zero."""
        start = self._config.start_east_m, self._config.start_north_m
        self.now_ns = 0
        self.state: State = self._quadcopter.parked(*start)
        self.flight = self._new_flight(start)
        self.armed = False
        self.airborne = False
        self._idle_since_s = 0.0
        self._contact_since_s: float | None = None
        self._believed_after_s = LANDED_AFTER_S
        self._outside = False
        self._texts: list[str] = []
        self.failsafe_acted = False
        self._new_filter()

    @property
    def in_failsafe(self) -> bool:
        """As the state in its heartbeat says."""
        return self.failsafe_acted

    def _new_filter(self) -> None:
        self.filter = ArduPilotFilter(self._filter_rng, self._config.step_s)

    def _new_flight(self, home_m: tuple[float, float]) -> SimulatedFlight:
        return SimulatedFlight(timeout_s=self._config.guided_timeout_s, home_m=home_m)

    @property
    def now_s(self) -> float:
        """Simulated time since boot."""
        return self.now_ns / NS

    @property
    def stamp_ms(self) -> int:
        """time_boot_ms: not quite even, as a scheduler's; never after the simulated time, never backwards."""
        now_ms = self.now_ns // 1_000_000
        uneven = UNEVEN_MS if self.step_ns > 2_000_000 * UNEVEN_MS else 0
        return max(now_ms - (self.now_ns // self.step_ns * 7919 >> 3) % (uneven + 1), 0)

    @property
    def mode(self) -> IntEnum:
        """Its number is the heartbeat's custom_mode."""
        return self.flight.mode

    @property
    def ready(self) -> bool:
        """May be armed."""
        return self.now_s >= self._config.ready_after_s and self._estimate_is_sound

    @property
    def healthy(self) -> bool:
        """The checks before arming pass; the autopilot may still refuse."""
        return self.ready

    @property
    def has_position(self) -> bool:
        """Sends a position, which is not yet good enough to fly by."""
        return self.sees_satellites and self.filter.has_position

    @property
    def _estimate_is_sound(self) -> bool:
        return self.filter.well

    @property
    def sees_satellites(self) -> bool:
        """Its receiver has found them since boot."""
        return self.now_s >= POSITION_SHARE * self._config.ready_after_s

    @property
    def filter_settled(self) -> bool:
        """The state estimate is complete; the other checks may still take a while."""
        return self.now_s >= FILTER_SHARE * self._config.ready_after_s

    def take_texts(self) -> list[str]:
        """What the vehicle has said since the last call."""
        texts, self._texts = self._texts, []
        return texts

    def say(self, text: str) -> None:
        """Leave a text for `take_texts`."""
        self._texts.append(text)

    def arm(self, *, force: bool = False) -> RequestOutcome:
        """Start the motors; arming what is armed is accepted."""
        if self.armed:
            return DONE
        if self.battery.remaining <= 0.0:
            return RequestOutcome(False, 'Arm: the battery is empty')
        if not self.ready and not force:
            return RequestOutcome(False, f'Arm: {self.missing()}')
        if self.mode not in ARMABLE:
            return RequestOutcome(False, f'Arm: mode {self.mode.name} cannot be armed in')
        self.armed, self._idle_since_s = True, self.now_s
        self.flight.forget()
        return RequestOutcome(True, 'Arming motors')

    def missing(self) -> str:
        """What it still waits for before it may be armed, '' if nothing."""
        if self.ready:
            return ''
        if not self.sees_satellites or not self.satellites:
            return 'still waiting for a satellite fix'
        if not self._estimate_is_sound:
            return 'Need Position Estimate'
        return 'pre-arm checks still running' if self.filter_settled else 'state estimate not settled yet'

    def disarm(self, *, force: bool = False) -> RequestOutcome:
        """Stop the motors; in the air only by force, and then it falls."""
        if self.airborne and not force:
            return RequestOutcome(False, 'Disarm: still in the air')
        self._disarm()
        return DONE

    def _disarm(self) -> None:
        if self.armed:
            self.say('Disarming motors')
        self.armed = False
        self.flight.forget()

    def set_mode(self, number: int) -> RequestOutcome:
        """Change the flight mode."""
        mode = known(number)
        if mode is None:
            return RequestOutcome(False, f'Mode {number} is not simulated')
        if mode is not self.mode:
            self.flight.enter(mode)
        return DONE

    def take_off(self, altitude_m: float) -> RequestOutcome:
        """Climb to an altitude above the ground; only in GUIDED, armed and on the ground.

        Args:
            altitude_m: above the ground.
        """
        if self.mode is not Mode.GUIDED:
            return RequestOutcome(False, f'Takeoff: mode is {self.mode.name}, not GUIDED')
        if not self.armed:
            return RequestOutcome(False, 'Takeoff: not armed')
        if self.airborne:
            return RequestOutcome(False, 'Takeoff: already in the air')
        if not 0.0 < altitude_m <= HIGHEST_M:
            return RequestOutcome(False, f'Takeoff: altitude must be 0 to {HIGHEST_M:g} m')
        self.flight.take_off(altitude_m, self.now_s)
        return DONE

    def follow(self, setpoint: Setpoint) -> None:
        """A setpoint counts in GUIDED while flying or taking off; otherwise it is ignored without a word."""
        taking_off = self.flight.takeoff_to_m is not None
        if self.armed and self.mode is Mode.GUIDED and (self.airborne or taking_off):
            if taking_off and not self.airborne:
                self.flight.forget()
                self._idle_since_s = self.now_s
            else:
                self.flight.follow(setpoint, self.now_s)

    def step(self) -> None:
        """One tick of simulated time."""
        noise = self._rng.standard_normal(2)
        self.now_ns += self.step_ns
        self._estimate()
        target = self._target()
        self.state = self._quadcopter.step(self.state, target, noise)
        self.battery = self.battery.after(self._config.step_s, armed=self.armed, airborne=self.airborne)
        self._watch_ground(target)
        self._watch_battery()

    def _estimate(self) -> None:
        """Update what the autopilot believes."""
        still = self.satellites and self.satellite_shift_m == (0.0, 0.0) and self.filter.at_rest
        if still:
            return
        self.filter.step(self.satellite_shift_m, satellites=self.satellites)
        self._believe(self.filter)
        for text in self.filter.take_texts():
            self.say(text)
        if self.filter.lands and self.airborne and self.armed and self.mode is not Mode.LAND:
            self.say('EKF Failsafe: changed to LAND Mode')
            self.failsafe_acted = True
            self.flight.enter(Mode.LAND)

    def _believe(self, filter_: ArduPilotFilter | Px4Filter) -> None:
        """A jump carries the loops' reference with it: what holds a velocity stays put, a place from outside does not move."""
        if filter_.jump_m is not None:
            reference = self.state.reference
            moved = reference._replace(position_enu_m=reference.position_enu_m + filter_.jump_m)
            self.state = self.state._replace(reference=moved)
        self.state = self.state._replace(position_error_m=filter_.position_m, velocity_error_m_s=filter_.velocity_m_s)

    def crosses_fence(self) -> bool:
        """Whether it has just left the autopilot's own fence."""
        if not self.fence.is_on:
            return False
        before = self._outside
        east, north, up = (float(part) for part in self.state.estimated_position_enu_m)
        self._outside = self.airborne and self.fence.outside(east - self.flight.home_m[0], north - self.flight.home_m[1], up)
        return self._outside and not before

    def _target(self) -> Target | None:
        if not self.armed:
            return None
        if self.airborne or self.flight.takeoff_to_m is not None:
            return self.flight.target(self.state, self.now_s)
        return None

    def _watch_ground(self, target: Target | None) -> None:
        if self.state.altitude_m > AIRBORNE_M:
            self.airborne, self._contact_since_s, self._idle_since_s = True, None, self.now_s
        elif self.airborne and self.state.touches_ground:
            self._touch(target)
        elif self.armed and not self.airborne:
            self._idle()

    def _touch(self, target: Target | None) -> None:
        if target is not None and (target.velocity_enu_m_s[2] > 0.0 or (target.altitude_m or 0.0) > AIRBORNE_M):
            self._contact_since_s = None  # it wants to climb
            return
        if self._contact_since_s is None:
            self._contact_since_s, self._believed_after_s = self.now_s, self.landing_takes_s()
        if self.now_s - self._contact_since_s >= self._believed_after_s:
            self.airborne, self._contact_since_s, self._idle_since_s = False, None, self.now_s
            self.flight.forget()
            self._landed()

    def landing_takes_s(self) -> float:
        """How long the contact with the ground lasts until this landing is believed."""
        return LANDED_AFTER_S

    def _landed(self) -> None:
        if self.mode in DESCENDING:
            self._disarm()

    def _idle(self) -> None:
        if self.flight.takeoff_to_m is not None:
            self._idle_since_s = self.now_s
        elif self.mode in DESCENDING or self.now_s - self._idle_since_s >= DISARM_DELAY_S:
            self._disarm()

    def _watch_battery(self) -> None:
        if self.battery.remaining <= 0.0 and self.armed and self.mode.name != 'LAND':
            self.say('Battery empty: landing')
            self.flight.enter(type(self.mode)['LAND'])
