"""Flight after flight for a long time at high speed: memory and descriptors stay as they are."""

from __future__ import annotations

import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from support.promises.ledger import Row
from support.promises.rig import NODES, Rig, Settings, flying

SPEEDUP = 15.0
# No fence: it counts in real seconds.
FAST = {
    'policy': {'speed_m_s': 2.0},
    'guard': {'grid_file': '', 'max_acceleration_m_s2': 1000.0, 'jump_m': 0.0},
    'mavlink_bridge': {'grid_file': '', 'takeoff_altitude_m': 3.0, 'max_acceleration_m_s2': 1000.0, 'jump_m': 0.0},
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


def run(folder: Path, rng: np.random.Generator, trials: int) -> list[Row]:
    """Fly the route over and over for `trials` simulated minutes."""
    with flying(folder, rng, Settings(SPEEDUP, 20.0, FAST)) as rig:
        flights = _fly_for(rig, trials * 60.0 * WARM_UP_SHARE)
        before = {name: holding(process.pid) for name, process in rig.processes.items()}
        flights += _fly_for(rig, trials * 60.0 * (1.0 - WARM_UP_SHARE))
        after = {name: holding(process.pid) for name, process in rig.processes.items()}
    trouble = f'{trials} simulated minutes, {flights} flights'
    return [entry for name in NODES for entry in _rows(trouble, name, before[name], after[name])]


def _fly_for(rig: Rig, simulated_s: float) -> int:
    """Flights begun in a time on the simulator's clock."""
    first, until_s = rig.flights[-1].flight_id, _simulated_s(rig) + simulated_s
    while _simulated_s(rig) < until_s:
        rig.fly()
        time.sleep(0.1)
    return int(rig.flights[-1].flight_id - first)


def _simulated_s(rig: Rig) -> float:
    """The clock, as the bridge stamps its diagnostics and statuses with it."""
    return float(rig.vehicle[-1].header.stamp.sec)


def _rows(trouble: str, name: str, before: Holding, after: Holding) -> list[Row]:
    growth = 100.0 * (after.resident_kib - before.resident_kib) / before.resident_kib
    more = after.descriptors - before.descriptors
    return [
        Row('memory', trouble, f'{name}: growth, %', 1, growth, GROWTH_LIMIT_PERCENT),
        Row('descriptors', trouble, f'{name}: more than before', 1, float(max(0, more)), 0.0),
    ]
