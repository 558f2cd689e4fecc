"""The radio between autopilot and companion is cut, loses, delays and reorders: the vehicle stands, nothing old is flown."""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np

from advise_ros.core.fence import Fence, fence_around
from support.lossy_proxy import GOOD, Wire
from support.promises.deaths import BRAKING_S, GUIDED_TIMEOUT_S, RECOVERY_LIMIT_S, ZERO_LIMIT_S
from support.promises.fences import beyond_m
from support.promises.ledger import Row, row
from support.promises.rig import Rig, flying

CUTS_S = (0.1, 30.0)
BAD_S = 20.0
# What a setpoint is sent for: a pose by way of the policy, a tick of the guard, a tick of the bridge.
POSES_HZ, GUARD_HZ, BRIDGE_HZ = 50.0, 20.0, 20.0
BAD = {
    '30 % lost': Wire(loss=0.3),
    '0.5 s late': Wire(delay_s=0.5),
    'reordered': Wire(jitter_s=0.15),
    '30 % lost, 0.5 s late, reordered': Wire(loss=0.3, delay_s=0.4, jitter_s=0.2),
}
# While nothing is heard the vehicle flies its last setpoint for GUIDED_TIMEOUT_S, at most 1 m/s here.
FENCE_LIMIT_M = 1.0


def run(folder: Path, rng: np.random.Generator, trials: int) -> list[Row]:
    """Cut the radio `trials` times for 0.1 to 30 s, and fly on each kind of bad radio a tenth as often for a while."""
    with flying(folder, rng) as rig:
        rows = cut(rig, trials, CUTS_S[1])
        for trouble in BAD:
            rows += disturb(rig, trouble, max(1, trials // 10), BAD_S)
        return rows


# -- cut -------------------------------------------------------------------------------------
def cut(rig: Rig, trials: int, longest_s: float) -> list[Row]:
    """Cut the radio for a while, short times as often as long ones."""
    stands, recoveries, broken = [], [], []
    for _ in range(trials):
        rig.fly()
        rig.pause(1.0)
        rig.fly()
        length_s = math.exp(rig.rng.uniform(math.log(CUTS_S[0]), math.log(longest_s)))
        at_s = time.monotonic()
        rig.proxy.wire = Wire(cut=True)
        time.sleep(length_s)
        stands.append(_moved_on(rig, at_s, at_s + length_s))
        rig.proxy.wire = GOOD
        began_s = time.monotonic()
        broken += _burst(rig, began_s)
        rig.fly()
        recoveries.append(time.monotonic() - began_s)
    trouble = f'radio cut for {CUTS_S[0]:g} to {longest_s:g} s'
    limit = GUIDED_TIMEOUT_S + BRAKING_S
    return [
        row(('the vehicle stands', trouble, 'seconds in motion without us'), stands, limit, broken),
        row(('recovery', trouble, 'seconds until it flies again'), recoveries, RECOVERY_LIMIT_S),
    ]


def _moved_on(rig: Rig, since_s: float, until_s: float) -> float:
    """Seconds of a cut that the vehicle was in motion; its own word passes the tap before it is lost."""
    stood = rig.wait_stands(since_s, 0.001)
    return min(stood, until_s - since_s)


def _burst(rig: Rig, began_s: float) -> list[str]:
    """Setpoints of before the cut that were kept and sent when the radio came back."""
    time.sleep(0.2)
    sent = [command for command in rig.tap.commands_since(began_s) if command.at_s < began_s + 0.2]
    most = 2 * round(0.2 * (POSES_HZ + GUARD_HZ + BRIDGE_HZ))
    return [f'{len(sent)} setpoints in the first 0.2 s'] if len(sent) > most else []


# -- bad -------------------------------------------------------------------------------------
def disturb(rig: Rig, trouble: str, trials: int, seconds: float) -> list[Row]:
    """Fly on a bad radio, then lose the policy on it; the fence holds all the while."""
    wire, fence = BAD[trouble], fence_around(rig.grid, 1.0, 3.0)
    outside, zeros = [], []
    for _ in range(trials):
        rig.fly()
        at_s = time.monotonic()
        rig.proxy.wire = wire
        _keep_flying(rig, at_s + seconds)
        rig.processes['policy'].kill()
        zeros.append(rig.wait_zero(time.monotonic(), 5.0))
        outside.append(_furthest(rig, fence, at_s))
        rig.proxy.wire = GOOD
        rig.start('policy')
    limit = ZERO_LIMIT_S
    return [
        Row('the fence', f'radio: {trouble}', 'metres outside', len(outside), max(outside), FENCE_LIMIT_M),
        row(('zero velocity', f'policy killed, radio: {trouble}', 'seconds until it is commanded'), zeros, limit),
    ]


def _keep_flying(rig: Rig, until_s: float) -> None:
    while time.monotonic() < until_s:
        if not rig.flies():
            rig.fly()
        time.sleep(0.2)


def _furthest(rig: Rig, fence: Fence, since_s: float) -> float:
    return max((beyond_m(fence, motion.position_enu_m) for motion in rig.tap.motions_since(since_s)), default=math.inf)
