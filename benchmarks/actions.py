"""How many moves are given the action that their pilot meant: scripted people whose intentions are known, on bad vehicles.

    ./advise python benchmarks/actions.py [--seeds 30] [--flights 3] [--json FILE]

Pilots: taps of a key (0.25 s, as teleop sends them), keys held, sticks with diagonals and a late hand, and the simulated
pilot of the demo. Vehicles: as a real ArduCopter and a real PX4 were measured (coasting, wandering at 0.3 m/s), and
one in gusts. Rules: `last` is that of before (the last command before the border, at most 0.5 s old, else the motion),
`motion` looks at no command, `flown` is the one in use. A move counts as right when its action is the direction
that the pilot was steering for when he left the cell. Intervals: 95 %, by seeds (bootstrap).
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from advise_ros.core.demonstrations.demonstration import Demonstration, EndReason
from advise_ros.core.demonstrations.discretise import DiscretiseSettings, discretise
from advise_ros.core.demonstrations.samples import NO_COMMANDS, CommandSamples, PoseSamples, Recording
from advise_ros.core.flight.keyboard import Key, Stick
from advise_ros.core.flight.leg_follower import Pose
from advise_ros.core.flight.pilot_flight import PilotFlight
from advise_ros.core.flight.velocity_law import SeekSettings
from advise_ros.core.grid.cell_tracker import CellTracker
from advise_ros.core.grid.grid import ACTION_STEP, Action, Grid
from advise_ros.core.people.simulated_pilot import SimulatedPilot

GRID = Grid(2.0, 6, 6, (-1.0, -1.0), 5.0, waypoints=(5, 35, 30, 0))
SETTINGS = DiscretiseSettings()
NS, TICK_S = 1_000_000_000, 0.05
START_NS = 1000 * NS
LONGEST_S, MAX_MOVES = 400.0, 60
NOISE, MISTAKES = 0.25, 0.2
RESAMPLES = 2000
Point = np.ndarray


@dataclass(frozen=True)
class Manner:
    """How a vehicle follows velocities: first-order lag, dead time, a wandering error and gusts."""

    lag_s: float
    dead_s: float
    wander_m_s: float
    gust_m_s: float = 0.0


VEHICLES = {
    'ArduCopter': Manner(0.55, 0.1, 0.02),
    'PX4': Manner(0.7, 0.15, 0.3),
    'ArduCopter in gusts': Manner(0.55, 0.1, 0.05, 0.5),
}


class Vehicle:
    """A point that follows velocity commands badly."""

    def __init__(self, manner: Manner, rng: np.random.Generator) -> None:
        self._manner, self._rng = manner, rng
        self.position, self._velocity = np.zeros(2), np.zeros(2)
        self._wander, self._gust = rng.normal(0.0, manner.wander_m_s, 2), np.zeros(2)
        self._waiting = [np.zeros(2)] * max(1, round(manner.dead_s / TICK_S))

    def step(self, command: Point) -> None:
        manner, rng = self._manner, self._rng
        self._waiting.append(command)
        wanted = self._waiting.pop(0)
        self._wander = _towards(self._wander, manner.wander_m_s, 8.0, rng)
        self._gust = _towards(self._gust, manner.gust_m_s, 3.0, rng)
        self._velocity = self._velocity + (wanted - self._velocity) * TICK_S / manner.lag_s
        self.position = self.position + (self._velocity + self._wander + self._gust) * TICK_S


def _towards(value: Point, std: float, time_s: float, rng: np.random.Generator) -> Point:
    """One tick of an Ornstein-Uhlenbeck process."""
    return value * (1.0 - TICK_S / time_s) + rng.normal(0.0, std * math.sqrt(2.0 * TICK_S / time_s), 2)


class Pilot(Protocol):
    """Sees a position, commands a velocity (None: sends nothing); `meant` has (stamp, cell, action) of each intention."""

    meant: list[tuple[int, int, int]]
    over: bool

    def command(self, stamp_ns: int, position: Point) -> Point | None: ...


@dataclass
class Person:
    """Steers by hand for the centre of the cell that the next intention names, and notices late what the vehicle does."""

    demonstrator: SimulatedPilot
    rng: np.random.Generator
    hand: Hand
    meant: list[tuple[int, int, int]] = field(default_factory=list)
    over: bool = False

    def __post_init__(self) -> None:
        self._tracker = CellTracker(GRID, SETTINGS.hysteresis_m)
        self._seen: list[Point] = []
        self._target: int | None = None

    def command(self, stamp_ns: int, position: Point) -> Point | None:
        self._seen.append(position.copy())
        seen = self._seen[-1 - min(len(self._seen) - 1, round(self.hand.reaction_s / TICK_S))]
        state = self._tracker.update(float(position[0]), float(position[1]), stamp_ns)
        assert state is not None
        self.over = self._tracker.finished or len(self.meant) > MAX_MOVES
        cell = GRID.cell_of(state)
        if self.over:
            return np.zeros(2)
        arrived = cell == self._target and np.abs(seen - GRID.centre_enu_m(cell)).max() < self.hand.near_m
        if self._target is None or arrived or cell not in (self._target, self.meant[-1][1]):
            action = self.demonstrator.action(state)
            self._target = GRID.neighbour(cell, action)
            self.meant.append((stamp_ns, cell, action))
        elif cell == self._target:
            action = self.meant[-1][2]
        else:
            action = self.meant[-1][2]
        towards = np.array(GRID.centre_enu_m(self._target)) - seen
        return self.hand.move(stamp_ns, towards, action, self.rng)


class Hand(Protocol):
    """What a person's hand does to get somewhere."""

    reaction_s: float
    near_m: float

    def move(self, stamp_ns: int, towards: Point, action: int, rng: np.random.Generator) -> Point | None: ...


