"""The action of each move: what was flown, with what was commanded as evidence of what the pilot meant."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.flight_modes import Mover
from advise_ros.core.demonstrations.samples import CommandSamples
from advise_ros.core.grid.cell_path import CellTrack
from advise_ros.core.grid.grid import ACTION_STEP
from advise_ros.core.units import NS

# A vehicle coasts: a command goes on to move it this long after it has ended. (A real ArduCopter stands 1.9 s after a
# zero at 2 m/s, a real PX4 after 3 s.) A border that is crossed later than that after every command was drifted over.
COAST_NS = 3 * NS
# The direction flown counts as commanded when the commands made for it at least this share of the way that they made
# for the direction they wanted most.
SUPPORT_SHARE = 0.25
# A command that moved it less than this share of a cell is no evidence against the motion.
LEAST_SHARE = 0.25

Stamps = npt.NDArray[np.int64]
# (n, 2): rows of (east, north).
STEPS = np.array(ACTION_STEP, dtype=np.float64)


class ActionVerdict(Enum):
    """How an action was decided."""

    AGREED = 'the command and the motion agree'
    BY_MOTION = 'no command is clear enough: the motion decides'
    ASTRAY = 'the vehicle went elsewhere than commanded all the way: the command is the action'
    DRIFTED = 'nothing was commanded: nobody made this move'
    ITSELF = 'the autopilot made this move by itself'

    @property
    def is_action(self) -> bool:
        """Somebody made the move."""
        return self not in (ActionVerdict.DRIFTED, ActionVerdict.ITSELF)


class Decided(NamedTuple):
    """The action of a move and how it was decided."""

    action: int
    verdict: ActionVerdict


class Commands:
    """The commands of a recording, by the way [m] that they made for each direction between two stamps.

    A command holds until the next one, at most `timeout_s`; one below `min_speed_m_s` (over ground) commands no way.
    Commands that are not numbers are passed over. They may be given in any order.
    """

    def __init__(self, commands: CommandSamples, min_speed_m_s: float, timeout_s: float) -> None:
        finite = np.isfinite(commands.velocities_enu_m_s).all(axis=1) & (commands.stamps_ns > 0)
        stamps_ns, velocities = commands.stamps_ns[finite], commands.velocities_enu_m_s[finite, :2]
        order = np.argsort(stamps_ns, kind='stable')
        self._stamps_ns: Stamps = stamps_ns[order]
        fast = np.hypot(*velocities[order].T) >= min_speed_m_s
        # (n, 4): speed towards each direction [m/s].
        self._towards = np.where(fast[:, None], np.maximum(velocities[order] @ STEPS.T, 0.0), 0.0)
        timeout_ns = round(timeout_s * NS)
        lasts = np.diff(self._stamps_ns, append=self._stamps_ns[-1:] + timeout_ns)
        self._held_ns = np.minimum(lasts, timeout_ns)
        before = np.cumsum(self._towards * (self._held_ns / NS)[:, None], axis=0)
        self._way_m = np.vstack([np.zeros((1, 4)), before])
        # When the last moving command up to each one ended.
        ended = np.where(fast, self._stamps_ns + self._held_ns, np.iinfo(np.int64).min)
        self._moving_until_ns = np.maximum.accumulate(ended) if len(ended) else ended

    def __len__(self) -> int:
        return len(self._stamps_ns)

    def way_m(self, begin_ns: Stamps, end_ns: Stamps) -> npt.NDArray[np.float64]:
        """Distance commanded towards each direction between two stamps.

        Args:
            begin_ns, end_ns: (n,) half-open intervals.

        Returns:
            (n, 4) [m], by action.
        """
        return self._until(end_ns) - self._until(begin_ns)

    def _until(self, stamps_ns: Stamps) -> npt.NDArray[np.float64]:
        if not len(self):
            return np.zeros((len(stamps_ns), 4))
        row = np.searchsorted(self._stamps_ns, stamps_ns, side='right') - 1
        at = np.maximum(row, 0)
        held_s = np.clip(stamps_ns - self._stamps_ns[at], 0, self._held_ns[at]) / NS
        way: npt.NDArray[np.float64] = self._way_m[at] + self._towards[at] * held_s[:, None]
        return way

    def held(self, action: int, begin_ns: int, end_ns: int) -> tuple[float, int]:
        """The longest way [m] that commands in [begin_ns, end_ns) made for a direction, less what they took back meanwhile.

        Args:
            action: the direction.
            begin_ns, end_ns: the half-open interval.

        Returns:
            The way, and the stamp of the last command that made it (-1 for none).
        """
        rows = slice(*np.searchsorted(self._stamps_ns, (begin_ns, end_ns)).tolist())
        towards = self._towards[rows, action] - self._towards[rows, (action + 2) % 4]
        way_m = np.cumsum(np.concatenate([[0.0], towards * (self._held_ns[rows] / NS)]))
        net_m = way_m - np.minimum.accumulate(way_m)
        last = int(np.argmax(net_m))
        return float(net_m[last]), int(self._stamps_ns[rows][last - 1]) if last else -1

    def quiet_ns(self, stamps_ns: Stamps) -> Stamps:
        """How long before each stamp the last moving command ended.

        Args:
            stamps_ns: (n,) ascending or not.

        Returns:
            (n,) [ns]; 0 while a command holds, huge where there was none.
        """
        row = np.searchsorted(self._stamps_ns, stamps_ns, side='left') - 1
        if not len(self):
            return np.full(len(stamps_ns), np.iinfo(np.int64).max)
        until = self._moving_until_ns[np.maximum(row, 0)]
        never = (row < 0) | (until == np.iinfo(np.int64).min)
        since: Stamps = np.where(never, np.iinfo(np.int64).max, np.maximum(stamps_ns - np.where(never, 0, until), 0))
        return since


def decide(
    commands: Commands, track: CellTrack, movers: list[Mover], resolution_m: float, *, commanded: bool,
) -> list[Decided]:
    """The action of each move, by its direction and the commands given from when its cell was entered until it was left.

    The action is the direction flown. Where the commands wanted another one all the way (the direction flown has less
    than SUPPORT_SHARE of the way commanded for it) the vehicle was pushed: the direction commanded is the action, if
    its commands made LEAST_SHARE of a cell's way. A
    move that comes COAST_NS after the last moving command is a drift, nobody's action. Where there are no commands, or
    others move the vehicle, the motion decides; a move that the autopilot makes by itself is nobody's action.

    Args:
        movers: what moved the vehicle at the end of each move.
        commanded: commands are recorded, so that where there is none, none was given.
    """
    entered, left = (np.asarray(stamps, dtype=np.int64) for stamps in (track.entered_ns, track.left_ns))
    ways_m, quiet_ns = commands.way_m(entered, left), commands.quiet_ns(left)
    rows = zip(track.motions, track.inserted, movers, ways_m, quiet_ns.tolist(), strict=True)
    return [
        _decided(motion, mover, None if inserted else way_m / resolution_m, quiet, commanded=commanded)
        for motion, inserted, mover, way_m, quiet in rows
    ]


def _decided(
    motion: int, mover: Mover, way: npt.NDArray[np.float64] | None, quiet_ns: int, *, commanded: bool,
) -> Decided:
    if mover is Mover.ITSELF:
        return Decided(motion, ActionVerdict.ITSELF)
    if mover is Mover.STICKS or not commanded:
        return Decided(motion, ActionVerdict.BY_MOTION)
    if quiet_ns > COAST_NS:
        return Decided(motion, ActionVerdict.DRIFTED)
    if way is None or not way.any():
        return Decided(motion, ActionVerdict.BY_MOTION)
    wanted = int(np.argmax(way))
    if way[motion] >= SUPPORT_SHARE * way[wanted]:
        return Decided(motion, ActionVerdict.AGREED)
    return Decided(wanted, ActionVerdict.ASTRAY) if way[wanted] >= LEAST_SHARE else Decided(motion, ActionVerdict.BY_MOTION)

