"""Mean wind and gusts: an Ornstein-Uhlenbeck process, exact at any step.

RotorPy's Dryden gusts draw from numpy's global state; this one takes its random numbers from the caller.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CORRELATION_S = 2.0


@dataclass(frozen=True)
class Wind:
    """Horizontal wind in ENU; gusts have a standard deviation of `gust_m_s` on each axis."""

    mean_enu_m_s: tuple[float, float] = (0.0, 0.0)
    gust_m_s: float = 0.0

    def next_gust(self, gust_m_s: Array, noise: Array, step_s: float) -> Array:
        """The gust one step later.

        Args:
            gust_m_s: now, east and north, (2,).
            noise: standard normal, (2,).
            step_s: length of the step.
        """
        kept = math.exp(-step_s / CORRELATION_S)
        return kept * gust_m_s + self.gust_m_s * math.sqrt(1.0 - kept * kept) * noise

    def at(self, gust_m_s: Array) -> Array:
        """Wind velocity in ENU, (3,)."""
        return np.array([self.mean_enu_m_s[0] + gust_m_s[0], self.mean_enu_m_s[1] + gust_m_s[1], 0.0])