class Keys:
    """Arrow keys: along the way, and now and then across it to come back to the middle; zero for 1 s after, then nothing."""

    reaction_s, near_m = 0.25, 0.6

    def __init__(self, press_s: float, pause_s: float, speed_m_s: float = 1.0) -> None:
        self._press_s, self._pause_s, self._speed_m_s = press_s, pause_s, speed_m_s
        self._until_s = self._next_s = 0.0
        self._stick = Stick(speed_m_s, 0.5, press_s)

    def move(self, stamp_ns: int, towards: Point, action: int, rng: np.random.Generator) -> Point | None:
        now_s = stamp_ns / NS
        if now_s >= self._next_s:
            self._stick.press(_key(self._chosen(towards, action)), now_s)
            self._until_s = now_s + self._press_s
            self._next_s = self._until_s + self._pause_s * rng.uniform(0.5, 1.5)
        held = np.array(self._stick.velocity(now_s)[:2])
        return held if held.any() or now_s < self._until_s + 1.0 else None

    @staticmethod
    def _chosen(towards: Point, action: int) -> int:
        along = np.array(ACTION_STEP[action])
        across = towards - (towards @ along) * along
        if np.hypot(*across) > 0.4 and abs(towards @ along) < 1.6:
            return int(np.argmax(np.array(ACTION_STEP) @ across))
        return int(np.argmax(np.array(ACTION_STEP) @ ((towards @ along) * along)))


def _key(action: int) -> Key:
    return (Key.NORTH, Key.EAST, Key.SOUTH, Key.WEST)[action]


class Sticks:
    """Both axes at once, late and unsteady: the way is cut diagonally where the vehicle is off it."""

    reaction_s, near_m = 0.35, 0.6

    def __init__(self, speed_m_s: float = 1.0) -> None:
        self._speed_m_s = speed_m_s
        self._wobble = np.zeros(2)

    def move(self, stamp_ns: int, towards: Point, action: int, rng: np.random.Generator) -> Point | None:
        self._wobble = _towards(self._wobble, 0.25, 0.5, rng)
        distance = max(float(np.hypot(*towards)), 1e-6)
        return towards / distance * self._speed_m_s * min(1.0, distance / 0.7) + self._wobble


class Simulated:
    """The simulated pilot of the demo; his choice is his intention."""

    def __init__(self, demonstrator: SimulatedPilot) -> None:
        self.meant: list[tuple[int, int, int]] = []
        self.over = False
        self._stamp_ns = 0

        def choose(state: int) -> int:
            action = demonstrator.action(state)
            self.meant.append((self._stamp_ns, GRID.cell_of(state), action))
            return action

        self._flight = PilotFlight(GRID, choose, SeekSettings(), MAX_MOVES)

    def command(self, stamp_ns: int, position: Point) -> Point | None:
        self._stamp_ns = stamp_ns
        velocity = self._flight.step(Pose(stamp_ns, (float(position[0]), float(position[1]), GRID.altitude_m)))
        self.over = bool(self._flight.ending)
        return np.array(velocity[:2])


PILOTS: dict[str, Callable[[SimulatedPilot, np.random.Generator], Pilot]] = {
    'taps of 0.25 s': lambda who, rng: Person(who, rng, Keys(0.25, 0.5)),
    'keys held': lambda who, rng: Person(who, rng, Keys(0.8, 0.15)),
    'sticks': lambda who, rng: Person(who, rng, Sticks()),
    'the simulated pilot': lambda who, rng: Simulated(who),
}


class Flown(NamedTuple):
    """A flight and what was meant in it."""

    recording: Recording
    meant: list[tuple[int, int, int]]


def fly(pilot_name: str, manner: Manner, seed: int, number: int) -> Flown:
    """One flight along the route."""
    rng = np.random.default_rng((seed, number))
    demonstrator = SimulatedPilot(GRID, NOISE, MISTAKES, np.random.default_rng(seed))
    pilot, vehicle = PILOTS[pilot_name](demonstrator, rng), Vehicle(manner, rng)
    stamps, positions, command_stamps, velocities = [], [], [], []
    command: Point | None = None
    for tick in range(round(LONGEST_S / TICK_S)):
        stamp_ns = START_NS + tick * round(TICK_S * NS)
        vehicle.step(np.zeros(2) if command is None else command)
        stamps.append(stamp_ns)
        positions.append((*(vehicle.position + rng.normal(0.0, 0.02, 2)), GRID.altitude_m))
        command = pilot.command(stamp_ns, np.array(positions[-1][:2]))
        if command is not None:
            command_stamps.append(stamp_ns)
            velocities.append((*command, 0.0))
        if pilot.over:
            break
    poses = PoseSamples(np.array(stamps, dtype=np.int64), np.array(positions))
    commands = CommandSamples(np.array(command_stamps, dtype=np.int64), np.array(velocities).reshape(-1, 3))
    return Flown(Recording(poses, commands), pilot.meant)


