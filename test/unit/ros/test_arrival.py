"""How long messages lay in a queue, by their way against the shortest lately."""

from __future__ import annotations

import pytest

from advise_ros.ros import arrival
from advise_ros.ros.arrival import ArrivalWatch


class Clocks:
    """MOCK: time stands until a test moves it."""

    def __init__(self) -> None:
        self.steady_s, self.wall_s = 100.0, 1e6

    def monotonic(self) -> float:
        return self.steady_s

    def time_ns(self) -> int:
        return round(self.wall_s * 1e9)

    def sleep(self, seconds: float) -> None:
        self.steady_s += seconds
        self.wall_s += seconds


@pytest.fixture
def clocks(monkeypatch: pytest.MonkeyPatch) -> Clocks:
    made = Clocks()
    monkeypatch.setattr(arrival, 'time', made)
    return made


def hear(watch: ArrivalWatch, clocks: Clocks, way_s: float) -> float:
    return watch.waited_s({'source_timestamp': round((clocks.wall_s - way_s) * 1e9)})


@pytest.mark.parametrize('apart_s', [0.0, -7200.0, 7200.0])
def test_a_message_from_the_queue_is_told_from_a_fresh_one_whatever_the_clocks_say(clocks: Clocks, apart_s: float) -> None:
    watch = ArrivalWatch()
    for _ in range(100):
        assert hear(watch, clocks, apart_s + 0.002) == pytest.approx(0.0, abs=1e-6)
        clocks.sleep(0.05)
    clocks.sleep(8.0)  # Held up.
    assert hear(watch, clocks, apart_s + 8.0) == pytest.approx(7.998, abs=1e-6)
    assert hear(watch, clocks, apart_s + 0.01) == pytest.approx(0.008, abs=1e-6)


@pytest.mark.parametrize(('step_s', 'late_for_s'), [(60.0, 0.0), (-60.0, 0.0), (-5.0, 0.0), (5.0, 4.1)])
def test_a_clock_that_is_set_is_no_wait_for_long(clocks: Clocks, step_s: float, late_for_s: float) -> None:
    watch = ArrivalWatch()
    for _ in range(100):
        hear(watch, clocks, 0.002)
        clocks.sleep(0.05)
    began_s = clocks.steady_s
    while hear(watch, clocks, 0.002 + step_s) > 0.5:
        clocks.sleep(0.05)
    assert clocks.steady_s - began_s <= late_for_s


def test_a_middleware_that_does_not_tell_means_no_wait() -> None:
    assert ArrivalWatch().waited_s({}) == 0.0
