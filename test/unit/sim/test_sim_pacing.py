"""Simulated time follows steady time, and says so when it cannot."""

from __future__ import annotations

import pytest

from advise_ros.core.units import NS
from advise_ros.sim.pacing import Pacer

STEP_NS = 25_000_000
MS = 1_000_000


def run(pacer: Pacer, steady_times_ns: list[int], ticks_possible: int = 1000) -> int:
    done = 0
    for now_ns in steady_times_ns:
        ticks = min(pacer.due(now_ns), ticks_possible)
        pacer.did(ticks)
        done += ticks
    return done


@pytest.mark.parametrize('speedup', [0.1, 1.0, 7.3, 20.0])
def test_simulated_time_is_steady_time_times_the_speedup(speedup):
    pacer = Pacer(speedup, STEP_NS)
    done = run(pacer, [5 * NS + i * 5 * MS for i in range(2001)])
    assert done == int(10 * NS * speedup) // STEP_NS
    assert pacer.achieved == pytest.approx(speedup, rel=0.02)
    assert not pacer.falls_behind


def test_a_machine_that_is_too_slow_is_reported_with_what_it_reaches():
    pacer = Pacer(20.0, STEP_NS)
    done = run(pacer, [i * 5 * MS for i in range(2001)], ticks_possible=2)  # 400 ticks a second: 10 times real time
    assert pacer.falls_behind
    assert pacer.achieved == pytest.approx(10.0, rel=0.05)
    assert done == pytest.approx(10 * 400, rel=0.05)


def test_after_a_pause_time_goes_on_without_a_leap():
    pacer = Pacer(1.0, STEP_NS)
    run(pacer, [0, 100 * MS])
    assert pacer.due(60 * NS) == 1
    pacer.did(1)
    assert run(pacer, [60 * NS + i * MS for i in range(1001)]) == 39  # with the first one 40, a second's worth


def test_a_speedup_of_zero_always_has_one_more_tick():
    pacer = Pacer(0.0, STEP_NS)
    assert run(pacer, [i * MS for i in range(500)]) == 500
    assert not pacer.falls_behind


def test_another_speed_counts_from_when_it_is_set() -> None:
    pacer = Pacer(10.0, 10 * MS)
    assert pacer.due(0) == 0
    assert pacer.due(100 * MS) == 100
    pacer.did(100)
    pacer.run_at(2.0, 100 * MS)
    assert pacer.due(200 * MS) == 20
    pacer.run_at(2.0, 150 * MS)
    assert pacer.due(200 * MS) == 20, 'the same speed changes nothing'
