"""Flight after flight for a long time at high speed: memory and descriptors stay as they are."""

from __future__ import annotations

import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from support.promises.book import Book, Measure
from support.promises.rig import NODES, Rig, Settings, flying

# The bridge's time-outs are in real seconds, the autopilot's in simulated ones, which are short here: so slow
# a flight, so few positions a simulated second, and simulated time that waits for a late setpoint.
SPEEDUP = 100.0
# No fence: it counts in real seconds.
FAST = {
    'simulator': {'step_s': 0.05, 'setpoint_lead_s': 2.0, 'guided_timeout_s': 30.0, 'clock_rate_hz': 50.0},
    'policy': {'speed_m_s': 0.5},
    'guard': {'fence': 'off', 'max_acceleration_m_s2': 1000.0, 'jump_m': 0.0},
    'mavlink_bridge': {
        'fence': 'off', 'takeoff_altitude_m': 3.0, 'max_acceleration_m_s2': 1000.0, 'jump_m': 0.0, 'pose_rate_hz': 2.0,
    },
}
# What start-up and the first flights bring in is there after this share.
WARM_UP_SHARE = 0.1
GROWTH_LIMIT_PERCENT = 5.0
PAGE_KIB = 4


class Holding(NamedTuple):
    """What a process holds."""

    resident_kib: int
    descriptors: int


def holding(pid: int) -> Holding:
    """What a process holds now."""
    resident = int(Path(f'/proc/{pid}/statm').read_text().split()[1]) * PAGE_KIB
    return Holding(resident, len(list(Path(f'/proc/{pid}/fd').iterdir())))


def run(folder: Path, rng: np.random.Generator, book: Book) -> None:
    """Fly the route over and over for as many simulated minutes as there are trials, or until the time is over."""
    minutes = book.total - book.done
    with flying(folder, rng, Settings(speedup=SPEEDUP, parameters=FAST)) as rig:
        first_s, began_s, flight = _simulated_s(rig), time.monotonic(), rig.flights[-1].flight_id
        _fly_until(rig, book, first_s + minutes * 60.0 * WARM_UP_SHARE)
        before = {name: holding(process.pid) for name, process in rig.processes.items()}
        _fly_until(rig, book, first_s + minutes * 60.0)
        after = {name: holding(process.pid) for name, process in rig.processes.items()}
        seconds, flights = _simulated_s(rig) - first_s, rig.flights[-1].flight_id - flight
        speedup = seconds / (time.monotonic() - began_s)
    trouble = f'{seconds / 3600.0:.1f} simulated hours, {flights} flights, {speedup:.0f} times real time'
    for name in NODES:
        book.add(*_measures(trouble, name, before[name], after[name]))
    book.advance(int(seconds / 60.0))


def _fly_until(rig: Rig, book: Book, simulated_s: float) -> None:
    """Flight after flight until a time on the simulator's clock."""
    while _simulated_s(rig) < simulated_s and not book.late:
        rig.fly()
        time.sleep(0.1)


def _simulated_s(rig: Rig) -> float:
    """The clock, as the bridge stamps its diagnostics and statuses with it."""
    return float(rig.vehicle[-1].header.stamp.sec)


def _measures(trouble: str, name: str, before: Holding, after: Holding) -> tuple[Measure, Measure]:
    growth = 100.0 * (after.resident_kib - before.resident_kib) / before.resident_kib
    more = float(max(0, after.descriptors - before.descriptors))
    return (
        Measure('memory', trouble, f'{name}: growth, %', growth, GROWTH_LIMIT_PERCENT, timed=False),
        Measure('descriptors', trouble, f'{name}: more than before', more, 0.0, timed=False),
    )
