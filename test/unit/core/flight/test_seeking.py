"""The velocity law by itself."""

import math

import pytest

from advise_ros.core.flight.velocity_law import Leg, SeekSettings, approach_speed_m_s, brake_distance_m, seek
from advise_ros.core.units import ZERO

SETTINGS = SeekSettings()
EAST = Leg((0.0, 0.0), (2.0, 0.0), 2.0)


def at(east: float, north: float, up: float = 3.0, leg: Leg = EAST, settings: SeekSettings = SETTINGS) -> tuple[float, ...]:
    return seek((east, north, up), ZERO, leg, 3.0, settings)


@pytest.mark.parametrize('distance_m', [0.01, 0.1, 0.5, -0.3])
def test_the_speed_can_be_shed_in_the_distance_left_after_the_reaction_time(distance_m: float) -> None:
    speed = approach_speed_m_s(distance_m, SETTINGS)
    needed = abs(speed) / SETTINGS.approach_gain_1_s + speed * speed / (2 * SETTINGS.braking_m_s2)
    assert needed == pytest.approx(abs(distance_m))
    assert math.copysign(1.0, speed) == math.copysign(1.0, distance_m)


def test_far_away_it_cruises_and_near_a_stop_it_slows() -> None:
    long_leg = Leg((0.0, 0.0), (10.0, 0.0), 10.0)
    far = 10.0 - brake_distance_m(SETTINGS) - 0.1
    assert at(far, 0.0, leg=long_leg) == pytest.approx((SETTINGS.speed_m_s, 0.0, 0.0))
    speeds = [at(10.0 - left, 0.0, leg=long_leg)[0] for left in (1.0, 0.5, 0.2, 0.0)]
    assert speeds == sorted(speeds, reverse=True)
    assert speeds[-1] == pytest.approx(0.0)


def test_a_centre_on_a_straight_run_is_passed_at_speed_and_a_corner_between_that_and_a_stop() -> None:
    ends = (EAST, EAST._replace(corner=True), EAST._replace(corner=True, run_on_m=4.0))
    stop, corner, straight = (at(1.9, 0.0, leg=leg)[0] for leg in ends)
    assert stop < corner < straight == SETTINGS.speed_m_s


def test_it_returns_when_it_went_too_far() -> None:
    assert at(2.5, 0.0)[0] < 0.0


def test_it_steers_back_to_the_line_and_waits_for_that() -> None:
    on, left, right = at(0.5, 0.0), at(0.5, 0.3), at(0.5, -0.3)
    assert left[1] < 0.0 < right[1]
    assert left[0] == right[0] <= on[0]
    far_left = at(0.5, 0.9)
    assert far_left[0] < 0.5 * on[0], 'half a cell aside it nearly stands'


@pytest.mark.parametrize(('up', 'climb'), [(3.0, 0.0), (2.5, 0.4), (3.5, -0.4), (-50.0, 1.0), (50.0, -1.0)])
def test_it_holds_the_altitude_within_the_climb_limit(up: float, climb: float) -> None:
    assert at(0.5, 0.0, up)[2] == pytest.approx(climb)


def test_without_a_line_it_flies_straight_to_the_point_and_stays() -> None:
    here = Leg((2.0, 2.0), (2.0, 2.0), 2.0)
    east, north, _ = at(-1.0, -2.0, leg=here)
    assert east / north == pytest.approx(3.0 / 4.0)
    assert at(2.0, 2.0, leg=here) == ZERO


def test_a_moving_vehicle_is_taken_to_be_further_on() -> None:
    standing = seek((1.5, 0.0, 3.0), ZERO, EAST, 3.0, SETTINGS)
    moving = seek((1.5, 0.0, 3.0), (1.0, 0.0, 0.0), EAST, 3.0, SETTINGS)
    assert moving[0] < standing[0]


@pytest.mark.parametrize('bad', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize('axis', range(3))
def test_what_is_no_number_becomes_a_stop(bad: float, axis: int) -> None:
    broken = [0.5, 0.0, 3.0]
    broken[axis] = bad
    position = (broken[0], broken[1], broken[2])
    assert seek(position, ZERO, EAST, 3.0, SETTINGS) == ZERO
    assert seek((0.5, 0.0, 3.0), position, EAST, 3.0, SETTINGS) == ZERO
    assert seek((0.5, 0.0, 3.0), ZERO, EAST, bad, SETTINGS) == ZERO
