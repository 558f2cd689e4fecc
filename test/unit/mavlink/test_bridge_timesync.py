"""The way there and back, by TIMESYNC."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from advise_ros.mavlink.messages import dialect
from advise_ros.mavlink.timesync import ASK_S, OPEN, RECENT_S, SILENT_S, Timesync

NS = 1_000_000_000


class Answering:
    """An autopilot whose clock is `ahead_s` ahead of ours, and the ways to it and back."""

    def __init__(self, ahead_s: float = 40.0) -> None:
        self.timesync = Timesync()
        self.now_s, self.ahead_s = 100.0, ahead_s
        self.up_s = self.down_s = 0.002
        self.lost = lambda: False
        self._under_way: list[tuple[float, Any]] = []

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.01)):
            self.now_s += 0.01
            for message in self.timesync.due(self.now_s):
                if not message.tc1 and not self.lost():
                    there_s = self.now_s + self.up_s
                    reply = dialect.MAVLink_timesync_message(round((there_s + self.ahead_s) * NS), message.ts1)
                    self._under_way.append((there_s + self.down_s, reply))
            for at_s, reply in [entry for entry in self._under_way if entry[0] <= self.now_s]:
                self.timesync.take(reply, at_s)
                self._under_way.remove((at_s, reply))

    @property
    def round_trip_s(self) -> float | None:
        return self.timesync.round_trip_s(self.now_s)


def test_nothing_is_known_before_the_first_answer() -> None:
    link = Answering()
    assert link.round_trip_s is None
    link.lost = lambda: True
    link.run(60.0)
    assert link.round_trip_s is None
    assert len(link.timesync._open) == OPEN


@pytest.mark.parametrize(('up_s', 'down_s'), [(0.002, 0.002), (2.0, 0.002), (0.002, 2.0), (3.0, 2.0)])
def test_a_steady_delay_in_either_direction_is_seen_whole(up_s: float, down_s: float) -> None:
    link = Answering()
    link.up_s, link.down_s = up_s, down_s
    link.run(12.0)
    assert link.round_trip_s == pytest.approx(up_s + down_s, abs=ASK_S)
    bounds = link.timesync.bounds
    assert bounds is not None and bounds.low_s <= -link.ahead_s <= bounds.high_s


def test_a_delay_that_sets_in_is_seen_before_its_first_answer() -> None:
    link = Answering()
    link.run(5.0)
    link.up_s = 5.0
    link.run(3.0)
    assert link.round_trip_s == pytest.approx(3.0, abs=2 * ASK_S)
    link.run(10.0)
    assert link.round_trip_s == pytest.approx(5.0, abs=ASK_S)
    link.up_s = 0.002
    link.run(5.0 + RECENT_S + ASK_S)
    assert link.round_trip_s == pytest.approx(0.004, abs=0.001)


def test_losses_alone_are_seldom_taken_for_delay() -> None:
    rng = np.random.default_rng(1)
    link = Answering()
    link.run(5.0)
    link.lost = lambda: bool(rng.random() < 0.51)
    late = 0
    for _ in range(600):
        link.run(0.5)
        late += (link.round_trip_s or 0.0) >= SILENT_S
    assert late < 600 * 0.05


def test_its_questions_are_answered_in_our_time_at_once() -> None:
    timesync = Timesync()
    timesync.due(100.0)
    timesync.take(dialect.MAVLink_timesync_message(0, 123_456), 100.01)
    (answer,) = timesync.due(100.02)
    assert (answer.tc1, answer.ts1) == (round(100.01 * NS), 123_456)


def test_answers_that_nobody_asked_for_are_ignored() -> None:
    timesync = Timesync()
    (question,) = timesync.due(100.0)
    timesync.take(dialect.MAVLink_timesync_message(7, question.ts1 + 1), 100.01)
    assert timesync.round_trip_s(100.02) is None
    timesync.take(dialect.MAVLink_timesync_message(7, question.ts1), 100.01)
    timesync.take(dialect.MAVLink_timesync_message(7, question.ts1), 109.0)  # A repetition.
    assert timesync.round_trip_s(100.02) == pytest.approx(0.01)


def test_a_flood_of_questions_is_not_kept() -> None:
    timesync = Timesync()
    for number in range(1000):
        timesync.take(dialect.MAVLink_timesync_message(0, number + 1), 100.0)
    assert len(timesync.due(100.0)) < 20
