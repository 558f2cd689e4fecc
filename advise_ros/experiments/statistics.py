"""Means over trials with their 95 % intervals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import t

from advise_ros.core.numerics import Floats

CONFIDENCE = 0.95


class Estimate(NamedTuple):
    """A mean and the half width of its 95 % interval; 0 for a single trial, which tells none."""

    mean: float
    ci95: float
    trials: int

    @property
    def low(self) -> float:
        """Lower end of the interval."""
        return self.mean - self.ci95

    @property
    def high(self) -> float:
        """Upper end of the interval."""
        return self.mean + self.ci95


def estimate(values: Floats) -> Estimate:
    """Of independent trials, by Student's t."""
    trials = len(values)
    if trials < 2:
        return Estimate(float(values.mean()), 0.0, trials)
    half = t.ppf(0.5 + CONFIDENCE / 2, trials - 1) * values.std(ddof=1) / np.sqrt(trials)
    return Estimate(float(values.mean()), float(half), trials)
