"""Laws of the simulator: pacing never changes a flight, nothing on the wire can break it, frames agree."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.config import SimulatorConfig
from advise_ros.mavlink import frames
from advise_ros.mavlink.framing import Framer
from advise_ros.sim import setpoints
from advise_ros.sim.arducopter import ArduCopter
from advise_ros.sim.pacing import Pacer
from advise_ros.sim.setpoints import Setpoint

STEP_NS = 25_000_000
ANY_FLOAT = st.floats(width=32, allow_nan=True, allow_infinity=True)
# Simulated second -> velocity; the last one comes after the timeout of the one before.
SCRIPT = ((9.5, (1.2, 0.0, 0.0)), (11.0, (0.0, -1.0, 0.3)), (12.0, (0.0, 0.0, 0.0)), (15.5, (-0.5, 0.5, -0.2)))


def airborne(seed: int = 5) -> ArduCopter:
    config = SimulatorConfig(ready_after_s=0.0, gust_m_s=1.0, wind_east_m_s=2.0)
    autopilot = ArduCopter(config, np.random.default_rng(seed))
    autopilot.vehicle.set_mode(4)
    autopilot.vehicle.arm()
    autopilot.vehicle.take_off(5.0)
    return autopilot


def flown(steady_times_ns: list[int], speedup: float, ticks: int) -> np.ndarray:
    """The scripted flight with ticks done whenever the pacer says so; position and velocity at each tick."""
    autopilot, pacer, track = airborne(), Pacer(speedup, STEP_NS), []
    script = list(SCRIPT)
    for now_ns in steady_times_ns:
        for _ in range(pacer.due(now_ns)):
            vehicle = autopilot.vehicle
            while script and vehicle.now_s >= script[0][0]:
                vehicle.follow(Setpoint(velocity_enu_m_s=script.pop(0)[1]))
            autopilot.step()
            pacer.did(1)
            track.append(np.concatenate([vehicle.state.position_enu_m, vehicle.state.velocity_enu_m_s]))
            if len(track) == ticks:
                return np.array(track)
    raise AssertionError('the pacer gave too few ticks')


@settings(max_examples=4, deadline=None)
@given(speedup=st.sampled_from([0.0, 1.0, 13.7, 20.0, 500.0]), gaps_ms=st.lists(st.integers(1, 400), min_size=5, max_size=20))
def test_the_same_setpoints_at_the_same_simulated_times_give_the_same_flight_at_every_speed(speedup, gaps_ms):
    ticks = 680
    even = [i * 5_000_000 for i in range(4000)]
    uneven = np.cumsum(np.resize(gaps_ms, 4000)).astype(np.int64) * 1_000_000
    reference = flown(even, 1.0, ticks)
    assert np.array_equal(flown([int(t) for t in uneven], speedup, ticks), reference)
    assert reference[-1, 2] > 3.0


@example(start=0, gaps_ns=[200_000_000, 200_000_000, 0], speedup=0.0625)  # A tick takes longer than the debt that is kept.
@example(start=0, gaps_ns=[200_000_000] * 50, speedup=0.15)
@settings(max_examples=200, deadline=None)
@given(
    start=st.integers(0, 10**12), gaps_ns=st.lists(st.integers(0, 200_000_000), min_size=1, max_size=50),
    speedup=st.floats(0.05, 1000.0),
)
def test_a_pacer_that_is_kept_up_with_never_loses_or_invents_time(start, gaps_ns, speedup):
    pacer, now, done = Pacer(speedup, STEP_NS), start, 0
    pacer.due(now)
    for gap in gaps_ns:
        now += gap
        due = pacer.due(now)
        assert due >= 0
        pacer.did(due)
        done += due
        assert abs(done - (now - start) * speedup / STEP_NS) <= 1.0 + 1e-6 * done


@settings(max_examples=100, deadline=None)
@given(mask=st.integers(0, 0xFFFF), frame=st.integers(0, 255), values=st.lists(ANY_FLOAT, min_size=11, max_size=11))
def test_no_setpoint_makes_a_state_that_is_not_finite(mask, frame, values):
    autopilot = ArduCopter(SimulatorConfig(ready_after_s=0.0), np.random.default_rng(0))
    autopilot.vehicle.set_mode(4)
    autopilot.vehicle.arm()
    autopilot.vehicle.airborne = True
    message = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *values)
    decoded = setpoints.decode(message, (1.0, 2.0, 3.0), 0.5)
    yaw = (decoded.yaw_enu_rad or 0.0, decoded.yaw_rate_enu_rad_s)
    assert all(map(math.isfinite, (*(decoded.position_enu_m or ()), *(decoded.velocity_enu_m_s or ()), *yaw)))
    assert autopilot.receive(message) == []
    for _ in range(6):
        autopilot.step()
    assert all(np.isfinite(part).all() for part in autopilot.vehicle.state.body.values())


@settings(max_examples=200, deadline=None)
@given(number=st.integers(0, 0xFFFF), params=st.lists(ANY_FLOAT, min_size=7, max_size=7))
def test_every_command_gets_one_ack_whatever_its_parameters(number, params):
    autopilot = ArduCopter(SimulatorConfig(ready_after_s=0.0), np.random.default_rng(0))
    replies = autopilot.receive(_from(mavlink.MAVLink_command_long_message(1, 1, number, 0, *params)))
    assert [reply.command for reply in replies if reply.get_type() == 'COMMAND_ACK'] == [number]
    autopilot.step()


@settings(max_examples=100, deadline=None)
@given(garbage=st.binary(max_size=400), flips=st.lists(st.tuples(st.integers(0, 60), st.integers(0, 255)), max_size=3))
def test_garbage_and_bent_frames_never_stop_it(garbage, flips):
    autopilot = ArduCopter(SimulatorConfig(ready_after_s=0.0), np.random.default_rng(0))
    bent = bytearray(mavlink.MAVLink_command_long_message(1, 1, 400, 0, *[1.0] * 7).pack(mavlink.MAVLink(None, 9, 9)))
    for at, value in flips:
        bent[at % len(bent)] = value
    for message in Framer().datagram(garbage + bytes(bent) + garbage):
        autopilot.receive(message)
    autopilot.step()


@given(velocity=st.tuples(*[st.floats(-20, 20, width=32)] * 3), yaw_enu=st.floats(-3.1, 3.1))
def test_body_and_local_frames_agree(velocity, yaw_enu):
    """The same motion told in the body's frame and in NED is the same setpoint."""
    forward, right, down = velocity
    yaw_ned = frames.yaw_enu_from_ned(yaw_enu)
    north = forward * math.cos(yaw_ned) - right * math.sin(yaw_ned)
    east = forward * math.sin(yaw_ned) + right * math.cos(yaw_ned)
    body = setpoints.decode(_velocity(8, forward, right, down), (0.0, 0.0, 0.0), yaw_enu)
    local = setpoints.decode(_velocity(1, north, east, down), (0.0, 0.0, 0.0), yaw_enu)
    assert body.velocity_enu_m_s is not None
    assert local.velocity_enu_m_s is not None
    np.testing.assert_allclose(body.velocity_enu_m_s, local.velocity_enu_m_s, atol=1e-6)


def _velocity(frame: int, *velocity: float) -> Any:
    return mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, 0x05C7, 0, 0, 0, *velocity, 0, 0, 0, 0, 0)


def _from(message: Any) -> Any:
    """As received from a companion."""
    wire = mavlink.MAVLink(None, srcSystem=1, srcComponent=191)
    return wire.decode(bytearray(message.pack(wire)))
