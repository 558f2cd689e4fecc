"""Live and offline give the same demonstrations, whatever happens to clocks, links and modes.

Examples: ADVISE_RECORDINGS (default 40; 1000 and more now and then, with ADVISE_SEED for others than last time).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest

from advise_ros.core.demonstrations.demonstration import Demonstration, EndReason
from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of
from advise_ros.core.demonstrations.recorder import Recorder
from advise_ros.core.demonstrations.samples import (
    Arrivals,
    CommandSamples,
    PolicyEvent,
    PoseSamples,
    Recording,
    VehicleEvent,
)
from advise_ros.core.grid.grid import ACTION_STEP, Grid

NS = 1_000_000_000
GRID = Grid(2.0, 3, 3, (-1.0, -1.0), 5.0, waypoints=(2, 8, 6, 0))
SETTINGS = DiscretiseSettings()
EXAMPLES, SEED = int(os.environ.get('ADVISE_RECORDINGS', '40')), int(os.environ.get('ADVISE_SEED', '0'))
MODES = ('GUIDED', 'GUIDED', 'GUIDED', 'LOITER', 'RTL', 'BRAKE', 'STABILIZE', '')
STRAYS_S = (5.0, 3.2e7, -20.0, -2.0, 1.5, 0.0)
STEPS_S = (-3600.0, -5.0, -2.5, 30.0, 3600.0)


class Arrival(NamedTuple):
    """Something that reaches the recorder at a time."""

    at_s: float
    kind: str
    stamp_ns: int
    value: Any


class World:
    """One random recording, as it arrives."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng((SEED, seed))
        rng = self._rng
        self._now_s, self._offset_s = 100_000.0, 0.0
        self._position, self._velocity = np.zeros(3), np.zeros(3)
        self._arrivals: list[Arrival] = []
        self._state = ('', False, False)
        self._rate_hz = float(rng.choice([8.0, 10.0, 20.0]))
        self._has_states, self._has_commands = rng.random() < 0.75, rng.random() < 0.8
        self._mischief = float(rng.choice([0.0, 0.01, 0.04]))
        self._delay_s = float(rng.choice([0.0, 0.05, 0.15]))
        self._silent_until_s = 0.0
        for _ in range(int(rng.integers(1, 4))):
            self._fly()
        self._stay(2.0)

    def arrivals(self) -> list[Arrival]:
        return sorted(self._arrivals, key=lambda one: one.at_s)

    def _stamp(self) -> int:
        return round((self._now_s + self._offset_s) * NS)

    def _send(self, kind: str, stamp_ns: int, value: Any, delay_s: float = 0.0) -> None:
        self._arrivals.append(Arrival(self._now_s + delay_s, kind, stamp_ns, value))

    def _tell(self, mode: str, armed: bool, in_air: bool | None, *, connected: bool = True) -> None:
        if self._has_states:
            self._state = (mode, armed, bool(in_air))
            event = VehicleEvent(self._stamp(), armed, in_air, mode, 'ardupilot', '', connected)
            self._send('state', event.stamp_ns, event, self._rng.uniform(0.0, self._delay_s) if self._delay_s else 0.0)

    def _tick(self, velocity: np.ndarray) -> None:
        rng = self._rng
        self._now_s += 1.0 / self._rate_hz
        self._position = self._position + velocity / self._rate_hz
        if self._has_commands and rng.random() < 0.9:
            said = velocity if rng.random() < 0.9 else rng.normal(0.0, 1.0, 3)
            delay_s = rng.uniform(0.0, self._delay_s) if self._delay_s else 0.0
            self._send('command', self._stamp(), tuple(said.tolist()), delay_s)
        if rng.random() < self._mischief:
            self._trouble()
        if self._now_s >= self._silent_until_s:
            stamp_ns = self._stamp()
            if rng.random() < self._mischief:
                stray_s = float(rng.choice(STRAYS_S))
                stamp_ns = stamp_ns + round(stray_s * NS) if stray_s else 0
            place = self._position + rng.normal(0.0, 0.03, 3)
            self._send('pose', stamp_ns, tuple(place.tolist()))

    def _trouble(self) -> None:
        rng, (mode, armed, in_air) = self._rng, self._state
        what = rng.integers(6)
        if what == 0:
            self._offset_s += float(rng.choice(STEPS_S))
        elif what == 1:
            self._silent_until_s = self._now_s + rng.uniform(0.5, 4.0)
        elif what == 2 and in_air:
            self._tell('', False, False, connected=False)
            self._silent_until_s = self._now_s + rng.uniform(0.5, 2.0)
            self._tell(mode, True, False)
            self._tell(mode, True, True)
        elif what == 3:
            self._tell(str(rng.choice(MODES)), armed, in_air)
        elif what == 4:
            self._send('policy', self._stamp(), bool(rng.random() < 0.5), 0.0)
        else:
            self._tell(mode, armed, None if rng.random() < 0.3 else in_air)

    def _direction(self, route: list[int]) -> tuple[int, int]:
        """Mostly towards the next waypoint, (east, north)."""
        if route and np.hypot(*(self._position[:2] - GRID.centre_enu_m(route[0]))) < 0.8:
            route.pop(0)
        if not route or self._rng.random() < 0.2:
            return ACTION_STEP[int(self._rng.integers(4))]
        off = np.array(GRID.centre_enu_m(route[0])) - self._position[:2]
        return ACTION_STEP[int(np.argmax(np.array(ACTION_STEP) @ off))]

    def _stay(self, seconds: float) -> None:
        for _ in range(int(seconds * self._rate_hz)):
            self._tick(np.zeros(3))

    def _fly(self) -> None:
        rng = self._rng
        self._stay(1.0)
        self._tell('GUIDED', True, False)
        self._tell('GUIDED', True, True)
        while self._position[2] < 4.9:
            self._tick(np.array([0.0, 0.0, 1.5]))
        route = list(GRID.waypoints)
        for _ in range(int(rng.integers(0, 20))):
            along = np.array([*self._direction(route), 0.0]) * rng.uniform(0.2, 1.5)
            ahead = self._position + along * 2.0
            inside = (ahead[:2] > -1.5).all() and (ahead[:2] < 5.5).all()
            for _ in range(int(2.0 * self._rate_hz)):
                self._tick(along if inside else np.zeros(3))
        while self._position[2] > 0.1:
            self._tick(np.array([0.0, 0.0, -1.5]))
        self._tell('GUIDED', True, False)
        self._tell('GUIDED', False, False)
        self._stay(1.0)


