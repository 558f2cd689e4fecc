"""Each change is logged once, without flicker."""

from __future__ import annotations

import pytest

from advise_ros.ros.change_log import ChangeLog


class Lines:
    """A mock of a node's logger."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def info(self, message: str) -> None:
        self.lines.append(f'INFO {message}')

    def warning(self, message: str) -> None:
        self.lines.append(f'WARN {message}')


@pytest.fixture
def lines() -> Lines:
    return Lines()


def test_a_condition_is_logged_when_it_begins_and_when_it_is_over(lines: Lines) -> None:
    log = ChangeLog(lines)
    for tick in range(100):
        log.note('doubt', f'pose older than {tick / 20:.1f} s' if 20 <= tick <= 60 else '', tick * 0.05)
    assert lines.lines == ['WARN pose older than 1.0 s', 'INFO doubt is over after 2.0 s']


def test_what_flickers_is_one_condition(lines: Lines) -> None:
    log = ChangeLog(lines)
    for tick in range(200):
        log.note('limited', 'speed limited to 3 m/s' if tick % 7 == 0 else '', tick * 0.05)
    assert lines.lines == ['WARN speed limited to 3 m/s']


def test_another_reason_is_logged_once(lines: Lines) -> None:
    log = ChangeLog(lines)
    for tick in range(50):
        log.note('doubt', 'pose: no fix' if tick % 2 else 'pose: it jumped 3 m', tick * 0.05)
    assert lines.lines == ['WARN pose: it jumped 3 m', 'WARN pose: no fix']


def test_what_is_normal_when_short_is_logged_only_when_it_lasts(lines: Lines) -> None:
    log = ChangeLog(lines)
    for tick in range(400):
        log.note('limited', 'fence ahead' if tick < 20 or tick > 200 else '', tick * 0.05, lasting_s=2.0, calm=True)
    assert lines.lines == ['INFO fence ahead']


def test_something_of_one_moment_is_logged_when_it_differs(lines: Lines) -> None:
    log = ChangeLog(lines)
    for sentence in ('the vehicle is ours', 'the vehicle is ours', '', 'the link is lost', 'the vehicle is ours'):
        log.now('owner', sentence)
    assert lines.lines == ['INFO the vehicle is ours', 'INFO the link is lost', 'INFO the vehicle is ours']
