"""Stamps of an autopilot's messages in our clock."""

from __future__ import annotations

from itertools import pairwise

from advise_ros.mavlink.stamps import Stamper

S = 1_000_000_000
MS = 1_000_000


def test_stamps_keep_the_autopilots_spacing_whatever_the_delay() -> None:
    stamper = Stamper(simulated=False)
    delays_ms = (3, 40, 1, 700, 2)
    stamps = [stamper.stamp_ns(5000 + 50 * i, 100 * S + 50 * i * MS + d * MS) for i, d in enumerate(delays_ms)]
    assert [b - a for a, b in pairwise(stamps)] == [50 * MS] * 4
    assert stamps[0] == 100 * S + 3 * MS


def test_a_simulators_time_is_taken_as_it_is() -> None:
    stamper = Stamper(simulated=True)
    assert stamper.stamp_ns(5000, 5 * S + 10 * MS) == 5 * S
    assert stamper.stamp_ns(5100, 5 * S) == 5100 * MS


def test_no_stamp_before_our_clock_begins_or_for_a_repetition() -> None:
    stamper = Stamper(simulated=True)
    assert stamper.stamp_ns(5000, 0) is None
    assert stamper.stamp_ns(5000, 5 * S) == 5 * S
    assert stamper.stamp_ns(5000, 5 * S) is None
    assert stamper.stamp_ns(4990, 5 * S) is None


def test_a_reboot_is_followed_by_stamps_that_still_rise() -> None:
    stamper = Stamper(simulated=False)
    before = stamper.stamp_ns(500_000, 1000 * S)
    stamps = [stamper.stamp_ns(1000 + 50 * i, 1003 * S + 50 * i * MS) for i in range(10)]
    known = [stamp for stamp in stamps if stamp is not None]
    assert before is not None and all(stamp > before for stamp in known)
    assert abs(known[-1] - (1003 * S + 450 * MS)) < S


def test_a_clock_that_is_set_back_is_followed() -> None:
    stamper = Stamper(simulated=False)
    stamper.stamp_ns(1000, 1000 * S)
    stamps = [stamper.stamp_ns(2000 + 50 * i, 500 * S + 50 * i * MS) for i in range(10)]
    assert stamps[-1] is not None and abs(stamps[-1] - (500 * S + 450 * MS)) < S


def test_one_late_message_moves_nothing() -> None:
    stamper = Stamper(simulated=False)
    stamper.stamp_ns(1000, 1000 * S)
    assert stamper.stamp_ns(2000, 1009 * S) == 1001 * S
    assert stamper.stamp_ns(3000, 1002 * S) == 1002 * S


def test_clocks_of_different_speeds_show_in_the_count_of_new_offsets() -> None:
    fast, slow = Stamper(simulated=False), Stamper(simulated=False)
    for i in range(200):
        fast.stamp_ns(1000 + 1000 * i, 1000 * S + 50 * i * MS)
        slow.stamp_ns(1000 + 50 * i, 1000 * S + 50 * i * MS)
    assert fast.refixed > 10
    assert slow.refixed == 0


def test_two_good_clocks_that_drift_apart_over_days_are_no_clocks_of_different_speeds() -> None:
    drifting = Stamper(simulated=False)
    counts = []
    for minute in range(5 * 24 * 60):  # 50 ppm: a second in five and a half hours.
        boot_ms = 60_000 * minute
        counts.append(drifting.refixed)
        for i in range(6):
            drifting.stamp_ns(boot_ms + i, 1000 * S + round(boot_ms * MS * (1 + 50e-6)) + i * MS)
    assert max(counts) == 1
    assert counts[-1] == 0
