"""What the autopilot believes of position and velocity, and how far that is from the truth.

PX4 on SIH has a sloppy velocity estimate: its error of 0.3 m/s comes and goes within seconds, satellites correct the
position only, and the height drifts with the barometer. ArduCopter's errors are too small to matter.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# How long an error of the velocity lasts, and how fast satellites pull the position back.
CORRELATION_S = 5.0
CORRECTION_1_S = 1.0
# How fast the barometer drifts, for each m/s of velocity error: about 0.6 m in a minute at 0.3 m/s.
BAROMETER_M_PER_SQRT_S = 0.25
DRAWN_AT_ONCE = 1024


class Wander:
    """The errors of a sloppy estimator; it draws from a generator of its own, so the weather stays as it is.

    Attributes:
        position_m, velocity_m_s: estimate minus truth in ENU, (3,).
    """

    def __init__(self, drift_m_s: float, rng: np.random.Generator, step_s: float) -> None:
        self.position_m, self.velocity_m_s = np.zeros(3), np.zeros(3)
        self._barometer_m = np.zeros(3)
        self._drift_m_s, self._rng, self._step_s = drift_m_s, rng, step_s
        self._kept = math.exp(-step_s / CORRELATION_S)
        self._kick_m_s = drift_m_s * math.sqrt((1.0 - self._kept**2) / 2.0)  # Of each axis.
        self._barometer_kick_m = BAROMETER_M_PER_SQRT_S * drift_m_s * math.sqrt(step_s)
        self._drawn = np.zeros((0, 4))
        self._next = 0

    def step(self, *, satellites: bool = True) -> None:
        """The errors one tick later; without satellites nothing pulls the position back."""
        if self._drift_m_s == 0.0:
            return
        noise = self._noise()
        self.velocity_m_s = self._kept * self.velocity_m_s + self._kick_m_s * noise[:3]
        self._barometer_m[2] += self._barometer_kick_m * noise[3]
        change = self.velocity_m_s
        if satellites:
            change = change - CORRECTION_1_S * (self.position_m - self._barometer_m)
        self.position_m = self.position_m + self._step_s * change

    def _noise(self) -> Array:
        if self._next == len(self._drawn):
            self._drawn, self._next = self._rng.standard_normal((DRAWN_AT_ONCE, 4)), 0
        self._next += 1
        drawn: Array = self._drawn[self._next - 1]
        return drawn
