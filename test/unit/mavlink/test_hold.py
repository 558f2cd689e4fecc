"""What stands instead of zero velocity: places of a PX4, and never one that is doubted."""

from __future__ import annotations

import math
from typing import Any

import pytest

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.hold import FORGET_S, FURTHEST_M, NO_PLACE, SLOW_M_S, STIFFER, STOP_S, STOPPED_S, Hold
from advise_ros.mavlink.messages import dialect
from advise_ros.mavlink.requests import Goal
from advise_ros.mavlink.vehicle import FRESH_S, Motion
from support.companion_flight import Flight
from support.scripted import ScriptedCopter
from support.scripted_px4 import LAND, ScriptedPx4

ZERO = (0.0, 0.0, 0.0)
VELOCITY, PLACE, HEIGHT = 0x05C7, 0x0DF8, 0x0DE3


def motion(velocity: tuple[float, float, float] = ZERO, at: tuple[float, float, float] = (3.0, 4.0, 5.0)) -> Motion:
    return Motion(1000, at, velocity, 100.0)


def test_the_place_is_where_it_will_have_stopped_and_stays_it() -> None:
    hold = Hold()
    ahead = 3.0 + STOP_S, 4.0 - 0.5 * STOP_S, 5.0 + 0.2 * STOP_S
    assert hold.wanted(ZERO, motion((1.0, -0.5, 0.2)), 100.0).place_enu_m == pytest.approx(ahead)
    assert hold.wanted(ZERO, motion(at=(3.5, 3.9, 5.0)), 100.1).place_enu_m == pytest.approx(ahead)


def test_a_fast_vehicle_is_braked_before_it_is_given_a_place() -> None:
    hold = Hold()
    assert hold.wanted(ZERO, motion((SLOW_M_S + 0.1, 0.0, 0.0)), 100.0).place_enu_m[:2] == (None, None)
    east_m, north_m, _ = hold.wanted(ZERO, motion((SLOW_M_S - 0.1, 0.0, 0.0)), 100.1).place_enu_m
    assert (east_m, north_m) == pytest.approx((3.0 + STOP_S * (SLOW_M_S - 0.1), 4.0))


def test_what_moves_is_asked_for_as_velocity_and_what_stands_as_place() -> None:
    hold = Hold()
    assert hold.wanted((1.0, 0.0, 0.3), motion(), 100.0) == (NO_PLACE, (1.0, 0.0, 0.3))
    assert hold.wanted((1.0, 0.0, 0.0), motion(), 100.1) == ((None, None, 5.0), (1.0, 0.0, 0.0))
    climbing = hold.wanted((0.0, 0.0, 0.5), motion(at=(3.2, 4.0, 5.1)), 100.2)
    assert climbing.place_enu_m == pytest.approx((3.2, 4.0, 5.6))
    assert hold.wanted((0.0, 0.0, 0.5), motion(at=(3.1, 4.2, 5.3)), 100.3).place_enu_m == pytest.approx((3.2, 4.0, 5.8))


def test_a_doubt_ends_a_place_and_the_next_one_is_new() -> None:
    hold = Hold()
    hold.wanted(ZERO, motion(), 100.0)
    assert hold.wanted(ZERO, None, 100.1) == (NO_PLACE, ZERO)
    assert hold.wanted(ZERO, motion(at=(9.0, 9.0, 5.0)), 100.2).place_enu_m == (9.0, 9.0, 5.0)


def test_a_vehicle_that_stands_is_held_stiffly_where_the_link_is_prompt() -> None:
    off = motion(at=(3.1, 4.0, 4.0))
    for prompt, place in ((True, (3.0 - STIFFER * 0.1, 4.0, 5.0 + FURTHEST_M)), (False, (3.0, 4.0, 5.0))):
        hold = Hold()
        for tick in range(round(STOPPED_S / 0.05)):
            assert hold.wanted(ZERO, motion(), 100.0 + 0.05 * tick, prompt=prompt).place_enu_m == (3.0, 4.0, 5.0)
        assert hold.wanted(ZERO, off, 100.0 + STOPPED_S, prompt=prompt).place_enu_m == pytest.approx(place)


def test_a_place_of_another_time_is_forgotten() -> None:
    hold = Hold()
    hold.wanted(ZERO, motion(), 100.0)
    assert hold.wanted(ZERO, motion(at=(9.0, 9.0, 5.0)), 100.0 + FORGET_S + 0.1).place_enu_m == (9.0, 9.0, 5.0)


@pytest.mark.parametrize('yaw_rate', [0.0, 0.4])
def test_setpoints_hold_no_nan_and_ignore_what_they_do_not_ask(yaw_rate: float) -> None:
    for place, mask in (((None, None, 5.0), HEIGHT), ((1.0, 2.0, 5.0), PLACE)):
        message = mav.place_setpoint((1, 1), 1000, place, (0.5, 0.25, 0.0), yaw_rate)
        names = ('x', 'y', 'z', 'vx', 'vy', 'vz', 'afx', 'afy', 'afz', 'yaw', 'yaw_rate')
        fields = {name: getattr(message, name) for name in names}
        assert all(map(math.isfinite, fields.values()))
        assert message.type_mask == (mask if yaw_rate == 0.0 else mask & ~0x800)
        assert (fields['z'], fields['yaw_rate']) == (-5.0, -yaw_rate)
        assert (fields['x'], fields['y']) == ((2.0, 1.0) if mask == PLACE else (0.0, 0.0))
        assert (fields['vx'], fields['vy']) == ((0.0, 0.0) if mask == PLACE else (0.25, 0.5))