# -- rules -----------------------------------------------------------------------------------------
def _cut(recording: Recording) -> Demonstration:
    return discretise(GRID, recording, (1, 2**62), SETTINGS, 'x', EndReason.END_OF_LOG)


def flown_rule(recording: Recording) -> list[tuple[int, int, int]]:
    """(stamp left, cell, action) of each move by the rule in use."""
    found = _cut(recording)
    left = [*found.stamps_ns[1:], found.window_ns[1]]
    return [(at, GRID.cell_of(s), a) for at, s, a in zip(left, found.states, found.actions, strict=True)]


def motion_rule(recording: Recording) -> list[tuple[int, int, int]]:
    return flown_rule(recording._replace(commands=NO_COMMANDS))


def last_rule(recording: Recording) -> list[tuple[int, int, int]]:
    """The rule up to 0.1: the last command before the border."""
    commands = recording.commands
    found = []
    for left_ns, cell, motion in motion_rule(recording):
        row = int(np.searchsorted(commands.stamps_ns, left_ns, side='left')) - 1
        told = None
        if row >= 0 and left_ns - int(commands.stamps_ns[row]) <= SETTINGS.command_timeout_s * NS:
            told = direction(*commands.velocities_enu_m_s[row, :2].tolist(), SETTINGS.command_min_speed_m_s)
        found.append((left_ns, cell, motion if told is None else told))
    return found


def direction(east_m_s: float, north_m_s: float, min_speed_m_s: float) -> int | None:
    """The action that a velocity points at, None when it is too slow or near a diagonal."""
    east, north = abs(east_m_s), abs(north_m_s)
    if float(np.hypot(east, north)) < min_speed_m_s or min(east, north) > 0.9 * max(east, north) or east == north:
        return None
    if east > north:
        return int(Action.EAST if east_m_s > 0 else Action.WEST)
    return int(Action.NORTH if north_m_s > 0 else Action.SOUTH)


RULES = {'last': last_rule, 'motion': motion_rule, 'flown': flown_rule}


def right(moves: list[tuple[int, int, int]], meant: list[tuple[int, int, int]]) -> tuple[int, int]:
    """Moves whose action was meant, and moves whose intention is known."""
    good = known = 0
    for left_ns, cell, action in moves:
        intention = next((a for at, c, a in reversed(meant) if at <= left_ns and c == cell), None)
        if intention is not None:
            known += 1
            good += action == intention
    return good, known


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seeds', type=int, default=30)
    parser.add_argument('--flights', type=int, default=3, help='flights of each seed')
    parser.add_argument('--json', type=Path)
    options = parser.parse_args()
    results = {}
    print('| pilot | vehicle | moves | ' + ' | '.join(RULES) + ' |')
    print('| --- | --- | --- | ' + ' | '.join('---' for _ in RULES) + ' |')
    for pilot in PILOTS:
        for vehicle, manner in VEHICLES.items():
            counts = _counts(pilot, manner, options.seeds, options.flights)
            shares = {rule: _interval(rows) for rule, rows in counts.items()}
            results[f'{pilot}, {vehicle}'] = shares
            moves = int(sum(known for _, known in counts['motion']))
            said = ' | '.join(f'{share:.1%} ({low:.1%}-{high:.1%})' for share, low, high in shares.values())
            print(f'| {pilot} | {vehicle} | {moves} | {said} |', flush=True)
    if options.json:
        options.json.write_text(json.dumps(results, indent=1))


def _counts(pilot: str, manner: Manner, seeds: int, flights: int) -> dict[str, list[tuple[int, int]]]:
    counts: dict[str, list[tuple[int, int]]] = {rule: [] for rule in RULES}
    for seed in range(seeds):
        flown = [fly(pilot, manner, seed, number) for number in range(flights)]
        for rule, moves_of in RULES.items():
            pairs = [right(moves_of(one.recording), one.meant) for one in flown]
            counts[rule].append((sum(good for good, _ in pairs), sum(known for _, known in pairs)))
    return counts


def _interval(rows: list[tuple[int, int]]) -> tuple[float, float, float]:
    """Share, and its 95 % interval over seeds."""
    values = np.array(rows, dtype=float)
    chosen = np.random.default_rng(0).integers(len(values), size=(RESAMPLES, len(values)))
    sums = values[chosen].sum(axis=1)
    low, high = np.quantile(sums[:, 0] / sums[:, 1], (0.025, 0.975))
    return float(values[:, 0].sum() / values[:, 1].sum()), float(low), float(high)


if __name__ == '__main__':
    main()
