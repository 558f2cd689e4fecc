"""What is not commanded stands: hovering with a sloppy estimate, and through a shift of the GPS. Simulated time."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from advise_ros.config import GuardConfig, build
from advise_ros.core.guard.rules import Command
from advise_ros.core.units import MAP_FRAME
from advise_ros.mavlink.messages import dialect
from advise_ros.nodes.checking import limits_of, monitor_of
from advise_ros.sim.arducopter import ArduCopter
from advise_ros.sim.px4 import SimulatedPx4
from support.companion_flight import DT_S
from support.promises.book import Book, Measure
from support.simulated_flight import Simulated, SimulatedFlight

DIALECTS: dict[str, Any] = {'ardupilot': ArduCopter, 'px4': SimulatedPx4}
NAMES = {'ardupilot': 'ArduPilot', 'px4': 'PX4'}
# Of PX4's velocity estimate on its SITL.
DRIFT_M_S = 0.3
HOVER_S, STOPPING_S = 60.0, 5.0
HOVER_LIMIT_M = {'ardupilot': 0.05, 'px4': 0.5}
CONFIG = build(GuardConfig, {'fence': 'off'})

METRES_A_DEGREE = 111_319.0
SHIFTS_M = (5.5, 33.0)
# From the shift to its end: it is believed after 10 s, and named for 10 s more.
SHIFTED_S = 25.0
NOTICED_LIMIT_S, MOVED_LIMIT_M = 1.0, 2.5


class GuardedFlight(SimulatedFlight):
    """A simulated vehicle, the bridge's side of it and the guard, commanded `wish` all the time.

    Attributes:
        wish: velocity in ENU that is commanded, None for no commands.
        reason: the guard's, for what it does not fly.
    """

    wish: tuple[float, float, float] | None = None
    reason = ''

    def __init__(self, copter: Simulated) -> None:
        super().__init__(copter)
        self._monitor = monitor_of(CONFIG, limits_of(CONFIG, None))
        self._seen: Any = None

    def tick(self) -> None:
        super().tick()
        motion = self.companion.vehicle.motion
        if motion is not None and motion is not self._seen:
            self._seen = motion
            self._monitor.pose(motion.position_enu_m, MAP_FRAME, motion.at_s, doubt=self.companion.vehicle.doubt)
        if not self.companion.commandable(self.now_s):
            self._monitor.clear()
            return
        if self.wish is not None:
            self._monitor.command(Command(self.wish, MAP_FRAME, 0.0), self.now_s)
        verdict = self._monitor.verdict(self.now_s)
        self.velocity = verdict.velocity_enu_m_s if verdict is not None else (0.0, 0.0, 0.0)
        self.reason = verdict.reason if verdict is not None else ''
        self.doubt = self._monitor.position_doubt(self.now_s)

    @property
    def estimate(self) -> tuple[float, float, float]:
        """Where the autopilot says it is."""
        motion = self.companion.vehicle.motion
        assert motion is not None
        return motion.position_enu_m

    @property
    def truth(self) -> tuple[float, float, float]:
        east, north, up = (float(part) for part in self.copter.vehicle.state.position_enu_m)
        return east, north, up

    def set(self, name: str, value: float) -> None:
        """A parameter of the autopilot, as a ground station sets it."""
        self.copter.receive(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, dialect.MAV_PARAM_TYPE_REAL32))


def take_off(autopilot: str, rng: np.random.Generator, **values: float) -> GuardedFlight:
    """One in the air, 4 m up."""
    drift = {'drift_m_s': DRIFT_M_S} if autopilot == 'px4' else {}
    seed = int(rng.integers(1 << 30))
    flight = GuardedFlight(Simulated(DIALECTS[autopilot], seed=seed, **{**drift, **values}))
    flight.fly()
    return flight


def hover(flight: GuardedFlight, rng: np.random.Generator) -> float:
    """Fly somewhere, stop, and return how far from where it stopped it gets in HOVER_S, metres of its estimate."""
    angle = float(rng.uniform(-math.pi, math.pi))
    flight.wish = math.cos(angle), math.sin(angle), 0.0
    flight.run(4.0)
    flight.wish = None
    flight.run(STOPPING_S)
    stopped, furthest = flight.estimate, 0.0
    for _ in range(round(HOVER_S / DT_S)):
        flight.tick()
        furthest = max(furthest, math.dist(flight.estimate, stopped))
    return furthest


def shift(flight: GuardedFlight, rng: np.random.Generator) -> tuple[float, float]:
    """Shift the GPS of an ArduPilot in flight for good; seconds until it is made to stand, metres that it truly moves."""
    flight.wish = (0.7, 0.7, 0.0)
    flight.run(3.0)
    before, began_s, noticed_s, moved = flight.truth, flight.now_s, math.inf, 0.0
    size_m, angle = float(rng.uniform(*SHIFTS_M)), float(rng.uniform(-math.pi, math.pi))
    flight.set('SIM_GPS1_GLTCH_X', size_m * math.cos(angle) / METRES_A_DEGREE)
    flight.set('SIM_GPS1_GLTCH_Y', size_m * math.sin(angle) / METRES_A_DEGREE)
    for _ in range(round(SHIFTED_S / DT_S)):
        flight.tick()
        if flight.now_s - began_s > SHIFTED_S - 6.0:
            continue  # It ends, and the flight goes on.
        if math.isinf(noticed_s) and flight.velocity == (0.0, 0.0, 0.0):
            noticed_s = flight.now_s - began_s
        moved = max(moved, math.dist(flight.truth[:2], before[:2]))
    return noticed_s, moved


def run(folder: Path, rng: np.random.Generator, book: Book, autopilot: str) -> None:
    """Hover, each round in another vehicle, and with ArduPilot shift the GPS."""
    name = NAMES[autopilot]
    for _ in book.rounds():
        flight = take_off(autopilot, rng)
        trouble = f'{name}, velocity off by {DRIFT_M_S:g} m/s' if autopilot == 'px4' else f'{name}, no command'
        book.add(Measure(
            'it stands', trouble, f'metres from where it stopped, {HOVER_S:g} s', hover(flight, rng), HOVER_LIMIT_M[autopilot],
            timed=False, note='of the estimate, in simulated time',
        ))
        if autopilot == 'ardupilot':
            noticed_s, moved_m = shift(flight, rng)
            trouble = f'{name} at 1 m/s, GPS shifted for good by {SHIFTS_M[0]:g} to {SHIFTS_M[1]:g} m'
            book.add(
                Measure('it stands', trouble, 'seconds until zero velocity', noticed_s, NOTICED_LIMIT_S, timed=False),
                Measure('it stands', trouble, 'metres truly moved until the shift is over', moved_m, MOVED_LIMIT_M, timed=False),
            )
