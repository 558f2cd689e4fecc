"""The moves of a flight, many fixes at once: as CellTracker makes them fix by fix, in a fraction of the time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from advise_ros.core.grid.cell_tracker import CellTracker, Fix, Step
from advise_ros.core.grid.grid import ACTION_STEP, Action, Grid

# (east, north) cells moved -> action; other moves cross several borders.
MOVES = {step: int(action) for action, step in zip(Action, ACTION_STEP, strict=True)}


@dataclass
class CellTrack:
    """Moves in the order flown: state left, direction moved, when it was entered and left.

    Attributes:
        inserted: the cell was crossed between two fixes, with others.
        skips: cells that no fix lies in.
        breaks: stamp of, and a sentence about, each stretch of unknown moves.
    """

    states: list[int] = field(default_factory=list)
    motions: list[int] = field(default_factory=list)
    entered_ns: list[int] = field(default_factory=list)
    left_ns: list[int] = field(default_factory=list)
    inserted: list[bool] = field(default_factory=list)
    skips: int = 0
    breaks: list[tuple[int, str]] = field(default_factory=list)

    def add(self, state: int, motion: int, stamps_ns: tuple[int, int], *, inserted: bool = False) -> None:
        """Append one move.

        Args:
            state: in which it was made.
            motion: direction flown, as an action.
            stamps_ns: when the state was entered and left.
            inserted: the state was between two fixes and not seen itself.
        """
        self.states.append(state)
        self.motions.append(motion)
        self.entered_ns.append(stamps_ns[0])
        self.left_ns.append(stamps_ns[1])
        self.inserted.append(inserted)


class Follower:
    """The moves along fixes, all inside the grid, given in blocks of any size; they may be one fix each.

    Attributes:
        track: the moves so far.
        end_ns: when a terminal state was entered; what comes after is not looked at.
    """

    def __init__(self, tracker: CellTracker) -> None:
        self._tracker = tracker
        self._before: Fix | None = None
        self.track = CellTrack()
        self.entered_ns = 0
        self.end_ns: int | None = None

    @property
    def grid(self) -> Grid:
        return self._tracker.grid

    @property
    def state(self) -> int | None:
        """Where the vehicle is, None before the first fix."""
        return self._tracker.state

    def take(self, stamps_ns: npt.NDArray[np.int64], positions_enu_m: npt.NDArray[np.float64]) -> None:
        """The next fixes.

        Args:
            stamps_ns: (n,) ascending.
            positions_enu_m: (n, 2 or 3).
        """
        if self.end_ns is not None or not len(stamps_ns):
            return
        tracker, grid = self._tracker, self._tracker.grid
        here = grid.xy(grid.cell_of(tracker.state)) if tracker.state is not None else None
        rows, cells = tracker.path(positions_enu_m, here)
        for row, now_ns, there in zip(rows, stamps_ns[rows].tolist(), cells, strict=True):
            before = _fix(stamps_ns, positions_enu_m, row - 1) if row else self._before
            self._step(here, there, before, _fix(stamps_ns, positions_enu_m, row))
            if tracker.finished:
                self.end_ns = now_ns
                return
            here = there
        self._before = _fix(stamps_ns, positions_enu_m, len(stamps_ns) - 1)

    def _step(self, here: tuple[int, int] | None, there: tuple[int, int], before: Fix | None, now: Fix) -> None:
        tracker, grid = self._tracker, self._tracker.grid
        state, stamps_ns = tracker.state, (self.entered_ns, now.stamp_ns)
        self.entered_ns = now.stamp_ns
        if state is None or here is None or before is None:
            tracker.step(Fix(0, 0.0, 0.0), now)
            return
        motion = MOVES.get((there[0] - here[0], there[1] - here[1]))
        if motion is None:
            _record(self.track, grid, state, tracker.move(here, there, before, now), stamps_ns)
            return
        self.track.add(state, motion, stamps_ns)
        tracker.state = grid.enter(grid.next_waypoint(state), grid.cell(*there))


def _fix(stamps_ns: npt.NDArray[np.int64], positions_enu_m: npt.NDArray[np.float64], row: int) -> Fix:
    return Fix(int(stamps_ns[row]), float(positions_enu_m[row, 0]), float(positions_enu_m[row, 1]))


def _record(track: CellTrack, grid: Grid, state: int, step: Step, stamps_ns: tuple[int, int]) -> None:
    """A step over several borders."""
    if step.broken:
        here, there = (grid.xy(grid.cell_of(s)) for s in (state, step.states[0]))
        track.skips += abs(here[0] - there[0]) + abs(here[1] - there[1]) - 1
        track.breaks.append((stamps_ns[1], f'the moves from cell {list(here)} to {list(there)} are not known'))
        return
    track.skips += len(step.actions) - 1
    entered_ns, left_ns = stamps_ns
    for motion, after in zip(step.actions, step.states, strict=True):
        track.add(state, motion, (entered_ns, left_ns), inserted=len(step.actions) > 1)
        state, entered_ns = after, left_ns
