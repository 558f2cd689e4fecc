"""Doubts of an autopilot's position, with their names."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from advise_ros.mavlink.estimator import FACT_S, SETTLED_S, Estimator
from advise_ros.mavlink.messages import dialect
from advise_ros.mavlink.vehicle import Motion
from advise_ros.sim.arducopter import ArduCopter
from advise_ros.sim.px4 import SimulatedPx4
from support.promises import standing

METRES_E7 = 1e7 / 111_319.0


def ekf(flags: int = 0x33F, velocity: float = 0.05, position: float = 0.03) -> Any:
    return dialect.MAVLink_ekf_status_report_message(flags, velocity, position, 0.04, 0.02, 0.0, 0.0)


def px4_status(flags: int = 0x37F, position: float = 0.1) -> Any:
    return dialect.MAVLink_estimator_status_message(0, flags, 0.1, position, 0.1, 0.1, 0.0, 0.0, 0.3, 0.3)


def gps(north_m: float = 0.0, east_m: float = 0.0, fix: int = 3, accuracy_m: float = 0.3) -> Any:
    return dialect.MAVLink_gps_raw_int_message(
        0, fix, round(north_m * METRES_E7), round(east_m * METRES_E7), 0, 100, 100, 0, 0, 10, 0, round(1000 * accuracy_m))


def odometry(counter: int) -> Any:
    zeros = [0.0] * 21
    return dialect.MAVLink_odometry_message(
        0, 1, 1, 0.0, 0.0, 0.0, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, zeros, zeros, counter, 0, 0)


class Heard:
    """An estimator that hears reports four times a second and positions twenty times."""

    def __init__(self) -> None:
        self.estimator, self.now_s = Estimator(), 100.0
        self.at: Callable[[float], tuple[float, float, float]] = lambda t: (0.0, 0.0, 5.0)
        self.velocity = (0.0, 0.0, 0.0)
        self.estimator.take(dialect.MAVLink_extended_sys_state_message(0, 2), self.now_s)

    def run(self, seconds: float, *messages: Any) -> str:
        for tick in range(round(seconds / 0.05)):
            self.now_s += 0.05
            motion = Motion(round(self.now_s * 1000), self.at(self.now_s), self.velocity, self.now_s)
            self.estimator.moved(motion)
            if tick % 5 == 4:
                for message in messages:
                    self.estimator.take(message, self.now_s)
        return self.estimator.doubt(self.now_s)


@pytest.mark.parametrize(('good', 'bad', 'words'), [
    (ekf(), ekf(flags=0x025), 'the estimator has no position (flags 0x25)'),
    (ekf(), ekf(flags=0x8027), 'the estimator has no position (flags 0x8027)'),
    (ekf(), ekf(flags=0x833F), 'the estimator takes the GPS for faulty (flags 0x833f)'),
    (ekf(), ekf(position=1.5), 'the estimator rejects what it measures (horizontal position 1.5 of 1)'),
    (px4_status(), px4_status(flags=0x365), 'the estimator has no position (flags 0x365)'),
    (px4_status(), px4_status(position=2.0), 'the estimator rejects what it measures (horizontal position 2.0 of 1)'),
    (gps(), gps(fix=1), 'the GPS fix is lost (type 1)'),
    (gps(), gps(north_m=5.5), 'the GPS is 5.5 m off the position'),
])
def test_each_bad_report_is_a_doubt_with_its_name_for_as_long_as_it_lasts(good: Any, bad: Any, words: str) -> None:
    heard = Heard()
    assert heard.run(10.0, good) == ''
    assert words in heard.run(0.6, bad)
    assert words in heard.run(20.0, bad)
    assert heard.run(1.0, good) == ''
    assert words in heard.run(0.6, bad)
    assert heard.run(FACT_S + 0.5) == '', 'who says nothing any more has no doubt'


def test_px4_stands_still_on_the_ground_and_makes_up_a_place_in_the_air() -> None:
    heard = Heard()
    heard.estimator.take(dialect.MAVLink_extended_sys_state_message(0, 1), heard.now_s)
    assert heard.run(5.0, px4_status(flags=0x3FF)) == ''
    heard.estimator.take(dialect.MAVLink_extended_sys_state_message(0, 2), heard.now_s)
    assert heard.run(1.0, px4_status(flags=0x3FF)) == 'the estimator has no position (flags 0x3ff)'


def test_a_single_spike_of_a_ratio_is_no_doubt() -> None:
    heard = Heard()
    heard.run(2.0, ekf())
    assert heard.run(0.25, ekf(position=3.0)) == ''
    assert heard.run(0.25, ekf()) == ''


def test_a_vehicle_without_satellites_from_the_begin_lacks_nothing() -> None:
    assert Heard().run(5.0, gps(fix=1), px4_status(flags=0x36F)) == ''


def test_gps_noise_within_its_accuracy_is_no_doubt_and_a_shift_beyond_it_is() -> None:
    heard, rng = Heard(), np.random.default_rng(2)
    for _ in range(500):
        north, east = rng.normal(0.0, 0.8, 2)
        assert heard.run(0.25, gps(float(north), float(east), accuracy_m=1.2)) == ''
    assert 'm off the position' in heard.run(1.0, gps(north_m=11.0, accuracy_m=1.2))


def test_a_reset_that_is_counted_is_a_doubt_for_a_while() -> None:
    heard = Heard()
    assert heard.run(2.0, odometry(3)) == ''
    assert heard.run(0.3, odometry(4)) == 'the estimator was reset (number 4)'
    assert heard.run(SETTLED_S, odometry(4)) == ''


@pytest.mark.parametrize('seconds', [0.0, 0.5])
def test_positions_that_no_velocity_explains_are_a_doubt(seconds: float) -> None:
    heard = Heard()
    heard.run(2.0)
    begun = heard.now_s
    heard.at = lambda t: (6.0 * min(1.0, (t - begun) / seconds) if seconds else 6.0, 0.0, 5.0)
    heard.run(0.5)
    assert 'that its velocity does not explain' in heard.estimator.doubt(heard.now_s)
    assert heard.run(1.0 + SETTLED_S + 0.1) == ''


@pytest.mark.parametrize('rate_hz', [1.0, 4.0, 20.0, 50.0])
def test_wild_flying_is_no_jump_at_any_rate(rate_hz: float) -> None:
    estimator = Estimator()
    for n in range(round(600 * rate_hz)):
        t = n / rate_hz
        at = 3.0 * math.sin(t), 2.0 * math.sin(0.9 * t), 5.0 + math.sin(0.5 * t)
        velocity = 3.0 * math.cos(t), 1.8 * math.cos(0.9 * t), 0.5 * math.cos(0.5 * t)
        estimator.moved(Motion(round(1000 * t), at, velocity, t))
        assert estimator.doubt(t) == ''


def test_an_ardupilot_stands_through_a_shift_that_it_believes_after_ten_seconds() -> None:
    rng = np.random.default_rng(4)
    flight = standing.take_off('ardupilot', rng)
    assert flight.companion.vehicle.doubt == ''
    noticed_s, moved_m = standing.shift(flight, rng)
    assert noticed_s <= standing.NOTICED_LIMIT_S
    assert moved_m <= standing.MOVED_LIMIT_M
    assert flight.companion.vehicle.doubt == ''
    assert flight.velocity != (0.0, 0.0, 0.0), 'it flies on afterwards'


@pytest.mark.parametrize('autopilot', [ArduCopter, SimulatedPx4])
def test_a_normal_flight_is_never_doubted(autopilot: type[Any]) -> None:
    name = {ArduCopter: 'ardupilot', SimulatedPx4: 'px4'}[autopilot]
    rng = np.random.default_rng(6)
    flight, told = standing.take_off(name, rng), set()
    for _ in range(6):
        angle = float(rng.uniform(-math.pi, math.pi))
        for wish in ((2.0 * math.cos(angle), 2.0 * math.sin(angle), 0.2), None, (0.0, 0.0, -0.4)):
            flight.wish = wish
            for _ in range(50):
                flight.tick()
                told.add(flight.companion.vehicle.doubt)
    assert told == {''}


def test_a_px4_hovers_within_half_a_metre_of_where_it_stopped() -> None:
    rng = np.random.default_rng(8)
    assert standing.hover(standing.take_off('px4', rng), rng) <= standing.HOVER_LIMIT_M['px4']
