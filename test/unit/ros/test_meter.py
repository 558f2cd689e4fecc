"""Rates and ages on /diagnostics."""

from __future__ import annotations

from advise_ros.ros.diagnostics import Meter


def test_rate_and_age() -> None:
    meter = Meter(10.0)
    assert meter.values('pose', 10.5) == {'pose rate (Hz)': '0.0', 'pose age (s)': 'never'}
    for tick in range(20):
        meter.tick(10.05 + 0.1 * tick)
    assert meter.values('pose', 12.0) == {'pose rate (Hz)': '10.0', 'pose age (s)': '0.05'}
    assert meter.values('pose', 12.5) == {'pose rate (Hz)': '10.0', 'pose age (s)': '0.55'}
    assert meter.values('pose', 13.0) == {'pose rate (Hz)': '0.0', 'pose age (s)': '1.05'}
