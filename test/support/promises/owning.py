"""Whose the vehicle is: it flies again after any landing, and who else takes it has it. Simulated time, both dialects."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.requests import Goal
from advise_ros.sim.arducopter import ArduCopter
from advise_ros.sim.modes import Mode, Px4Mode
from advise_ros.sim.px4 import SimulatedPx4
from support.companion_flight import DT_S
from support.promises.book import Book, Measure
from support.simulated_flight import Simulated, SimulatedFlight

DIALECTS: dict[str, Any] = {'ardupilot': ArduCopter, 'px4': SimulatedPx4}
NAMES = {'ardupilot': 'ArduPilot', 'px4': 'PX4'}
LAND = {'ardupilot': Mode.LAND, 'px4': Px4Mode.LAND}
# From the request to the altitude, which takes some 10 s, and PX4 1 s of setpoints before.
UP_LIMIT_S = 30.0
# ArduPilot's target shows them in 0.4 s, once in a while later.
SHOWN_LIMIT_S = 1.3
ALONE_S, BLIND_S = 60.0, 14.0
SEEN_LIMIT_S = 0.3


def run(folder: Path, rng: np.random.Generator, book: Book, autopilot: str) -> None:
    """In each round one vehicle flies, is landed in three ways, flies again, and is taken by others."""
    for _ in book.rounds():
        flight = SimulatedFlight(Simulated(DIALECTS[autopilot], seed=int(rng.integers(1 << 30))))
        _up_s(flight)
        for name, land in LANDINGS.items():
            land(flight, autopilot)
            _down(flight, autopilot)
            trouble = f'{name} ({NAMES[autopilot]})'
            book.add(_measure('it flies again', trouble, 'seconds until it flies', _up_s(flight), UP_LIMIT_S))
        if autopilot == 'ardupilot':
            _others_steer(flight, rng, book)
        else:
            _satellites_come_back(flight, book)


def _measure(promise: str, trouble: str, figure: str, value: float, limit: float) -> Measure:
    return Measure(promise, trouble, figure, value, limit, timed=False)


def _up_s(flight: SimulatedFlight) -> float:
    """Seconds from the request for a take-off to a vehicle that takes commands."""
    flight.until(lambda: flight.status.ready, 120.0)
    began_s = flight.now_s
    flight.ask(Goal.TAKEOFF, 4.0)
    flight.until(lambda: flight.status.commandable)
    flight.velocity = (0.0, 0.0, 0.0)
    flight.run(2.0)
    return flight.now_s - 2.0 - began_s


def _down(flight: SimulatedFlight, autopilot: str) -> None:
    """Until it is disarmed; then what brought it down is over."""
    flight.until(lambda: not flight.status.armed, 120.0)
    _heal(flight, autopilot)


# -- landings --------------------------------------------------------------------------------
def _by_service(flight: SimulatedFlight, autopilot: str) -> None:
    flight.ask(Goal.LAND)


def _by_ground_station(flight: SimulatedFlight, autopilot: str) -> None:
    flight.copter.vehicle.set_mode(LAND[autopilot])


def _by_failsafe(flight: SimulatedFlight, autopilot: str) -> None:
    """It loses its satellites."""
    _see_satellites(flight, autopilot, sees=False)


LANDINGS: dict[str, Callable[[SimulatedFlight, str], None]] = {
    'landed by the service': _by_service, 'landed by a ground station': _by_ground_station, 'landed by a failsafe': _by_failsafe,
}


def _heal(flight: SimulatedFlight, autopilot: str) -> None:
    _see_satellites(flight, autopilot, sees=True)


def _see_satellites(flight: SimulatedFlight, autopilot: str, *, sees: bool) -> None:
    """By a parameter, as a ground station sets it; PX4 takes whole numbers by their bits."""
    if autopilot == 'ardupilot':
        name, value, kind = b'SIM_GPS1_ENABLE', float(sees), mav.dialect.MAV_PARAM_TYPE_REAL32
    else:
        value, = struct.unpack('<f', struct.pack('<i', 10 * sees))
        name, kind = b'SIM_GPS_USED', mav.dialect.MAV_PARAM_TYPE_INT32
    flight.copter.receive(mav.dialect.MAVLink_param_set_message(1, 1, name, value, kind))


# -- others ----------------------------------------------------------------------------------
def _others_steer(flight: SimulatedFlight, rng: np.random.Generator, book: Book) -> None:
    """We fly alone for a minute; then somebody sends setpoints beside us, at 20 or 5 Hz."""
    alarms = 0
    for tick in range(round(ALONE_S / DT_S)):
        if tick % 20 == 0:
            flight.velocity = _velocity(rng, 1.0)
        flight.tick()
        alarms += not flight.status.commandable
    book.add(_measure('whose it is', 'nobody beside us (ArduPilot)', 'false alarms', float(alarms > 0), 0.0))
    period, theirs, began_s, tick = int(rng.choice([1, 4])), _velocity(rng, 3.0), flight.now_s, 0
    while flight.status.commandable and flight.now_s - began_s < 10.0:
        flight.tick()
        if tick % period == 0:
            flight.copter.receive(mav.velocity_setpoint((1, 1), 0, theirs, 0.0))
        tick += 1
    shown_s = flight.now_s - began_s if flight.status.owner == 'others' else math.inf
    trouble = f'somebody sends setpoints beside us at {20 // period} Hz (ArduPilot)'
    book.add(_measure('whose it is', trouble, 'seconds until it is his', shown_s, SHOWN_LIMIT_S))


def _velocity(rng: np.random.Generator, speed_m_s: float) -> tuple[float, float, float]:
    angle = float(rng.uniform(-math.pi, math.pi))
    return speed_m_s * math.cos(angle), speed_m_s * math.sin(angle), 0.0


def _satellites_come_back(flight: SimulatedFlight, book: Book) -> None:
    """It lands by a failsafe, which ends: it must not go back to OFFBOARD and take off again from the ground."""
    _by_failsafe(flight, 'px4')
    flight.until(lambda: flight.copter.vehicle.mode is Px4Mode.LAND)
    began_s = flight.now_s
    flight.until(lambda: not flight.status.commandable)
    seconds = flight.now_s - began_s
    book.add(_measure('whose it is', 'a failsafe lands it (PX4)', 'seconds until our stream ends', seconds, SEEN_LIMIT_S))
    flight.run(BLIND_S)
    _heal(flight, 'px4')
    climbed, lowest_m = 0.0, math.inf
    for _ in range(round(20.0 / DT_S)):
        flight.tick()
        altitude_m = flight.copter.vehicle.state.altitude_m
        lowest_m = min(lowest_m, altitude_m)
        climbed = max(climbed, altitude_m - lowest_m)
    book.add(_measure('whose it is', 'a failsafe that ends (PX4)', 'metres that it climbs after', climbed, 0.5))
