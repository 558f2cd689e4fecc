"""The late link of the tests is late as it says, in each direction by itself, and never loses or reorders."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from support.delays import Delay, Queue, growing, jittering, stalling, steady
from support.lossy_proxy import LossyProxy


def arrivals(delay: Delay, seconds: float = 30.0) -> np.ndarray:
    """Delays of what is sent at 20 Hz."""
    queue, sent = Queue(delay, 0.0), np.arange(0.0, seconds, 0.05)
    due = np.array([queue.due_s(float(now_s)) for now_s in sent])
    assert (np.diff(due) >= 0.0).all()
    return due - sent


def test_a_steady_delay_is_the_same_from_the_first_on():
    assert arrivals(steady(2.0)) == pytest.approx(2.0)


def test_a_growing_delay_grows_to_its_most():
    late = arrivals(growing(0.1, 2.0))
    assert late[0] == 0.0
    assert late[100] == pytest.approx(0.5)
    assert late[-1] == pytest.approx(2.0)


def test_a_jittering_delay_stays_within_its_range_and_in_order():
    late = arrivals(jittering(0.2, 0.5, np.random.default_rng(0)))
    assert 0.2 <= late.min() < 0.4 < late.max() <= 0.7


def test_a_stalling_relay_lets_nothing_through_and_then_all_at_once():
    queue, sent = Queue(stalling(5.0, 2.0), 0.0), np.arange(0.0, 20.0, 0.05)
    due = np.array([queue.due_s(float(now_s)) for now_s in sent])
    assert np.diff(np.unique(due)).max() == pytest.approx(2.0, abs=0.06)
    assert np.unique(due, return_counts=True)[1].max() >= 40


def test_changing_the_delay_keeps_the_order():
    queue = Queue(steady(5.0), 0.0)
    assert queue.due_s(0.0) == 5.0
    queue = queue.changed(steady(0.0), 1.0)
    assert queue.due_s(1.0) == 5.0
    assert queue.due_s(6.0) == 6.0


@pytest.fixture
def companion() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(('127.0.0.1', 0))
        sock.settimeout(10)
        yield sock


def test_the_proxy_is_late_in_one_direction_and_prompt_in_the_other(companion):
    heard: list[tuple[str, float]] = []
    proxy = LossyProxy(companion.getsockname()[1], np.random.default_rng(0), lambda way, _, at_s: heard.append((way, at_s)))
    beat = mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 3, 3).pack(mavlink.MAVLink(None, 1, 1))
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
            vehicle.settimeout(10)
            proxy.delay('up', steady(0.4))
            vehicle.sendto(beat, ('127.0.0.1', proxy.port))
            vehicle.sendto(beat, ('127.0.0.1', proxy.port))
            _, address = companion.recvfrom(4096)
            companion.recvfrom(4096)
            assert proxy.latest_s['up'] >= 0.4
            companion.sendto(beat, address)
            vehicle.recvfrom(4096)
            assert proxy.latest_s['down'] < proxy.latest_s['up']
            assert [way for way, _ in heard] == ['up', 'up', 'down']
    finally:
        proxy.close()
