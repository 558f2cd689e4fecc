"""Late messages are seen whatever the clocks do; clocks that do something make nothing late for good."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.core.guard.delay_watch import DelayWatch

NS = 10**9
TIMEOUT_S = 0.5
PERIOD_S = 0.05
WALL_S = 1_700_000_000.0


class Link:
    """A sender at 20 Hz whose messages arrive later by `delay`; its clock runs at `rate` and is `ahead` of ours.

    Attributes:
        newest: what the watch said of the last arrival, s.
        late: how many arrivals counted as late.
    """

    def __init__(self, rate: float = 1.0, allowed_s: float = 0.2) -> None:
        self.watch = DelayWatch(allowed_s)
        self.rate, self.boot_s, self.wall_s = rate, 100.0, WALL_S
        self.now_s, self.newest, self.late = 50.0, 0.0, 0
        self.rng = np.random.default_rng(1)

    def run(self, seconds: float, delay_s: float = 0.0, *, up_s: float = 0.0, asks: bool = False, clock: bool = False) -> None:
        """So many of our seconds. `asks`: TIMESYNC four times a second, `clock`: our node's clock is given, too."""
        for tick in range(round(seconds / PERIOD_S)):
            self.now_s += PERIOD_S
            self.boot_s += PERIOD_S * self.rate
            jitter_s = float(self.rng.uniform(0.0, 0.01))
            sent_s, at_s = self.now_s, self.now_s + delay_s + jitter_s
            boot_s = self.boot_s + self.rate * up_s
            if asks and tick % 5 == 0:
                self.watch.bounded(sent_s - boot_s, at_s + up_s - boot_s, at_s + up_s)
            ours_ns = round((self.wall_s + at_s) * NS) if clock else 0
            self.newest = self.watch.arrived(round((self.boot_s) * NS), at_s, ours_ns)
            self.late += self.newest > TIMEOUT_S

    def pause(self, seconds: float) -> None:
        """The sender stands still, its clock too, which never catches up."""
        self.now_s += seconds


def test_nothing_is_late_on_a_good_link() -> None:
    link = Link()
    link.run(60.0)
    assert link.late == 0
    assert link.newest < 0.02


@pytest.mark.parametrize('asks', [False, True])
@pytest.mark.parametrize('delay_s', [0.6, 2.0, 10.0])
def test_a_steady_delay_stays_late_for_as_long_as_it_lasts(delay_s: float, asks: bool) -> None:
    link = Link()
    link.run(5.0, asks=asks)
    link.run(120.0, delay_s, asks=asks)
    assert link.late == 2400
    assert link.newest == pytest.approx(delay_s, abs=0.03)
    link.late = 0
    link.run(5.0, asks=asks)
    assert link.late == 0


@pytest.mark.parametrize('asks', [False, True])
def test_a_delay_that_grows_to_ten_seconds_in_a_minute_is_followed(asks: bool) -> None:
    link = Link()
    link.run(5.0, asks=asks)
    for tick in range(1200):
        delay_s = tick / 120.0
        link.run(PERIOD_S, delay_s, asks=asks)
        assert link.newest == pytest.approx(delay_s, abs=0.05)


def test_a_jittering_delay_is_seen_message_by_message() -> None:
    link, rng = Link(), np.random.default_rng(2)
    link.run(5.0)
    for _ in range(500):
        delay_s = float(rng.uniform(0.0, 10.0))
        link.run(PERIOD_S, delay_s)
        assert link.newest == pytest.approx(delay_s, abs=0.05)


def test_a_link_that_was_late_from_the_start_is_late_once_questions_are_answered() -> None:
    link = Link()
    link.run(5.0, 2.0)
    assert link.newest < 0.02  # Nothing can tell.
    link.run(5.0, 2.0, asks=True)
    assert link.newest == pytest.approx(1.8, abs=0.05)


def test_late_commands_make_no_position_late() -> None:
    link = Link()
    link.run(5.0, asks=True)
    link.run(60.0, up_s=4.0, asks=True)
    assert link.late == 0


