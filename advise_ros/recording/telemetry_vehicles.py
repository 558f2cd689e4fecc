"""Whose positions a telemetry log holds: vehicles by system id, and those that share one by their time since boot.

A ground station with two links to a vehicle logs each message twice, the second time late; one that has seen several
vehicles with one system id mixes them. Both show in `time_boot_ms`: https://mavlink.io/en/messages/common.html#LOCAL_POSITION_NED.
"""

from __future__ import annotations

import string
from array import array
from bisect import bisect_left
from collections.abc import Hashable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.timeline import STEP_NS, STRAYS
from advise_ros.core.errors import LogError
from advise_ros.mavlink.stamps import NS_PER_MS, REBOOT_MS
from advise_ros.recording.climbs import those_that_fly

Integers = npt.NDArray[np.int64]

# Positions of one boot are this close by their time since boot: a slow link's, or else those of two vehicles.
APART_MS = (REBOOT_MS, 250)


class Fixes(NamedTuple):
    """Positions in the order of a log.

    Attributes:
        rows: (n,) their places in the log.
        senders: (n, 2) system and component.
        stamps_ns: (n,) when they were logged.
        time_boot_ms: (n,) the sender's time since boot.
        positions_ned_m: (n, 3).
    """

    rows: Integers
    senders: Integers
    stamps_ns: Integers
    time_boot_ms: Integers
    positions_ned_m: npt.NDArray[np.float64]

    def at(self, which: Integers | npt.NDArray[np.bool_]) -> Fixes:
        """Some of them, in their order."""
        if len(self.rows) == (int(which.sum()) if which.dtype == np.bool_ else len(which)):
            return self  # All of them: a long log has many.
        rows, senders, stamps_ns, time_boot_ms, positions_ned_m = (one[which] for one in self)
        return Fixes(rows, senders, stamps_ns, time_boot_ms, positions_ned_m)  # type: ignore[arg-type]


class TelemetryVehicle(NamedTuple):
    """The positions of one vehicle, each once, in the order of the log.

    Attributes:
        name: its system id, with a letter where several share it.
        sender: system and component.
        repeated: positions that a second link brought, and by how much they were late at most [s].
        alone: no other vehicle sends with its ids.
    """

    name: str
    sender: tuple[int, int]
    fixes: Fixes
    repeated: int
    lag_s: float
    alone: bool

    @property
    def climb_m(self) -> float:
        """The highest position less the lowest."""
        heights_m = self.fixes.positions_ned_m[:, 2]
        heights_m = heights_m[np.isfinite(heights_m)]
        return float(np.ptp(heights_m)) if len(heights_m) else 0.0


def vehicles_of(fixes: Fixes) -> list[TelemetryVehicle]:
    """The vehicles in a log, in the order of their names.

    Args:
        fixes: all positions.
    """
    found: list[TelemetryVehicle] = []
    senders = sorted({(int(system), int(component)) for system, component in np.unique(fixes.senders, axis=0)})
    for sender in senders:
        own = fixes.at((fixes.senders == sender).all(axis=1))
        several = _vehicles(own)
        shares = len(several) > 1 or sum(system == sender[0] for system, _ in senders) > 1
        for boots in several:
            number = sum(one.sender[0] == sender[0] for one in found)
            name = f'{sender[0]}{string.ascii_lowercase[number % 26] if shares else ""}'
            kept = np.sort(np.concatenate([np.array(boot.news, dtype=np.int64) for boot in boots]))
            repeated, lag_ms = sum(boot.repeated for boot in boots), max(boot.lag_ms for boot in boots)
            found.append(TelemetryVehicle(name, sender, own.at(kept), repeated, lag_ms / 1000, len(several) == 1))
    return found


def choose_vehicle(path: object, vehicles: Sequence[TelemetryVehicle], asked: str) -> TelemetryVehicle:
    """The one asked for, or else the one that flies, with most positions where several do.

    Args:
        path: of the log, for people.
        vehicles: at least one.
        asked: its name, '' for any.

    Raises:
        LogError: there is none of that name.
    """
    named = {one.name: one for one in vehicles}
    if asked:
        if asked not in named:
            raise LogError(f'{path} has positions of vehicle {", ".join(named)}, not of {asked!r}; name one (--vehicle)')
        return named[asked]
    return max(those_that_fly(vehicles, lambda one: one.climb_m), key=lambda one: len(one.fixes.rows))


