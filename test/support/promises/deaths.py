"""A node dies or hangs in mid-flight: the vehicle stands, or does not notice; the rest goes on, and all recovers."""

from __future__ import annotations

import itertools
import signal
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from advise_msgs.msg import FlightStatus
from support.promises.book import Book, Measure
from support.promises.rig import Rig, Settings, flying

# The bridge's time-out of commands, one tick of it, and what it takes to notice.
TIMEOUT_S, TICK_S = 0.5, 0.05
ZERO_LIMIT_S = TIMEOUT_S + TICK_S + 0.1
# From 1 m/s the simulated vehicle stands after less than this.
BRAKING_S = 1.5
GAP_LIMIT_S = 0.25
WATCH_S = 1.0
STAND_PATIENCE_S, RECOVERY_LIMIT_S = 12.0, 30.0
MOVERS, BYSTANDERS = ('policy', 'guard', 'mavlink_bridge'), ('advise', 'recorder', 'logger')
HOW = {'killed': signal.SIGKILL, 'stopped': signal.SIGSTOP}


class Loss(NamedTuple):
    """A node, and how it is taken away."""

    name: str
    how: str

    def __str__(self) -> str:
        return f'{self.name} {self.how}'


def run(folder: Path, rng: np.random.Generator, book: Book, autopilot: str) -> None:
    """In each round take each node away in both ways at random moments of one long flight, in any order."""
    movers, bystanders = ([Loss(*pair) for pair in itertools.product(names, HOW)] for names in (MOVERS, BYSTANDERS))
    with flying(folder, rng, Settings(autopilot)) as rig:
        for _ in book.rounds():
            for bystander, mover in zip(rng.permutation(len(bystanders)), rng.permutation(len(movers)), strict=True):
                take_away(rig, book, bystanders[bystander], movers[mover])


def take_away(rig: Rig, book: Book, bystander: Loss, mover: Loss) -> None:
    """Take a bystander away; while it comes back, what moves the vehicle goes too."""
    back_s = _bystander(rig, book, bystander)
    _mover(rig, book, mover)
    seconds = rig.wait_speaks(bystander.name, back_s, RECOVERY_LIMIT_S)
    _recovered(rig, book, bystander, 'seconds until it speaks', seconds)


def _bystander(rig: Rig, book: Book, loss: Loss) -> float:
    """Lose one that the flight does not need; when it was brought back."""
    while True:
        at_s = _lose(rig, loss)
        time.sleep(max(0.0, at_s + WATCH_S - time.monotonic()))
        gap_s, over = rig.longest_gap(at_s, at_s + WATCH_S), rig.flights[-1].phase == FlightStatus.SUCCEEDED
        back_s = _bring_back(rig, loss)
        if not over:  # A route that ends meanwhile tells nothing.
            figure = 'longest gap in control, s'
            book.add(Measure('the flight goes on', rig.with_autopilot(str(loss)), figure, gap_s, GAP_LIMIT_S))
            return back_s
        rig.wait_speaks(loss.name, back_s, RECOVERY_LIMIT_S)


def _mover(rig: Rig, book: Book, loss: Loss) -> None:
    """Lose one without which the vehicle stands, and bring it back."""
    of_bridge = loss.name == 'mavlink_bridge'
    trouble, at_s = rig.with_autopilot(str(loss)), _lose(rig, loss)
    stands_s = rig.wait_stands(at_s, STAND_PATIENCE_S)
    limit_s = (rig.timeout_s if of_bridge else ZERO_LIMIT_S) + BRAKING_S
    book.add(Measure('the vehicle stands', trouble, 'seconds until it stands', stands_s, limit_s))
    if not of_bridge:
        zero_s = rig.wait_zero(at_s, STAND_PATIENCE_S)
        book.add(Measure('zero velocity', trouble, 'seconds until it is commanded', zero_s, ZERO_LIMIT_S))
    back_s = _bring_back(rig, loss)
    rig.wait_speaks(loss.name, back_s, RECOVERY_LIMIT_S)
    rig.fly()
    _recovered(rig, book, loss, 'seconds until it flies again', time.monotonic() - back_s)


def _lose(rig: Rig, loss: Loss) -> float:
    """Take a node away at a random moment of the flight; when."""
    rig.fly()
    rig.pause(0.7)
    rig.fly()  # The route may have ended meanwhile.
    at_s = time.monotonic()
    rig.processes[loss.name].signal(HOW[loss.how])
    return at_s


def _bring_back(rig: Rig, loss: Loss) -> float:
    if loss.how == 'killed':
        rig.processes[loss.name].kill()
    return rig.bring_back(loss.name)


def _recovered(rig: Rig, book: Book, loss: Loss, figure: str, seconds: float) -> None:
    fallen = ', '.join(name for name, process in rig.processes.items() if not process.running)
    broken = f'{fallen} ended too' if fallen else ''
    book.add(Measure('recovery', rig.with_autopilot(str(loss)), figure, seconds, RECOVERY_LIMIT_S, broken=broken))
