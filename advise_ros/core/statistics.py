"""Shares of trials with their 95 % intervals."""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import NamedTuple

# Not scipy.stats: its import takes a second, and the demo waits for it.
Z = NormalDist().inv_cdf(0.975)


class Interval(NamedTuple):
    """Lower and upper end of a share, 0 to 1."""

    low: float
    high: float


def wilson(successes: int, trials: int) -> Interval:
    """Wilson's 95 % score interval of the share of independent trials that succeed."""
    share, unsure = successes / trials, Z * Z / trials
    middle = (share + unsure / 2.0) / (1.0 + unsure)
    half = math.sqrt(unsure * (share * (1.0 - share) + unsure / 4.0)) / (1.0 + unsure)
    return Interval(0.0 if successes == 0 else middle - half, 1.0 if successes == trials else middle + half)


def share_in_words(successes: int, trials: int) -> str:
    """Per cent of independent trials that succeed, with Wilson's interval: '89 (57-98)'."""
    low, high = wilson(successes, trials)
    return f'{100 * successes / trials:.0f} ({100 * low:.0f}-{100 * high:.0f})'
