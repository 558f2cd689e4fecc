"""A clock that is set, against steady time."""

from __future__ import annotations

from advise_ros.core.clock_steps import ClockSteps
from advise_ros.core.units import NS

BEGIN_NS = 1_800_000_000 * NS


def test_a_clock_that_is_set_is_noticed_once_and_remembered_for_a_while() -> None:
    clock = ClockSteps(NS, 2 * NS)
    assert not any(clock.look(BEGIN_NS + steady_ns, steady_ns) for steady_ns in range(0, 3 * NS, NS))
    assert not clock.was_set(2 * NS)
    set_back = BEGIN_NS - 60 * NS
    assert clock.look(set_back + 3 * NS, 3 * NS)
    assert not clock.look(set_back + 4 * NS, 4 * NS)
    assert clock.was_set(4 * NS)
    assert clock.unset_ns(4 * NS) == BEGIN_NS + 4 * NS
    assert not clock.was_set(5 * NS)


def test_drift_and_jitter_are_no_setting() -> None:
    clock = ClockSteps(NS, NS)
    steps = [0, NS // 2, -NS // 2, NS // 2, 3 * NS // 2]
    assert not any(clock.look(BEGIN_NS + second * NS + step, second * NS) for second, step in enumerate(steps))
