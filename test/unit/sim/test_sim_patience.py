"""Simulated time waits for a companion that is late, but not for ever."""

from __future__ import annotations

from advise_ros.sim.flight import SimulatedFlight
from advise_ros.sim.modes import Mode
from advise_ros.sim.pacing import Pacer, Patience
from advise_ros.sim.setpoints import Setpoint

MS = 1_000_000


def test_time_waits_at_the_lead_and_goes_on_with_a_fresh_setpoint() -> None:
    patience = Patience(0.3)
    assert not patience.waits(0.2, 0)
    assert patience.waits(0.3, 10 * MS)
    assert patience.waits(0.3, 60 * MS)
    assert not patience.waits(0.0, 70 * MS)
    assert patience.waits(0.3, 80 * MS)


def test_no_wait_is_longer_than_three_tenths_of_a_second() -> None:
    patience = Patience(0.3)
    assert patience.waits(0.3, 0)
    assert patience.waits(0.3, 299 * MS)
    assert not patience.waits(0.3, 300 * MS)
    assert not patience.waits(5.0, 301 * MS)


def test_without_a_lead_time_never_waits() -> None:
    assert not Patience(0.0).waits(100.0, 0)


def test_only_a_setpoint_that_moves_the_vehicle_grows_old() -> None:
    flight = SimulatedFlight(mode=Mode.GUIDED)
    assert flight.moving_setpoint_age_s(5.0) == 0.0
    flight.follow(Setpoint(velocity_enu_m_s=(0.0, 0.0, 0.0)), 1.0)
    assert flight.moving_setpoint_age_s(5.0) == 0.0
    flight.follow(Setpoint(velocity_enu_m_s=(1.0, 0.0, 0.0)), 2.0)
    assert flight.moving_setpoint_age_s(5.0) == 3.0
    flight.enter(Mode.LAND)
    assert flight.moving_setpoint_age_s(5.0) == 0.0


def test_time_that_stood_still_is_not_caught_up() -> None:
    pacer = Pacer(10.0, 10 * MS)
    assert pacer.due(0) == 0
    pacer.forgive(100 * MS)
    assert pacer.due(100 * MS) == 0
    assert pacer.due(101 * MS) == 1
