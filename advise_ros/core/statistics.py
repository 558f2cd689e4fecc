"""Shares of trials with their 95 % intervals."""

from __future__ import annotations

from typing import NamedTuple

from scipy.stats import binomtest


class Interval(NamedTuple):
    """Lower and upper end of a share, 0 to 1."""

    low: float
    high: float


def wilson(successes: int, trials: int) -> Interval:
    """Wilson's 95 % score interval of the share of independent trials that succeed."""
    ends = binomtest(successes, trials).proportion_ci(method='wilson')
    return Interval(float(ends.low), float(ends.high))


def share_in_words(successes: int, trials: int) -> str:
    """Per cent of independent trials that succeed, with Wilson's interval: '89 (57-98)'."""
    low, high = wilson(successes, trials)
    return f'{100 * successes / trials:.0f} ({100 * low:.0f}-{100 * high:.0f})'
