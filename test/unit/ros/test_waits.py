"""What nodes say they wait for at their start."""

from __future__ import annotations

import pytest

from advise_ros.ros.waits import StartWaits


@pytest.mark.parametrize(('status', 'sentence'), [
    ('waiting for positions on /drone1/pose', 'waiting for positions on /drone1/pose: start mavlink_bridge, or guard'),
    ('waiting for a policy on advise/policy', 'waiting for a policy on advise/policy: start advise'),
    ('no pose yet', 'waiting for a pose: start mavlink_bridge'),
    ('waiting for a companion on udpout:a:1', 'waiting for a companion on udpout:a:1: start mavlink_bridge'),
    ('waiting for a satellite fix', 'waiting for a satellite fix'),
])
def test_a_wait_names_what_makes_it(status: str, sentence: str) -> None:
    (said,) = StartWaits().news(status)
    assert said.startswith(sentence)


def test_each_wait_is_said_once_and_so_is_its_end() -> None:
    waits = StartWaits()
    assert len(waits.news('waiting for a policy on advise/policy; no pose yet')) == 2
    assert waits.news('waiting for a policy on advise/policy; no pose yet') == []
    assert waits.news('waiting for a policy on advise/policy') == ['has a pose']
    assert waits.news('policy 3') == ['has a policy on advise/policy']


def test_later_waits_are_no_news() -> None:
    waits = StartWaits()
    waits.news('waiting for cmd_vel')
    waits.news('flying')
    assert waits.news('waiting for cmd_vel') == []


def test_who_has_everything_says_nothing() -> None:
    assert StartWaits().news('recording into session1') == []
