"""A node dies or hangs in mid-flight: the vehicle stands, or does not notice; the rest goes on, and all recovers."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from advise_msgs.msg import FlightStatus
from support.promises.ledger import Row, row
from support.promises.rig import Rig, flying

# The bridge's time-out of commands, one tick of it, and what it takes to notice.
TIMEOUT_S, TICK_S, GUIDED_TIMEOUT_S = 0.5, 0.05, 3.0
ZERO_LIMIT_S = TIMEOUT_S + TICK_S + 0.1
# From 1 m/s the simulated vehicle stands after less than this.
BRAKING_S = 1.5
GAP_LIMIT_S = 0.25
WATCH_S = 1.0
STAND_PATIENCE_S, RECOVERY_LIMIT_S = 12.0, 30.0
MOVERS, BYSTANDERS = ('policy', 'guard', 'mavlink_bridge'), ('advise', 'recorder', 'logger')
HOW = {'killed': signal.SIGKILL, 'stopped': signal.SIGSTOP}
# What the short form does.
SHORT = (('policy', 'killed'), ('mavlink_bridge', 'stopped'), ('recorder', 'killed'))


def run(folder: Path, rng: np.random.Generator, trials: int) -> list[Row]:
    """Kill and stop each node `trials` times at random moments of one long flight."""
    with flying(folder, rng) as rig:
        return take_away(rig, [(name, how) for name in (*MOVERS, *BYSTANDERS) for how in HOW], trials)


def take_away(rig: Rig, pairs: Iterable[tuple[str, str]], trials: int) -> list[Row]:
    """Take nodes away, each in its way, `trials` times."""
    return [entry for name, how in pairs for entry in _node(rig, name, how, trials)]


def _node(rig: Rig, name: str, how: str, trials: int) -> list[Row]:
    measures = [_take_away(rig, name, how) for _ in range(trials)]
    trouble = f'{name} {how}'
    broken = [sentence for measure in measures for sentence in measure.broken]
    recovery = row(('recovery', trouble, 'seconds until it flies again'), [m.recovery_s for m in measures], RECOVERY_LIMIT_S)
    if name in BYSTANDERS:
        gaps = [m.gap_s for m in measures]
        return [row(('the flight goes on', trouble, 'longest gap in control, s'), gaps, GAP_LIMIT_S, broken), recovery]
    zeros, stands = [m.zero_s for m in measures], [m.stands_s for m in measures]
    timeout_s = GUIDED_TIMEOUT_S if name == 'mavlink_bridge' else ZERO_LIMIT_S
    rows = [row(('the vehicle stands', trouble, 'seconds until it stands'), stands, timeout_s + BRAKING_S, broken), recovery]
    if name != 'mavlink_bridge':
        rows.insert(0, row(('zero velocity', trouble, 'seconds until it is commanded'), zeros, ZERO_LIMIT_S))
    return rows


class Measure(NamedTuple):
    """One trial: seconds until zero velocity, until it stands, the longest gap in control, and until it flies again."""

    zero_s: float
    stands_s: float
    gap_s: float
    recovery_s: float
    broken: tuple[str, ...]


def _take_away(rig: Rig, name: str, how: str) -> Measure:
    rig.fly()
    rig.pause(1.0)
    rig.fly()  # The route may have ended meanwhile.
    since, at_s = len(rig.diagnostics), time.monotonic()
    rig.processes[name].signal(HOW[how])
    zero_s = stands_s = gap_s = 0.0
    if name in MOVERS:
        stands_s = rig.wait_stands(at_s, STAND_PATIENCE_S)
        zero_s = rig.wait_zero(at_s, 0.0 if name == 'mavlink_bridge' else STAND_PATIENCE_S)
    else:
        gap_s = _undisturbed(rig, at_s)
    recovery_s = _recovers(rig, name, how, since)
    fallen = tuple(f'{other} ended too' for other, process in rig.processes.items() if not process.running)
    return Measure(zero_s, stands_s, gap_s, recovery_s, fallen)


def _undisturbed(rig: Rig, at_s: float) -> float:
    """The longest gap in control; a route that ends in between is no gap."""
    time.sleep(max(0.0, at_s + WATCH_S - time.monotonic()))
    ended = rig.flights[-1].phase == FlightStatus.SUCCEEDED
    return 0.0 if ended else rig.longest_gap(at_s, at_s + WATCH_S)


def _recovers(rig: Rig, name: str, how: str, since: int) -> float:
    """Seconds from its return until the node speaks and the vehicle flies."""
    began_s = time.monotonic()
    if how == 'stopped':
        rig.processes[name].signal(signal.SIGCONT)
        since = len(rig.diagnostics)
    else:
        rig.processes[name].kill()
        rig.start(name)
    rig.graph.wait_until(lambda: rig.heard_of(name, since), RECOVERY_LIMIT_S, f'{name} to speak again')
    rig.fly()
    return time.monotonic() - began_s