class Commanded(Flight):
    """A flight whose owner sends what is wanted, as the bridge's timer does."""

    velocity: tuple[float, float, float] = ZERO
    doubt = ''

    def tick(self) -> None:
        super().tick()
        setpoint = self.companion.setpoint(self.velocity, 0.0, self.now_s, self.doubt)
        if setpoint is not None and not self.cut:
            self.copter.receive(setpoint)

    @property
    def at(self) -> tuple[float, ...]:
        return tuple(self.copter.position_ned)


def estimator_status(flags: int) -> Any:
    return dialect.MAVLink_estimator_status_message(0, flags, 0.1, 0.1, 0.1, 0.1, 0.0, 0.0, 0.3, 0.3)


def flying(**px4: Any) -> Commanded:
    flight = Commanded(ScriptedPx4(**px4))
    flight.fly()
    return flight


def test_a_px4_that_wanders_at_zero_velocity_climbs_and_stands_over_where_it_stood() -> None:
    flight = flying(drift_ned=(0.3, -0.2, 0.05))
    assert math.dist(flight.at[:2], (0.0, 0.0)) < 0.05
    before = flight.at
    flight.run(60.0)
    assert math.dist(flight.at, before) < 0.35


def test_after_flying_it_stands_and_flies_on_by_velocity() -> None:
    flight = flying(drift_ned=(0.1, 0.0, 0.0))
    flight.velocity = (1.0, 0.0, 0.0)
    flight.run(5.0)
    assert flight.copter.setpoints[-1].type_mask == HEIGHT
    flight.velocity = ZERO
    flight.run(3.0)
    assert flight.copter.setpoints[-1].type_mask == PLACE
    before = flight.at
    flight.run(60.0)
    assert math.dist(flight.at, before) < 0.1
    flight.velocity = (0.0, 1.0, 0.2)
    flight.run(1.0)
    assert flight.copter.setpoints[-1].type_mask == VELOCITY


def test_a_doubted_or_old_position_is_no_place() -> None:
    flight = flying()
    flight.doubt = 'late'
    flight.run(0.2)
    assert flight.copter.setpoints[-1].type_mask == VELOCITY
    flight.doubt = ''
    flight.deliver([estimator_status(0x365)])
    flight.run(0.2)
    assert flight.copter.setpoints[-1].type_mask == VELOCITY
    flight.deliver([estimator_status(0x37F)])
    flight.run(0.2)
    assert flight.copter.setpoints[-1].type_mask == PLACE
    flight.copter.silent.add(mav.LOCAL_POSITION_NED)
    flight.run(FRESH_S + 0.2)
    assert flight.copter.setpoints[-1].type_mask == VELOCITY


def test_a_climb_without_a_trusted_position_is_one_by_velocity() -> None:
    flight = Commanded(ScriptedPx4())
    flight.until(lambda: flight.status.ready)
    flight.deliver([estimator_status(0x365)])
    flight.ask(Goal.TAKEOFF)
    flight.until(lambda: flight.copter.altitude_m > 1.0)
    assert flight.companion.vehicle.doubt == 'the estimator has no position (flags 0x365)'
    assert {message.type_mask for message in flight.copter.setpoints} == {VELOCITY}


def test_an_ardupilot_is_never_given_a_place_and_stands_before_the_first_command() -> None:
    flight = Commanded(ScriptedCopter())
    flight.fly()
    flight.run(5.0)
    flight.velocity = (1.0, 0.0, 0.0)
    flight.run(2.0)
    flight.velocity = ZERO
    flight.run(5.0)
    assert {message.type_mask for message in flight.copter.setpoints} == {VELOCITY}
    assert flight.copter.setpoints[0].vx == 0.0


def test_leaving_and_resting_send_no_old_place() -> None:
    flight = flying(drift_ned=(0.1, 0.0, 0.0))
    flight.velocity = (0.5, 0.0, 0.0)
    flight.run(4.0)
    farewell = flight.companion.farewell(flight.now_s)
    place = farewell[0]
    assert place.type_mask == PLACE
    assert math.dist((place.x, place.y), flight.at[:2]) < 0.5 * STOP_S + 0.1
    flight.companion.rest('inactive', flight.now_s)
    assert flight.companion.setpoint(ZERO, 0.0, flight.now_s) is None
    flight.ask(Goal.LAND)
    flight.until(lambda: flight.copter.mode == LAND)


def test_what_is_not_finite_becomes_a_place_to_stand_at() -> None:
    flight = flying()
    setpoint = flight.companion.setpoint((math.nan, 0.0, 0.0), math.inf, flight.now_s)
    assert isinstance(setpoint, dialect.MAVLink_set_position_target_local_ned_message)
    assert setpoint.type_mask == PLACE