@pytest.mark.parametrize('rate', [1.0 - 100e-6, 1.0 + 100e-6])
def test_a_crystal_that_is_off_makes_nothing_late_in_days(rate: float) -> None:
    link = Link(rate)
    for _ in range(3 * 24):
        link.now_s += 3600.0
        link.boot_s += 3600.0 * rate
        link.run(1.0)
    assert link.late == 0
    link.run(1.0, 0.7)
    assert link.newest > TIMEOUT_S


def test_after_a_pause_everything_is_late_until_a_question_is_answered() -> None:
    link = Link()
    link.run(5.0, asks=True)
    link.pause(3.0)
    link.run(0.05)
    assert link.newest == pytest.approx(3.0, abs=0.05)
    link.run(0.05, asks=True)
    link.run(0.05)
    assert link.newest < 0.05
    link.run(5.0, 2.0, asks=True)  # And the delay of a link is seen as before.
    assert link.newest == pytest.approx(2.0, abs=0.05)


def test_after_a_pause_of_a_simulation_its_own_clock_tells() -> None:
    link = Link()
    link.run(5.0, clock=True)
    link.pause(3.0)
    link.wall_s -= 3.0  # /clock stood still as well.
    link.run(5.0, clock=True)
    assert link.late == 0


@pytest.mark.parametrize('rate', [0.5, 0.9, 3.0, 20.0])
def test_a_simulation_at_another_speed_is_not_late_where_questions_are_answered_and_paused(rate: float) -> None:
    link = Link(rate)
    for _ in range(5):
        link.run(10.0, asks=True)
        link.pause(0.3)
        link.run(0.5, asks=True)
    link.late = 0
    link.run(20.0, asks=True)
    assert link.late == 0


@pytest.mark.parametrize('rate', [2.0, 20.0])
def test_a_fast_simulation_makes_up_for_a_pause(rate: float) -> None:
    link = Link(rate)
    link.run(5.0)
    link.pause(3.0)
    link.run(4.0)
    link.late = 0
    link.run(20.0)
    assert link.late == 0


def test_a_slow_simulation_is_judged_by_its_own_clock() -> None:
    link = Link(0.5)
    for _ in range(200):
        link.run(PERIOD_S, clock=True)
        link.wall_s -= 0.5 * PERIOD_S
    assert link.late == 0


@pytest.mark.parametrize('step_s', [60.0, -60.0, 0.7, -0.7])
def test_a_machine_whose_clock_is_set_makes_nothing_late(step_s: float) -> None:
    """Our clock first, the stamps of the sender half a second later, or never."""
    for follows in (True, False):
        link = Link()
        link.boot_s = WALL_S
        link.run(20.0, clock=True)
        link.wall_s += step_s
        link.run(0.5, clock=True)
        link.boot_s += step_s * follows
        link.run(60.0, clock=True)
        assert link.late == 0
        link.run(10.0, 2.0, clock=True)
        assert link.newest > TIMEOUT_S


def test_a_sender_that_starts_anew_is_late_for_a_second_only() -> None:
    link = Link()
    link.run(5.0)
    link.boot_s = 1.0
    link.run(1.2)
    assert 10 <= link.late <= 22
    link.late = 0
    link.run(60.0)
    assert link.late == 0
    link.run(1.0, 2.0)
    assert link.newest > TIMEOUT_S


def test_an_overtaken_message_is_late_and_no_new_start() -> None:
    link = Link()
    link.run(5.0)
    for _ in range(100):
        link.run(0.2)
        assert link.watch.arrived(round((link.boot_s - 3.0) * NS), link.now_s) > TIMEOUT_S
    assert link.newest < 0.02


def test_one_message_stamped_ahead_makes_nothing_late() -> None:
    link = Link()
    link.run(5.0)
    for ahead_s in (0.9, 5.0, 5.0, 1e6):
        link.watch.arrived(round((link.boot_s + ahead_s) * NS), link.now_s)
        link.run(5.0)
    assert link.late == 0
