"""The radio between autopilot and companion is cut, loses, delays and reorders: the vehicle stands, nothing old is flown."""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np

from advise_ros.core.guard.fence import Fence, fence_around
from support.delays import Delay, growing, stalling, steady
from support.lossy_proxy import GOOD, Wire
from support.promises.book import Book, Measure
from support.promises.deaths import BRAKING_S, RECOVERY_LIMIT_S, ZERO_LIMIT_S
from support.promises.fences import beyond_m
from support.promises.rig import Rig, Settings, flying

CUTS_S = (0.1, 30.0)
# One bad radio to so many cuts, and how long it stays so.
CUTS_A_BAD_ONE, BAD_S = 10, 20.0
# What a setpoint is sent for: a pose by way of the policy, a tick of the guard, a tick of the bridge.
POSES_HZ, GUARD_HZ, BRIDGE_HZ = 20.0, 20.0, 20.0
# Positions that are later than pose_timeout_s (0.5 s) are flown by nowhere; these are not.
BAD = {
    '30 % lost': Wire(loss=0.3),
    '0.3 s late': Wire(delay_s=0.3),
    'reordered': Wire(jitter_s=0.15),
    '30 % lost, 0.3 s late, reordered': Wire(loss=0.3, delay_s=0.2, jitter_s=0.15),
}
# In order, nothing lost, by direction: 'up' from the vehicle, 'down' to it. A delay is given as long as it needs to show.
LATE: dict[str, dict[str, Delay]] = {
    'positions 2 s late': {'up': steady(2.0)},
    'commands 2 s late': {'down': steady(2.0)},
    'both later and later, to 10 s': {'up': growing(1.0, 10.0), 'down': growing(1.0, 10.0)},
    'positions stall for 3 s of 5': {'up': stalling(5.0, 3.0)},
}
LATE_S = 25.0
# While nothing is heard the vehicle flies its last setpoint for the autopilot's time-out, at most 1 m/s here.
FENCE_LIMIT_M = 1.0


def run(folder: Path, rng: np.random.Generator, book: Book, autopilot: str) -> None:
    """Cut the radio for 0.1 to 30 s each round, and in each tenth fly on each kind of bad radio for a while."""
    with flying(folder, rng, Settings(autopilot)) as rig:
        for number in book.rounds():
            cut(rig, book, CUTS_S[1])
            if number % CUTS_A_BAD_ONE == 0:
                for trouble in BAD:
                    disturb(rig, book, trouble, BAD_S)
                for trouble in LATE:
                    delay(rig, book, trouble, LATE_S)


# -- cut -------------------------------------------------------------------------------------
def cut(rig: Rig, book: Book, longest_s: float) -> None:
    """Cut the radio for a while, short times as often as long ones."""
    rig.fly()
    rig.pause(0.7)
    rig.fly()
    length_s = math.exp(rig.rng.uniform(math.log(CUTS_S[0]), math.log(longest_s)))
    at_s = time.monotonic()
    rig.proxy.wire = Wire(cut=True)
    time.sleep(length_s)
    stands_s = _moved_on(rig, at_s, at_s + length_s)
    rig.proxy.wire = GOOD
    began_s = time.monotonic()
    broken = _burst(rig, began_s)
    rig.fly()
    trouble, limit_s = rig.with_autopilot(f'radio cut for {CUTS_S[0]:g} to {longest_s:g} s'), rig.timeout_s + BRAKING_S
    book.add(
        Measure('the vehicle stands', trouble, 'seconds in motion without us', stands_s, limit_s, broken=broken),
        Measure('recovery', trouble, 'seconds until it flies again', time.monotonic() - began_s, RECOVERY_LIMIT_S),
    )


def _moved_on(rig: Rig, since_s: float, until_s: float) -> float:
    """Seconds of a cut that the vehicle was in motion; its own word passes the tap before it is lost."""
    stood = rig.wait_stands(since_s, 0.001)
    return min(stood, until_s - since_s)


def _burst(rig: Rig, began_s: float) -> str:
    """Setpoints of before the cut that were kept and sent when the radio came back."""
    time.sleep(0.2)
    sent = [command for command in rig.tap.commands_since(began_s) if command.at_s < began_s + 0.2]
    most = 2 * round(0.2 * (POSES_HZ + GUARD_HZ + BRIDGE_HZ))
    return f'{len(sent)} setpoints in the first 0.2 s' if len(sent) > most else ''


# -- bad -------------------------------------------------------------------------------------
def disturb(rig: Rig, book: Book, trouble: str, seconds: float) -> None:
    """Fly on a bad radio, then lose the policy on it; the fence holds all the while."""
    rig.fly()
    at_s = time.monotonic()
    rig.proxy.wire = BAD[trouble]
    _keep_flying(rig, at_s + seconds)
    rig.processes['policy'].kill()
    zero_s = rig.wait_zero(time.monotonic(), 5.0)
    outside_m = _furthest(rig, fence_around(rig.grid, 1.0, 3.0), at_s)
    rig.proxy.wire = GOOD
    rig.bring_back('policy')
    bad, killed = (rig.with_autopilot(f'{words}radio: {trouble}') for words in ('', 'policy killed, '))
    book.add(
        Measure('the fence', bad, 'metres outside', outside_m, FENCE_LIMIT_M, timed=False),
        Measure('zero velocity', killed, 'seconds until it is commanded', zero_s, ZERO_LIMIT_S),
    )


def delay(rig: Rig, book: Book, trouble: str, seconds: float) -> None:
    """Fly while the links become late; nothing but the fence is promised, and that it flies again."""
    rig.fly()
    at_s = time.monotonic()
    for direction, later in LATE[trouble].items():
        rig.proxy.delay(direction, later)
    while time.monotonic() < at_s + seconds:
        time.sleep(0.2)
    outside_m = _furthest(rig, fence_around(rig.grid, 1.0, 3.0), at_s)
    for direction in LATE[trouble]:
        rig.proxy.delay(direction, steady(0.0))
    began_s = time.monotonic()
    rig.fly()
    late = rig.with_autopilot(f'radio: {trouble}')
    book.add(
        Measure('the fence', late, 'metres outside', outside_m, FENCE_LIMIT_M, timed=False),
        Measure('recovery', late, 'seconds until it flies again', time.monotonic() - began_s, RECOVERY_LIMIT_S),
    )


def _keep_flying(rig: Rig, until_s: float) -> None:
    while time.monotonic() < until_s:
        if not rig.flies():
            rig.fly()
        time.sleep(0.2)


def _furthest(rig: Rig, fence: Fence, since_s: float) -> float:
    return max((beyond_m(fence, motion.position_enu_m) for motion in rig.tap.motions_since(since_s)), default=math.inf)
