"""The fence against a wild pilot: the simulator's vehicle in wind, with drift, delays and dropouts, faster than time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from advise_ros.config import GuardConfig, SimulatorConfig, build
from advise_ros.core.grid.grid import Grid
from advise_ros.core.guard.fence import Fence, outside_m
from advise_ros.core.guard.monitor import DRIFT_M_S, GuardMonitor
from advise_ros.core.guard.rules import Command, Limits
from advise_ros.core.units import MAP_FRAME, NS
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.timesync import Timesync
from advise_ros.nodes.checking import limits_of, monitor_of
from advise_ros.sim.modes import Mode
from advise_ros.sim.setpoints import Setpoint
from advise_ros.sim.vehicle import SimulatedVehicle
from support.late_line import KINDS, LONGEST_S, LateLine
from support.promises.book import Book, Measure

# docs/safety.md names it: gusts push the vehicle further than it was commanded.
BOUND_M = 1.0
GRID = Grid(2.0, 5, 5, (-1.0, -1.0), 10.0, waypoints=(4, 24, 20, 0))
CONFIG = build(GuardConfig, {'altitude_band_m': 3.0})
EPISODES_A_FLIGHT, EPISODE_S = 20, 10.0
STEP_S, STEPS_A_TICK = 0.025, 2
TICK_S = STEP_S * STEPS_A_TICK
MEAN_WIND_M_S, GUST_M_S = 6.0, 1.5
# Of poses on their way to the guard, and of setpoints on theirs to the vehicle (the guard's vehicle_delay_s).
LATENCY_S = 0.2
LOSS = 0.3
LONGEST_DROPOUT_S = 3.0
# GUID_TIMEOUT, as docs/safety.md recommends it.
GUIDED_TIMEOUT_S = 1.0


class Line(LateLine):
    """Is late by up to LATENCY_S, and by any kind of delay more; loses some of what it carries, and falls silent."""

    def __init__(self, rng: np.random.Generator, *, silences: bool, late: bool) -> None:
        kind = KINDS[rng.integers(len(KINDS))] if late else 'none'
        base_s, longest_s = float(rng.uniform(0.0, LATENCY_S)), float(rng.uniform(0.0, LONGEST_S))
        super().__init__(rng, kind, base_s, longest_s, lasting_s=EPISODES_A_FLIGHT * EPISODE_S)
        self._draws, self._silences = rng, silences
        self._loss = LOSS * float(rng.random())
        self._silent_until_s = -1.0

    def put(self, what: Any, now_s: float) -> None:
        """Sent now, unless it is lost. A wire that is silent for long is a lost link, another promise."""
        if self._silences and self._draws.random() < TICK_S / EPISODE_S:
            self._silent_until_s = now_s + float(self._draws.uniform(0.0, LONGEST_DROPOUT_S))
        if now_s >= self._silent_until_s and self._draws.random() >= self._loss:
            super().put(what, now_s)


class Flight:
    """A vehicle in the air, its guard, and a pilot who wants out."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        wind = [float(value) for value in rng.uniform(-1.0, 1.0, 2) * MEAN_WIND_M_S / np.sqrt(2.0)]
        simulated = build(SimulatorConfig, {
            'ready_after_s': 0.0, 'start_east_m': 4.0, 'start_north_m': 4.0, 'wind_east_m_s': wind[0],
            'wind_north_m_s': wind[1], 'gust_m_s': float(rng.uniform(0.0, GUST_M_S)), 'battery_s': 100_000.0,
            'guided_timeout_s': GUIDED_TIMEOUT_S,
        })
        self._vehicle = SimulatedVehicle(simulated, rng)
        self._poses, self._pilot = Line(rng, silences=True, late=True), Line(rng, silences=True, late=False)
        self._wire, self._timesync = Line(rng, silences=False, late=True), Timesync()
        self._drift = np.zeros(3)
        self._limits: Limits = limits_of(CONFIG, GRID)
        self._monitor: GuardMonitor = monitor_of(CONFIG, self._limits)
        self._wanted = (0.0, 0.0, 0.0)
        self._take_off()

    def _take_off(self) -> None:
        self._vehicle.set_mode(Mode.GUIDED.value)
        assert self._vehicle.arm().accepted
        assert self._vehicle.take_off(GRID.altitude_m).accepted
        for _ in range(round(30.0 / STEP_S)):
            self._vehicle.step()
        assert self._vehicle.airborne

    @property
    def explained_m(self) -> float:
        """Drift until it is seen and answered, and old commands that a link whose delay jitters hands on: docs/safety.md."""
        seen_s = self._limits.reaction_s / 2.0 + LONGEST_DROPOUT_S + self._poses.longest_s + self._wire.longest_s
        flown_on_m = CONFIG.max_speed_m_s * GUIDED_TIMEOUT_S if self._wire.kind == 'jitter' else 0.0
        return DRIFT_M_S * seen_s + flown_on_m

    def episode(self) -> float:
        """How far outside of the fence the vehicle came in EPISODE_S, metres."""
        fence = self._limits.fence
        assert fence is not None
        worst = 0.0
        for _ in range(round(EPISODE_S / TICK_S)):
            self._tick(self._vehicle.now_s)
            for _ in range(STEPS_A_TICK):
                self._vehicle.step()
            worst = max(worst, beyond_m(fence, self._position))
        return worst

    @property
    def _position(self) -> tuple[float, float, float]:
        east, north, up = (float(value) for value in self._vehicle.state.position_enu_m)
        return east, north, up

    def _tick(self, now_s: float) -> None:
        self._poses.put((now_s, self._position), now_s)
        if self._rng.random() < TICK_S:  # About once a second he wants something else.
            east, north, up = (float(value) for value in self._rng.normal(0.0, (5.0, 5.0, 1.0)))
            self._wanted = east, north, up
        self._pilot.put(self._wanted, now_s)
        for question in self._timesync.due(now_s):
            self._wire.put(question, now_s)
        for at_s, what in self._poses.take(now_s):
            self._hear(what, at_s)
        for at_s, velocity in self._pilot.take(now_s):
            self._monitor.command(Command(velocity, MAP_FRAME, 0.0), at_s)
        round_trip_s = self._timesync.round_trip_s(now_s)
        if round_trip_s is not None:
            self._monitor.round_trip(round_trip_s)
        verdict = self._monitor.verdict(now_s)
        if verdict is not None:
            self._wire.put(verdict.velocity_enu_m_s, now_s)
        for at_s, what in self._wire.take(now_s):
            self._obey(what, at_s)

    def _hear(self, what: Any, at_s: float) -> None:
        if isinstance(what, tuple):
            stamp_s, position = what
            self._monitor.pose(position, MAP_FRAME, at_s, stamp_ns=round(stamp_s * NS))
            return
        self._timesync.take(what, at_s)
        if self._timesync.bounds is not None:
            self._monitor.clock_bounds(*self._timesync.bounds, at_s)

    def _obey(self, what: Any, at_s: float) -> None:
        """The vehicle's velocity is off by a drift that changes slowly."""
        if not isinstance(what, tuple):
            self._poses.put(mav.dialect.MAVLink_timesync_message(round(at_s * NS), what.ts1), at_s)
            return
        walked = self._drift + 0.3 * DRIFT_M_S * np.sqrt(TICK_S) * self._rng.standard_normal(3)
        self._drift = walked * min(1.0, DRIFT_M_S / max(float(np.linalg.norm(walked)), 1e-9))
        east, north, up = (float(value) for value in np.array(what) + self._drift)
        self._vehicle.follow(Setpoint(velocity_enu_m_s=(east, north, up)))


def beyond_m(fence: Fence, position_enu_m: tuple[float, float, float]) -> float:
    """How far a position lies outside of a fence, the furthest of plan, above and below."""
    up = position_enu_m[2]
    return max(outside_m(fence, position_enu_m[:2]), fence.low_m - up, up - fence.high_m, 0.0)


def run(folder: Path, rng: np.random.Generator, book: Book) -> None:
    """Fly episodes, EPISODES_A_FLIGHT to each vehicle."""
    trouble = 'wild pilot, wind, gusts, drift, delays to 10 s, losses, dropouts'
    for _ in book.rounds(EPISODES_A_FLIGHT):
        flight = Flight(rng)
        outside = [max(0.0, flight.episode() - flight.explained_m) for _ in range(min(EPISODES_A_FLIGHT, book.total - book.done))]
        figure = 'metres outside, beyond drift and old commands'
        book.add(*(Measure('the fence', trouble, figure, beyond, BOUND_M, timed=False) for beyond in outside))