def give(into: Recorder, arrival: Arrival) -> None:
    _, kind, stamp_ns, value = arrival
    if kind == 'state':
        into.vehicle(value)
    elif kind == 'policy':
        into.policy(flies=value, stamp_ns=stamp_ns)
    else:
        (into.pose if kind == 'pose' else into.command)(stamp_ns, value)


def live(arrivals: list[Arrival]) -> Iterator[Demonstration]:
    into = Recorder(GRID, SETTINGS, 'made up', by_flights=True)
    polled_s = 0.0
    for arrival in arrivals:
        at_s = arrival.at_s
        while polled_s and polled_s + 0.05 < at_s:
            polled_s += 0.05
            yield from (output.demonstration for output in into.take(polled_s) if output.demonstration)
        polled_s = polled_s or at_s
        give(into, arrival)
    for wait_s in (0.1, 0.5, 6.0, 7.0):
        yield from (output.demonstration for output in into.take(at_s + wait_s) if output.demonstration)


def recorded(arrivals: list[Arrival]) -> Recording:
    """What a logger that hears the same keeps."""
    kinds: dict[str, list[Arrival]] = {kind: [] for kind in ('pose', 'command', 'state', 'policy')}
    before: dict[str, list[int]] = {kind: [] for kind in kinds}
    for one in arrivals:
        before[one.kind].append(len(kinds['pose']))
        kinds[one.kind].append(one)
    poses, commands = (
        (np.array([one.stamp_ns for one in kinds[kind]], dtype=np.int64),
         np.array([one.value for one in kinds[kind]], dtype=np.float64).reshape(-1, 3))
        for kind in ('pose', 'command')
    )
    ranks = (np.array(before[kind], dtype=np.int64) for kind in ('command', 'state', 'policy'))
    return Recording(
        PoseSamples(*poses), CommandSamples(*commands), tuple(one.value for one in kinds['state']),
        tuple(PolicyEvent(one.stamp_ns, one.value) for one in kinds['policy']), 'made up', (), Arrivals(*ranks),
    )


def test_live_and_offline_give_the_same_demonstrations() -> None:
    moves = ends = 0
    for seed in range(EXAMPLES):
        arrivals = World(seed).arrivals()
        expected = demonstrations_of(GRID, recorded(arrivals), SETTINGS)
        found = tuple(live(arrivals))
        assert [_told(one) for one in found] == [_told(one) for one in expected.demonstrations], f'seed {seed}: {expected.notes}'
        assert found == expected.demonstrations, f'seed {seed}'
        moves += sum(len(one.states) for one in found)
        ends += sum(one.end_reason is EndReason.FINAL_WAYPOINT for one in found)
    assert moves > EXAMPLES and ends, 'there is something to compare'


def _told(one: Demonstration) -> Any:
    return one.demonstration_id, one.window_ns, one.end_reason.name, one.states, one.actions, one.audit


@pytest.mark.parametrize('seed', range(5))
def test_the_order_of_polls_does_not_matter(seed: int) -> None:
    """Much comes at once on a busy machine."""
    arrivals = World(seed).arrivals()
    into = Recorder(GRID, SETTINGS, 'made up', by_flights=True)
    found = []
    for index, arrival in enumerate(arrivals):
        at_s = arrival.at_s
        give(into, arrival)
        if index % 97 == 0:
            found += [output.demonstration for output in into.take(at_s) if output.demonstration]
    found += [output.demonstration for wait_s in (1.0, 7.0, 8.0) for output in into.take(at_s + wait_s) if output.demonstration]
    assert tuple(found) == tuple(live(arrivals))
