"""Whose the vehicle is by the setpoints that it follows, against the simulator over good and bad links; CURRENT_MODE."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import development

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.current_mode import CurrentMode
from advise_ros.mavlink.requests import Goal
from advise_ros.mavlink.setpoint_watch import SetpointWatch
from support.companion_flight import DT_S, Flight
from support.lossy import Wire
from support.scripted import GUIDED, ONLY_PLACE, ONLY_VELOCITY, ScriptedCopter

REPORT_S = 0.05


def _target(at_s: float, velocity: tuple[float, float, float], mask: int = ONLY_VELOCITY) -> Any:
    return mav.dialect.MAVLink_position_target_local_ned_message(
        int(at_s * 1000), 1, mask, 0.0, 0.0, 0.0, *velocity, 0.0, 0.0, 0.0, 0.0, 0.0)


class Echo:
    """An ArduPilot that follows whom it heard last, over links that lose and delay, beside somebody else."""

    def __init__(self, rng: np.random.Generator, **quality: float) -> None:
        self.watch = SetpointWatch()
        self.up, self.down = (Wire(one, **quality) for one in rng.spawn(2))
        self.velocity, self.received_s = (0.0, 0.0, 0.0), -math.inf
        self.now_s = 100.0
        self._n: dict[bytes, Any] = {}

    def follow(self, velocity: tuple[float, float, float]) -> None:
        self.velocity, self.received_s = velocity, self.now_s

    def tick(self, ours: tuple[float, float, float]) -> None:
        """20 Hz: we send, it follows and reports; without setpoints for 3 s it stands."""
        self.now_s += REPORT_S
        self.watch.sent(ours, self.now_s)
        self._send(self.up, ours)
        for frame in self.up.due(self.now_s):
            self.follow(self._n[frame])
        if self.now_s - self.received_s > 3.0:
            self.velocity = (0.0, 0.0, 0.0)
        self._send(self.down, _target(self.now_s, self.velocity))
        for frame in self.down.due(self.now_s):
            self.watch.report(self._n[frame], self.now_s)

    def _send(self, wire: Wire, what: Any) -> None:
        frame = len(self._n).to_bytes(8, 'little')
        self._n[frame] = what
        wire.put(frame, self.now_s)


def _flown(rng: np.random.Generator, ticks: int) -> Any:
    """Velocities of a flight: legs, ramps and stops."""
    velocity = np.zeros(3)
    wanted = np.zeros(3)
    for tick in range(ticks):
        if tick % 40 == 0:
            wanted = rng.normal(0.0, 1.0, 3) * (rng.random() > 0.3)
        velocity = velocity + np.clip(wanted - velocity, -0.1, 0.1)
        yield tuple(float(np.float32(part)) for part in velocity)


QUALITIES: list[dict[str, float]] = [
    {}, {'loss': 0.5}, {'loss': 0.9}, {'delay_s': 2.0}, {'delay_s': 10.0}, {'loss': 0.3, 'delay_s': 0.5, 'jitter_s': 1.0},
    {'loss': 0.5, 'delay_s': 5.0, 'jitter_s': 4.0},
]


@pytest.mark.parametrize('quality', QUALITIES, ids=str)
def test_our_own_setpoints_are_never_somebody_elses(quality: dict[str, float]) -> None:
    """Nine minutes for each kind of link, an hour in all."""
    rng = np.random.default_rng(11)
    echo = Echo(rng, **quality)
    for velocity in _flown(rng, 10_500):
        echo.tick(velocity)
        assert echo.watch.foreign == '', echo.now_s


@pytest.mark.parametrize('period', [1, 4, 20])
def test_somebody_elses_setpoints_show_soon(period: int) -> None:
    """At 20, 5 and 1 Hz beside ours at 20 Hz."""
    rng = np.random.default_rng(period)
    for _ in range(20):
        echo, shown = Echo(rng.spawn(1)[0]), None
        for tick, velocity in enumerate(_flown(rng, 200)):
            if tick >= 100 and (tick - 100) % period == 0:
                echo.follow((-5.0, 0.3, 0.0))
            wins = bool(tick % 2) if period == 1 else tick % period != 0
            echo.tick(velocity) if wins or tick < 100 else _tick_after(echo, velocity, (-5.0, 0.3, 0.0))
            if echo.watch.foreign:
                shown = (tick - 100) * REPORT_S
                break
        assert shown is not None and 0.0 <= shown <= (0.5 if period < 20 else 1.5)


def _tick_after(echo: Echo, ours: tuple[float, float, float], theirs: tuple[float, float, float]) -> None:
    """Theirs comes last before the report."""
    echo.watch.sent(ours, echo.now_s)
    echo.now_s += REPORT_S
    echo.follow(theirs)
    echo.watch.report(_target(echo.now_s, theirs), echo.now_s)


def test_a_place_that_we_never_send_is_somebody_elses_at_once_but_not_that_of_our_take_off() -> None:
    watch = SetpointWatch()
    watch.report(_target(1.0, (0.0, 0.0, 0.0), ONLY_PLACE), 1.0)
    assert watch.foreign == ''
    watch.sent((0.0, 0.0, 0.0), 1.1)
    watch.report(_target(1.2, (0.0, 0.0, 0.0)), 1.2)
    watch.report(_target(1.0, (0.0, 0.0, 0.0), ONLY_PLACE), 1.3)  # Overtaken on its way.
    assert watch.foreign == ''
    watch.report(_target(1.4, (0.0, 0.0, 0.0), ONLY_PLACE), 1.4)
    assert watch.foreign == 'a position'


def test_the_zero_before_a_take_off_and_the_place_after_it_are_the_autopilots_own() -> None:
    watch = SetpointWatch()
    watch.sent((0.0, 0.0, 0.0), 1.0)
    watch.report(_target(1.0, (0.0, 0.0, 0.0)), 1.0)
    watch.report(_target(1.1, (0.0, 0.0, 0.0), ONLY_PLACE), 1.1)
    watch.report(_target(1.2, (0.0, 0.0, 0.0)), 1.2)
    assert watch.foreign == ''
    watch.report(_target(1.3, (0.0, 0.0, 0.0), ONLY_PLACE), 1.3)
    assert watch.foreign == 'a position'


def test_what_the_autopilot_brakes_before_its_own_fence_is_ours() -> None:
    """It takes off what leads towards the fence, in part or all of it."""
    watch = SetpointWatch()
    watch.sent((1.0, 1.0, 0.0), 1.0)
    watch.report(_target(1.0, (1.0, 1.0, 0.0)), 1.0)
    for step in range(1, 11):
        watch.sent((1.0, 1.0, 0.0), 1.0 + 0.1 * step)
        watch.report(_target(1.0 + 0.1 * step, (1.0 - 0.1 * step, 1.0, 0.0)), 1.0 + 0.1 * step)
    assert watch.foreign == ''


class Steered(Flight):
    """Commands at 20 Hz, as the bridge does."""

    velocity = (0.0, 0.0, 0.0)

    def tick(self) -> None:
        super().tick()
        setpoint = self.companion.setpoint(self.velocity, 0.0, self.now_s)
        if setpoint is not None:
            self.copter.receive(setpoint)


class Distant(Steered):
    """Over a link that takes 50 to 150 ms each way and overtakes, and cuts what is under way."""

    def __init__(self, copter: ScriptedCopter, seed: int) -> None:
        super().__init__(copter, heartbeat_timeout_s=1.0)
        self.up, self.down = (Wire(rng, delay_s=0.05, jitter_s=0.1) for rng in np.random.default_rng(seed).spawn(2))

    def tick(self) -> None:
        self.now_s += DT_S
        self.up.cut = self.down.cut = self.cut
        for message in self.companion.step(self.now_s):
            self.up.put(message, self.now_s)
        setpoint = self.companion.setpoint(self.velocity, 0.0, self.now_s)
        if setpoint is not None:
            self.up.put(setpoint, self.now_s)
        answers = [answer for message in self.up.due(self.now_s) for answer in self.copter.receive(message)]
        for message in answers + self.copter.step(DT_S):
            self.down.put(message, self.now_s)
        self.deliver(self.down.due(self.now_s))


def _other(flight: Flight, north_m_s: float) -> None:
    flight.copter.follow(mav.velocity_setpoint((1, 1), 0, (0.0, north_m_s, 0.0), 0.0))


def test_who_sends_setpoints_beside_us_has_the_vehicle_within_half_a_second() -> None:
    flight = Steered(ScriptedCopter())
    flight.fly()
    flight.velocity = (1.0, 0.0, 0.0)
    flight.run(5.0)
    assert flight.status.owner == 'ours'
    began_s = flight.now_s
    while flight.status.commandable:
        assert flight.now_s - began_s < 0.5
        flight.tick()
        _other(flight, -1.0)
    assert (flight.status.owner, flight.status.mode) == ('others', 'GUIDED')
    assert flight.status.waiting_for.startswith('mavlink_bridge/take_over: somebody else sends setpoints: 1.0 m/s')
    before = len(flight.copter.setpoints)
    flight.run(5.0)
    assert len(flight.copter.setpoints) == before


@pytest.mark.parametrize('away_s', [0.5, 1.6, 2.0, 2.5, 3.2, 10.0, 60.0])
def test_what_we_sent_before_the_link_was_lost_is_still_ours_when_it_is_back(away_s: float) -> None:
    """The vehicle follows the last velocity that arrived, until GUID_TIMEOUT; we have long asked for others."""
    flight = Distant(ScriptedCopter(), seed=4)
    flight.fly()
    for leg in range(5):
        flight.velocity = (1.0, 0.3 * leg, 0.0)
        flight.run(2.0)
        flight.cut = True
        flight.velocity = (0.0, 0.0, 0.0)
        flight.run(away_s)
        flight.cut = False
        flight.velocity = (-1.0, 0.0, 0.1)
        flight.until(lambda: flight.status.commandable, 5.0)
        flight.run(2.0)
        assert (flight.status.owner, flight.status.commandable) == ('ours', True), flight.status.waiting_for


def test_somebody_elses_setpoints_show_after_a_loss_of_the_link_too() -> None:
    flight = Distant(ScriptedCopter(), seed=5)
    flight.fly()
    flight.velocity = (1.0, 0.0, 0.0)
    flight.run(2.0)
    flight.cut = True
    flight.run(5.0)
    for _ in range(20):
        _other(flight, -1.0)
        flight.tick()
    flight.cut = False
    for _ in range(round(2.0 / DT_S)):
        _other(flight, -1.0)
        flight.tick()
        _other(flight, -1.0)
    assert flight.status.owner == 'others'


def test_what_somebody_steers_is_not_taken_over() -> None:
    flight = Steered(ScriptedCopter(armed=True, mode=GUIDED, position_ned=[0.0, 0.0, -5.0]))
    flight.run(2.0)
    request = flight.ask(Goal.TAKE_OVER)
    for _ in range(round(4.0 / DT_S)):
        flight.tick()
        _other(flight, -1.0)
    assert request.reply is not None and not request.reply.accepted
    assert 'somebody else sends setpoints' in request.reply.message
    assert flight.status.owner == 'others'
    flight.ask(Goal.TAKE_OVER)  # He has stopped.
    flight.until(lambda: flight.status.commandable, 5.0)


def test_current_mode_is_that_of_the_public_definition() -> None:
    public = development.MAVLink_current_mode_message
    assert CurrentMode.id == public.id
    assert (CurrentMode.crc_extra, CurrentMode.unpacker.format) == (public.crc_extra, public.unpacker.format)
    assert CurrentMode.ordered_fieldnames == public.ordered_fieldnames
    ours, codec = CurrentMode(3, 0x00060000, 0x06040000), mav.dialect.MAVLink(None, 1, 1)
    theirs = public(3, 0x00060000, 0x06040000)
    assert ours.pack(codec) == theirs.pack(development.MAVLink(None, 1, 1))
