"""Which poses are flown by when clocks are set, and when they are not."""

from __future__ import annotations

import pytest

from advise_ros.ros.convert import stamp_from_ns
from advise_ros.ros.flying import PoseGate
from support.flying import pose

NS = 1_000_000_000
NOW_NS = 1_800_000_000 * NS
TICK_NS = 20_000_000


class Source:
    """Poses by a clock that can be set apart from ours."""

    def __init__(self) -> None:
        self.gate = PoseGate()
        self.ours_ns = self.theirs_ns = NOW_NS

    def passes(self) -> bool:
        self.ours_ns += TICK_NS
        self.theirs_ns += TICK_NS
        message = pose(1.0, 2.0, 3.0)
        message.header.stamp = stamp_from_ns(self.theirs_ns)
        return self.gate.take(message, self.ours_ns) is not None


@pytest.mark.parametrize('jump_s', [-60, -3, 60])
def test_a_clock_that_is_set_stops_nothing_whenever_the_source_follows(jump_s: int) -> None:
    source = Source()
    assert source.passes()
    source.ours_ns += jump_s * NS
    assert all(source.passes() for _ in range(5))
    source.theirs_ns += jump_s * NS
    assert all(source.passes() for _ in range(5))


def test_a_source_that_goes_back_alone_is_refused_until_it_has_caught_up() -> None:
    source = Source()
    assert source.passes()
    source.theirs_ns -= 2 * TICK_NS
    assert not source.passes()
    assert 'older than the one before' in source.gate.problem
    source.theirs_ns += TICK_NS
    assert source.passes()
    source.theirs_ns -= 60 * NS
    assert not source.passes()


def test_late_poses_are_refused_while_the_clock_is_being_set_too() -> None:
    source = Source()
    assert source.passes()
    source.ours_ns -= 60 * NS
    assert source.passes()
    source.theirs_ns -= 2 * TICK_NS
    assert not source.passes()


def test_a_source_of_another_clock_is_refused() -> None:
    source = Source()
    source.theirs_ns += 60 * NS
    assert not source.passes()
    assert 'ahead of this node' in source.gate.problem
