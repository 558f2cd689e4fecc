"""Stamps of an autopilot's messages in our clock."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise

import numpy as np
import pytest

from advise_ros.mavlink.stamps import REBOOT_MESSAGES, BootOrder, Stamper
from advise_ros.mavlink.timesync import Bounds
from advise_ros.ros.autopilot_clock import AutopilotClock

S = 1_000_000_000
MS = 1_000_000
# The ROS clock is ahead of the steady one by this.
EPOCH_S = 1000.0
PERIOD_S = 0.05


class Link:
    """An autopilot whose clock is a function of true time, and messages of it that arrive late.

    Args:
        boot_s: true (steady) time to time since boot.
        late_s: true time of sending to the delay on the way here.
        up_s: the delay on the way there; None: TIMESYNC is not answered.
    """

    def __init__(
        self, boot_s: Callable[[float], float] = lambda t: t - 90.0, late_s: Callable[[float], float] = lambda t: 0.003,
        up_s: Callable[[float], float] | None = lambda t: 0.003,
    ) -> None:
        self.boot_s, self.late_s, self.up_s = boot_s, late_s, up_s
        self.stamper = Stamper(simulated=False)
        self.set_s = lambda t: 0.0
        self.stamps_ns: list[int] = []

    def run(self, times_s: Iterable[float]) -> list[tuple[float, float]]:
        """(true time of a message, its stamp in true time) of those that got one."""
        arrivals = [(t + self.late_s(t), t, 'position') for t in times_s]
        if self.up_s is not None:
            asked = [t for _, t, _ in arrivals[::5]]
            arrivals += [(t + self.up_s(t) + self.late_s(t + self.up_s(t)), t, 'timesync') for t in asked]
        got = []
        for at_s, t, what in sorted(arrivals):
            if what == 'timesync':
                theirs = self.boot_s(t + self.up_s(t))  # type: ignore[misc]
                self.stamper.bounded(Bounds(t - theirs, at_s - theirs), at_s)
                continue
            now_ns = round((at_s + EPOCH_S + self.set_s(at_s)) * S)
            stamp = self.stamper.stamp_ns(round(self.boot_s(t) * 1000), at_s, now_ns, at_s)
            if stamp is not None:
                self.stamps_ns.append(stamp)
                got.append((t, stamp / S - EPOCH_S - self.set_s(at_s)))
        return got


def times(seconds: float, start_s: float = 100.0) -> list[float]:
    return [start_s + PERIOD_S * n for n in range(round(seconds / PERIOD_S))]


def errors(got: list[tuple[float, float]]) -> list[float]:
    return [stamp - t for t, stamp in got]


def test_stamps_keep_the_autopilots_spacing_whatever_the_delay() -> None:
    late = dict(zip(times(0.25), (0.003, 0.04, 0.001, 0.045, 0.002), strict=True))
    link = Link(late_s=lambda t: late[t], up_s=None)
    stamps = [stamp for _, stamp in link.run(times(0.25))]
    assert np.diff(stamps) == pytest.approx(PERIOD_S, abs=0.003)


def test_the_first_message_late_does_not_make_all_stamps_late() -> None:
    link = Link(late_s=lambda t: 0.9 if t < 100.2 else 0.002, up_s=None)
    got = link.run(times(5.0))
    assert max(errors(got)[60:]) < 0.005
    assert all(after[1] > before[1] for before, after in pairwise(got))


def test_steady_late_delivery_keeps_stamps_right_as_long_as_the_round_trip_tells_of_it() -> None:
    link = Link(late_s=lambda t: 0.003 if t < 110.0 else 2.0)
    assert max(map(abs, errors(link.run(times(60.0))))) < 0.01


def test_growing_and_jittering_delay_moves_nothing() -> None:
    rng = np.random.default_rng(3)
    jitter = {t: float(rng.uniform(0.0, 0.4)) for t in times(60.0)}
    link = Link(late_s=lambda t: 0.003 + 0.05 * max(0.0, t - 110.0) + (jitter.get(t, 0.0) if t > 110.0 else 0.0))
    assert max(map(abs, errors(link.run(times(60.0))))) < 0.01
    assert not link.stamper.different_speeds


@pytest.mark.parametrize('answered', [True, False])
def test_a_pause_that_is_never_caught_up_is_followed(answered: bool) -> None:
    link = Link(boot_s=lambda t: t - 90.0 if t < 110.0 else t - 93.0, up_s=(lambda t: 0.003) if answered else None)
    got = link.run([t for t in times(40.0) if not 110.0 <= t < 113.0])
    late = [stamp - t for t, stamp in got if t > (113.5 if answered else 119.0)]
    assert max(map(abs, late)) < 0.01
    assert all(after[1] > before[1] for before, after in pairwise(got))
    assert not link.stamper.different_speeds


def test_pauses_and_late_moments_are_no_clocks_of_different_speeds() -> None:
    def boot_s(t: float) -> float:
        return t - 90.0 - 3.0 * ((t - 100.0) // 20.0)

    link = Link(boot_s=boot_s, late_s=lambda t: 1.5 if (t % 7.0) < 1.0 else 0.003)
    told = []
    for n in range(12):
        link.run(times(10.0, 100.0 + 10.0 * n))
        told.append(link.stamper.different_speeds)
    assert not any(told)


@pytest.mark.parametrize('speed', [5.0, 0.5])
def test_clocks_of_different_speeds_are_noticed(speed: float) -> None:
    link = Link(boot_s=lambda t: 10.0 + speed * (t - 100.0))
    got = link.run(times(20.0))
    assert link.stamper.different_speeds
    assert max(map(abs, errors(got)[20:])) < 0.4  # Stamps follow nevertheless.


@pytest.mark.parametrize('speed', [0.99, 0.996, 1.00005, 1.01])
def test_slow_and_fast_hosts_are_followed_without_a_word(speed: float) -> None:
    link = Link(boot_s=lambda t: 10.0 + speed * (t - 100.0))
    got = link.run(times(300.0))
    assert not link.stamper.different_speeds
    assert max(map(abs, errors(got))) < 0.01


def test_no_stamp_before_our_clock_begins_or_for_a_repetition() -> None:
    stamper = Stamper(simulated=True)
    assert stamper.stamp_ns(5000, 5.0, 0, 5.0) is None
    assert stamper.stamp_ns(5000, 5.0, 5 * S, 5.0) == 5 * S
    assert stamper.stamp_ns(5000, 5.0, 5 * S, 5.0) is None
    assert stamper.stamp_ns(4990, 5.0, 5 * S, 5.0) is None


def test_a_simulators_time_is_taken_as_it_is() -> None:
    stamper = Stamper(simulated=True)
    assert stamper.stamp_ns(5000, 5.0, 5 * S + 10 * MS, 5.0) == 5 * S
    assert stamper.stamp_ns(5100, 5.0, 5 * S, 5.0) == 5100 * MS


def test_a_simulation_that_starts_anew_takes_the_stamps_back() -> None:
    stamper = Stamper(simulated=True)
    assert stamper.stamp_ns(50_000, 5.0, 50 * S, 5.0) == 50 * S
    assert stamper.stamp_ns(1000, 9.0, 1 * S, 9.0) == 1 * S
    assert stamper.stamp_ns(1050, 9.0, 1 * S, 9.0) == 1050 * MS


def test_an_autopilot_that_reboots_under_a_clock_that_goes_on_is_stamped_by_that_clock() -> None:
    stamper = Stamper(simulated=True)
    assert stamper.stamp_ns(500_000, 5.0, 500 * S, 5.0) == 500 * S
    assert stamper.stamp_ns(1000, 9.0, 504 * S, 9.0) == 504 * S
    assert stamper.stamp_ns(1100, 9.0, 504 * S, 9.0) == 504 * S + 100 * MS


@pytest.mark.parametrize('answered', [True, False])
def test_a_reboot_is_followed_by_stamps_that_still_rise(answered: bool) -> None:
    link = Link(boot_s=lambda t: t - 50.0 if t < 110.0 else t - 112.0, up_s=(lambda t: 0.003) if answered else None)
    got = link.run([t for t in times(40.0) if not 110.0 <= t < 113.0])
    assert max(map(abs, errors(got))) < 0.01
    assert len(got) >= 733
    assert all(after[1] > before[1] for before, after in pairwise(got))


@pytest.mark.parametrize('set_s', [60.0, -60.0, 0.3])
def test_a_wall_clock_that_is_set_takes_the_stamps_with_it(set_s: float) -> None:
    link = Link()
    link.set_s = lambda t: set_s if t > 105.0 else 0.0
    assert max(map(abs, errors(link.run(times(20.0))))) < 0.01


def test_a_wall_clock_set_back_a_little_slows_the_stamps_until_it_is_past_them() -> None:
    link = Link()
    link.set_s = lambda t: -0.5 if t > 105.0 else 0.0
    got = link.run(times(20.0))
    assert all(after > before for before, after in pairwise(link.stamps_ns))
    assert abs(errors(got)[-1]) < 0.01


def test_one_late_message_moves_nothing() -> None:
    link = Link(late_s=lambda t: 4.0 if 104.99 < t < 105.01 else 0.003)
    got = link.run(times(20.0))
    assert max(map(abs, errors(got))) < 0.01


def test_the_autopilots_clock_for_others_never_runs_backward() -> None:
    clock = AutopilotClock()
    published = [clock.advance_ns(ms) for ms in (1000, 1050, 1050, 900, 1100, 500_000, 200, 250)]
    assert published == [1000 * MS, 1050 * MS, None, None, 1100 * MS, 500_000 * MS, 500_200 * MS, 500_250 * MS]


def test_a_message_that_comes_ten_seconds_late_is_no_reboot() -> None:
    rng = np.random.default_rng(5)
    arrivals = sorted((50 * n + rng.uniform(0.0, 10_000.0), 50 * n) for n in range(20_000))
    order = BootOrder()
    news = [boot_ms for _, boot_ms in arrivals if order.is_news(boot_ms)]
    assert order.reboots == 0
    assert news == sorted(set(news))


def test_a_reboot_is_one() -> None:
    order = BootOrder()
    assert all(order.is_news(boot_ms) for boot_ms in range(100_000, 110_000, 50))
    news = [order.is_news(boot_ms) for boot_ms in range(0, 5000, 50)]
    assert order.reboots == 1
    assert news == [False] * (REBOOT_MESSAGES - 1) + [True] * (100 - REBOOT_MESSAGES + 1)
