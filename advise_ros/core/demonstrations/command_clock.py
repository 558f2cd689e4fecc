"""Commands on the clock of the positions: by when they were recorded, where they have no stamp or one of another clock."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.units import NS

Stamps = npt.NDArray[np.int64]

# Clocks that differ by less are one: messages are on their way for a while.
SAME_CLOCK_NS = NS
# A stream recorded at most this long after its stamps, and not before them, is late and on the recorder's clock.
LATE_NS, EARLY_NS = 10 * NS, NS // 2


class Arrived(NamedTuple):
    """A stream of messages as it was recorded.

    Attributes:
        stamps_ns: (n,) of the headers, 0 where there is none.
        log_ns: (n,) when each was recorded.
    """

    stamps_ns: Stamps
    log_ns: Stamps


class OnClock(NamedTuple):
    """Commands on the positions' clock.

    Attributes:
        stamps_ns: (m,).
        unstamped: how many had no stamp.
        ahead_ns: how far their own clock is ahead of the positions', 0 where it is the same.
    """

    stamps_ns: Stamps
    unstamped: int
    ahead_ns: int


def on_positions_clock(commands: Arrived, poses: Arrived, arrived: Stamps) -> OnClock:
    """Commands whose stamps are missing or of another clock get those that positions recorded at that time have.

    Two clocks are told apart by when their messages were recorded, not by which is right: simulated time, boot time and
    the time of day may all be far from the recorder's.

    Args:
        commands: (m,) messages.
        poses: (n,) messages, in order of arrival.
        arrived: (m,) how many positions had arrived before each command.
    """
    stamped = poses.stamps_ns > 0
    if not len(arrived) or not stamped.any():
        return OnClock(commands.stamps_ns, 0, 0)
    expected = _between(commands.log_ns, Arrived(poses.stamps_ns[stamped], poses.log_ns[stamped]), _counted(stamped, arrived))
    own = commands.stamps_ns > 0
    if own.any() and _is_another(Arrived(commands.stamps_ns[own], commands.log_ns[own]), poses, stamped, expected[own]):
        ahead_ns = int(np.median(commands.stamps_ns[own] - expected[own]))
        return OnClock(expected, int((~own).sum()), ahead_ns)
    return OnClock(np.where(own, commands.stamps_ns, expected), int((~own).sum()), 0)


def _counted(stamped: npt.NDArray[np.bool_], arrived: Stamps) -> Stamps:
    """How many stamped positions had arrived."""
    before: Stamps = np.concatenate([[0], np.cumsum(stamped)])[arrived]
    return before


def _between(log_ns: Stamps, poses: Arrived, arrived: Stamps) -> Stamps:
    """What the positions' clock showed when a command was recorded: between two positions in proportion, where it went on."""
    last = len(poses.stamps_ns) - 1
    before, after = np.clip(arrived - 1, 0, last), np.clip(arrived, 0, last)
    since_ns = log_ns - poses.log_ns[before]
    logged_ns, passed_ns = poses.log_ns[after] - poses.log_ns[before], poses.stamps_ns[after] - poses.stamps_ns[before]
    goes_on = (logged_ns > 0) & (passed_ns > 0) & (since_ns >= 0) & (since_ns <= logged_ns)
    share = np.where(goes_on, passed_ns / np.maximum(logged_ns, 1), 1.0)
    return np.asarray(np.maximum(poses.stamps_ns[before] + np.round(since_ns * share).astype(np.int64), 1))


def _is_another(commands: Arrived, poses: Arrived, stamped: npt.NDArray[np.bool_], expected_ns: Stamps) -> bool:
    """Whether the stamps of commands are of another clock than those of the positions."""
    if abs(np.median(commands.stamps_ns - expected_ns)) <= SAME_CLOCK_NS:
        return False
    delays_ns = (
        np.median(commands.log_ns - commands.stamps_ns), np.median(poses.log_ns[stamped] - poses.stamps_ns[stamped]),
    )
    return not all(-EARLY_NS <= delay_ns <= LATE_NS for delay_ns in delays_ns)
