"""What satellites that mislead or fail do to each autopilot's position filter, as measured on SITL and SIH."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from advise_ros.sim.estimator import Wander

Array = NDArray[np.float64]

# EKF_STATUS_REPORT.flags: all well; the same without a horizontal position; without a horizontal velocity too.
ALL_WELL, NO_POSITION, NO_VELOCITY, GLITCHING = 0x33F, 0x027, 0x025, 0x8000
QUIET_VARIANCE, VARIANCE_PER_M = 0.03, 0.27
# A shift whose variance is below 1 is believed within a moment. A larger one is refused, named, and believed in the end.
BELIEVED_WITHIN_S, NAMED_AFTER_S, JUMPS_AFTER_S, NAMED_FOR_S = 1.0, 1.2, 10.0, 10.0
FLAGS_FALL_BEFORE_S, FLAGS_FALL_SHARE = 0.2, 8 / 13
# Satellites are lost: the filter falls back, the autopilot lands, positions end.
FALLS_BACK_S, LANDS_S, POSITIONS_END_S, COMES_BACK_S = 6.7, 7.6, 14.7, 2.0
BLIND_ACCELERATION_M_S2, BLIND_SPEED_M_S = 0.1, 0.5


class ArduPilotFilter:
    """ArduCopter's filter: a shift of the satellites is refused for 10 s, then believed in one jump.

    Attributes:
        position_m, velocity_m_s: estimate minus truth in ENU, (3,).
        jump_m: how far the estimate jumped in this tick, (3,), or None.
        flags, variance: EKF_STATUS_REPORT's flags and pos_horiz_variance.
        lands: the autopilot gives up and lands.
        at_rest: nothing is wrong and nothing is on its way back.
        has_position: a position is sent at all.
    """

    def __init__(self, rng: np.random.Generator, step_s: float) -> None:
        self._rng, self._step_s = rng, step_s
        self.position_m, self.velocity_m_s = np.zeros(3), np.zeros(3)
        self.jump_m: Array | None = None
        self.flags, self.variance = ALL_WELL, QUIET_VARIANCE
        self.lands, self.has_position = False, True
        self._texts: list[str] = []
        self._refused_s = self._blind_s = 0.0
        self._seen_s = COMES_BACK_S
        self._named_until_s = -math.inf
        self._flags_fall = False
        self._away = np.zeros(3)
        self._now_s = 0.0
        self.at_rest = True

    @property
    def well(self) -> bool:
        return self.flags == ALL_WELL

    def take_texts(self) -> list[str]:
        texts, self._texts = self._texts, []
        return texts

    def step(self, shift_m: tuple[float, float], *, satellites: bool) -> None:
        """One tick.

        Args:
            shift_m: (east, north) error of the satellites.
            satellites: whether there are any.
        """
        self._now_s += self._step_s
        self.jump_m = None
        if satellites:
            self._seen_s += self._step_s
            self._see(np.array([*shift_m, 0.0]))
        else:
            self._seen_s = 0.0
            self._go_on_blind()
        named = self._now_s < self._named_until_s
        self.at_rest = self.well and self._blind_s == 0.0 and not self.position_m.any() and not named

    def _see(self, shift_m: Array) -> None:
        if self._blind_s > 0.0:
            self._come_back(shift_m)
            return
        innovation = shift_m - self.position_m
        off_m = float(np.hypot(innovation[0], innovation[1]))
        self.variance = QUIET_VARIANCE + VARIANCE_PER_M * off_m
        if self.variance < 1.0:
            self._refused_s = 0.0
            near = off_m < 1e-3
            self.position_m = shift_m if near else self.position_m + innovation * min(self._step_s / BELIEVED_WITHIN_S, 1.0)
        else:
            self._refuse(innovation)
        self._name()

    def _refuse(self, innovation_m: Array) -> None:
        if self._refused_s == 0.0:
            self._flags_fall = bool(self._rng.random() < FLAGS_FALL_SHARE)
        self._refused_s += self._step_s
        if self._refused_s >= JUMPS_AFTER_S:
            self._jump_by(innovation_m)
            self._named_until_s = self._now_s + NAMED_FOR_S

    def _jump_by(self, change_m: Array) -> None:
        self.position_m, self.jump_m = self.position_m + change_m, change_m
        self._refused_s, self.variance = 0.0, QUIET_VARIANCE

    def _name(self) -> None:
        named = self._refused_s >= NAMED_AFTER_S or self._now_s < self._named_until_s
        falls = self._flags_fall and self._refused_s >= JUMPS_AFTER_S - FLAGS_FALL_BEFORE_S
        before = bool(self.flags & GLITCHING)
        self.flags = (NO_POSITION if falls else ALL_WELL) | (GLITCHING if named else 0)
        if named != before:
            self._texts.append('GPS Glitch or Compass error' if named else 'Glitch cleared')

    def _go_on_blind(self) -> None:
        if self._blind_s == 0.0:
            angle = self._rng.uniform(-math.pi, math.pi)
            self._away = np.array([math.cos(angle), math.sin(angle), 0.0])
        self._blind_s += self._step_s
        self.velocity_m_s = self._away * min(BLIND_ACCELERATION_M_S2 * self._blind_s, BLIND_SPEED_M_S)
        self.position_m = self.position_m + self.velocity_m_s * self._step_s
        if self._blind_s >= FALLS_BACK_S:
            self.flags = NO_VELOCITY
        self.lands = self._blind_s >= LANDS_S
        self.has_position = self._blind_s < POSITIONS_END_S

    def _come_back(self, shift_m: Array) -> None:
        """A fix that lasts is believed at once."""
        if self._seen_s >= COMES_BACK_S:
            self._jump_by(shift_m - self.position_m)
            self.velocity_m_s = np.zeros(3)
            self.flags, self.lands, self.has_position, self._blind_s = ALL_WELL, False, True, 0.0


# ESTIMATOR_STATUS.flags of PX4; the last one is added on the ground.
PX4_ALL_WELL, PX4_NO_POSITION, PX4_STANDS_STILL = 0x37F, 0x365, 0x080
PX4_FALLS_BACK_S, PX4_COMES_BACK_S, PX4_FAILSAFE_ENDS_S = 5.2, 1.0, 1.7
SLIDES_M, SLIDES_S = 6.0, 0.5
PX4_BLIND_M_S2, PX4_BLIND_SPEED_M_S = (0.15, 0.35), 2.0


class Px4Filter:
    """PX4's filter: it wanders; without satellites it runs away, and comes back in a counted jump or a slide.

    Attributes:
        position_m, velocity_m_s: estimate minus truth in ENU, (3,).
        jump_m: how far the estimate jumped in this tick, (3,), or None.
        flags, resets: ESTIMATOR_STATUS.flags and ODOMETRY.reset_counter.
        lands: a failsafe lands the vehicle.
    """

    def __init__(self, wander: Wander, rng: np.random.Generator, step_s: float) -> None:
        self._wander, self._rng, self._step_s = wander, rng, step_s
        self._away_m, self._away_m_s = np.zeros(3), np.zeros(3)
        self._pull_m_s2 = np.zeros(3)
        self._blind_s, self._seen_s = 0.0, math.inf
        self._slide_m = np.zeros(3)
        self.jump_m: Array | None = None
        self.flags, self.resets, self.lands = PX4_ALL_WELL, 0, False

    @property
    def position_m(self) -> Array:
        return self._wander.position_m + self._away_m

    @property
    def velocity_m_s(self) -> Array:
        return self._wander.velocity_m_s + self._away_m_s

    def step(self, *, satellites: bool) -> None:
        """One tick."""
        self._wander.step(satellites=satellites)
        self.jump_m = None
        if not satellites:
            self._go_on_blind()
        elif self._blind_s > 0.0:
            self._come_back()

    def _go_on_blind(self) -> None:
        if self._blind_s == 0.0:
            angle, pull = self._rng.uniform(-math.pi, math.pi), self._rng.uniform(*PX4_BLIND_M_S2)
            self._pull_m_s2 = pull * np.array([math.cos(angle), math.sin(angle), 0.0])
        self._seen_s = 0.0
        self._blind_s += self._step_s
        wanted = self._away_m_s + self._pull_m_s2 * self._step_s
        if float(np.hypot(wanted[0], wanted[1])) < PX4_BLIND_SPEED_M_S:
            self._away_m_s = wanted
        self._away_m = self._away_m + self._away_m_s * self._step_s
        if self._blind_s >= PX4_FALLS_BACK_S:
            self.flags, self.lands = PX4_NO_POSITION, True

    def _come_back(self) -> None:
        """One way or the other: some of the way in a slide that nothing counts, the rest in a jump that is counted."""
        if self._seen_s == 0.0:
            off_m = float(np.hypot(self._away_m[0], self._away_m[1]))
            slides = self._rng.random() < 0.5 or not self.lands
            self._slide_m = -self._away_m * (min(SLIDES_M / off_m, 1.0) if slides and off_m > 0.0 else 0.0)
        self._seen_s += self._step_s
        if self._seen_s <= SLIDES_S + 1e-9:
            self._away_m = self._away_m + self._slide_m * self._step_s / SLIDES_S
        if self._seen_s >= PX4_COMES_BACK_S and self._away_m_s.any():
            self._jump_back()
        if self._seen_s >= PX4_FAILSAFE_ENDS_S:
            self.lands, self._blind_s = False, 0.0

    def _jump_back(self) -> None:
        if float(np.hypot(self._away_m[0], self._away_m[1])) > 1.0:
            self.jump_m, self.resets = -self._away_m, (self.resets + 1) % 256
        self._away_m, self._away_m_s, self.flags = np.zeros(3), np.zeros(3), PX4_ALL_WELL
