"""The interval of a share is the one that scipy gives, without the second that its import takes."""

from __future__ import annotations

import pytest
from scipy.stats import binomtest

from advise_ros.core.statistics import share_in_words, wilson


@pytest.mark.parametrize('trials', [1, 7, 100])
def test_the_interval_is_wilsons(trials: int) -> None:
    for successes in range(trials + 1):
        known = binomtest(successes, trials).proportion_ci(method='wilson')
        assert wilson(successes, trials) == pytest.approx((known.low, known.high), abs=1e-12)


def test_a_share_in_words() -> None:
    assert share_in_words(89, 100) == '89 (81-94)'