# -- boots -----------------------------------------------------------------------------------------
class _Boot:
    """Positions of one sender whose time since boot keeps its distance from the log's clock.

    Attributes:
        news: which they are, in ascending order of their times.
        offset_ms: that distance, at the newest position.
        repeated: how many came again or were overtaken, and by how much the latest of them was late.
        strange: how many of those had not come before.
        over: both clocks were set back since.
    """

    def __init__(self, fixes: Fixes, offset_ms: float, news: Sequence[int] = ()) -> None:
        self._fixes, self.offset_ms = fixes, offset_ms
        self.news = array('q', news)
        self._times_ms = array('q')
        self.repeated = self.strange = 0
        self.lag_ms = 0.0
        self.over = False

    def take(self, index: int, time_ms: int, offset_ms: float) -> bool:
        """A further position, or False where both clocks were set back since the newest one."""
        if not self._times_ms or time_ms > self._times_ms[-1]:
            self.news.append(index)
            self._times_ms.append(time_ms)
            self.offset_ms = offset_ms
            return True
        if self._fixes.stamps_ns[index] < self._fixes.stamps_ns[self.news[-1]] - STEP_NS:
            return False
        self.repeated += 1
        self.strange += not self.has(index, time_ms)
        self.lag_ms = max(self.lag_ms, offset_ms - self.offset_ms)
        return True

    def has(self, index: int, time_ms: int) -> bool:
        """Whether it holds the same position."""
        at = bisect_left(self._times_ms, time_ms)
        if at == len(self._times_ms) or self._times_ms[at] != time_ms:
            return False
        same = self._fixes.positions_ned_m[self.news[at]] == self._fixes.positions_ned_m[index]
        return bool(same.all())

    def is_copy_of(self, other: _Boot) -> bool:
        """It overlaps with the other and brings the same, later: a very slow link."""
        if self.news[0] > other.news[-1]:
            return False
        return sum(map(other.has, self.news, self._times_ms)) > len(self.news) / 2

    def add_copy(self, copy: _Boot) -> None:
        """What a very slow link brought again."""
        self.repeated += len(copy.news)
        self.lag_ms = max(self.lag_ms, copy.offset_ms - self.offset_ms)


def _vehicles(fixes: Fixes) -> list[list[_Boot]]:
    """The boots of each vehicle behind one sender: those of one vehicle follow each other."""
    boots = next(filter(_are_sound, (_boots(fixes, apart_ms) for apart_ms in APART_MS)), None)
    if boots is None:  # Their time since boot says nothing.
        return [[_Boot(fixes, 0.0, range(len(fixes.rows)))]]
    few = [boot for boot in boots if len(boot.news) <= STRAYS]
    vehicles: list[list[_Boot]] = []
    for boot in sorted((boot for boot in boots if len(boot.news) > STRAYS), key=lambda boot: boot.news[0]):
        original = next((one for several in vehicles for one in several if boot.is_copy_of(one)), None)
        before = [several for several in vehicles if several[-1].news[-1] < boot.news[0]]
        if original is not None:
            original.add_copy(boot)
        elif before:  # A reboot, or the log's clock was set; of several, the one whose time goes on.
            times_ms = fixes.time_boot_ms
            min(before, key=lambda several: abs(times_ms[boot.news[0]] - times_ms[several[-1].news[-1]])).append(boot)
        else:
            vehicles.append([boot])
    if not vehicles:
        return [few]
    vehicles[0] += few  # Stamps far from the others: the timeline of the positions sorts them out.
    return vehicles


def _boots(fixes: Fixes, apart_ms: float) -> list[_Boot]:
    """Positions whose times since boot are at most so far apart from the log's clock are of one boot."""
    boots: list[_Boot] = []
    offsets_ms = (fixes.stamps_ns / NS_PER_MS - fixes.time_boot_ms).tolist()
    for index, (time_ms, offset_ms) in enumerate(zip(fixes.time_boot_ms.tolist(), offsets_ms, strict=True)):
        near = [boot for boot in boots if not boot.over and abs(boot.offset_ms - offset_ms) <= apart_ms]
        of = min(near, key=lambda boot: abs(boot.offset_ms - offset_ms), default=None)
        if of is not None and of.take(index, time_ms, offset_ms):
            continue
        if of is not None:
            of.over = True
        boots.append(_Boot(fixes, offset_ms))
        boots[-1].take(index, time_ms, offset_ms)
    return boots


def _are_sound(boots: list[_Boot]) -> bool:
    """What came again is the same as before: otherwise several vehicles are mixed, or none counts its time."""
    return all(boot.strange <= boot.repeated / 2 for boot in boots)


# -- the same, twice -------------------------------------------------------------------------------
def without_echoes(said: Sequence[tuple[int, Hashable]], lag_ns: int) -> list[int]:
    """Rows of the messages that are news where a second link brings each of them again, up to `lag_ns` later.

    What was true before a change is no news that soon after it.

    Args:
        said: stamp and contents of each, in the order of the log.
        lag_ns: the second link's delay at most.
    """
    kept: list[int] = []
    replaced_ns: dict[Hashable, int] = {}
    now: Hashable = None
    for row, (stamp_ns, contents) in enumerate(said):
        if kept and contents != now:
            if 0 <= stamp_ns - replaced_ns.get(contents, stamp_ns + 1) <= lag_ns:
                continue
            replaced_ns[now] = stamp_ns
        now = contents
        kept.append(row)
    return kept
