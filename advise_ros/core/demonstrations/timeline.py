"""One place for clocks: which stamps of a stream can be true, and where its clock was set back."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.units import NS

Stamps = npt.NDArray[np.int64]

# Stamps that follow each other closer than this, forward or backward, are of one clock.
STEP_NS = NS
# Up to this many samples in a row with stamps far from the others are strays; more mean that the clock was set or a gap.
STRAYS = 5
# Samples after a longer gap at the end of a recording are not believed without STRAYS others.
LAST_GAP_NS = 60 * NS


class Piece(NamedTuple):
    """Samples that arrived one after the other and are of one mind.

    Attributes:
        begin, end: their rows [begin, end), counted over all samples ever given.
        epoch: how often the clock had been set back before.
        sound: their stamps can be true.
        known_at: how many samples had arrived when the first of them was decided.
    """

    begin: int
    end: int
    epoch: int
    sound: bool
    known_at: int


class _Held(NamedTuple):
    """Samples far ahead of the newest, or behind, of which it is not yet known what they mean."""

    pieces: tuple[tuple[int, int], ...] = ()
    stamped: int = 0
    newest_ns: int = 0
    first_ns: int = 0
    behind: bool = False


class Timeline:
    """Sorts the stamps of one stream, given in order of arrival, in blocks of any size.

    A stamp that repeats or goes backward by up to STEP_NS is late, and sound. Further back or ahead, a few stamps are
    strays if the stream then goes on where it was. If it does not, stamps ahead were a gap, and stamps behind mean that the
    clock was set back, or that its source began anew: a new epoch. Until that is known the samples are held back.
    A stamp of 0 says nothing and stays where it arrived.
    """

    def __init__(self) -> None:
        self.epoch = 0
        self.newest_ns = 0
        self._last_ns = 0
        self._held = _Held()
        self._count = 0

    def take(self, stamps_ns: Stamps) -> list[Piece]:
        """The pieces that are decided, in order of arrival and without gaps.

        Args:
            stamps_ns: (n,) in order of arrival.
        """
        first = self._count
        self._count += len(stamps_ns)
        known = np.flatnonzero(stamps_ns > 0)
        if not known.size:
            return self._attach(first, self._count)
        stamps = stamps_ns[known]
        steps = np.abs(np.diff(stamps, prepend=self._last_ns or stamps[0])) > STEP_NS
        cuts = [0, *(cut for cut in np.flatnonzero(steps).tolist() if cut), len(stamps)]
        pieces = self._attach(first, first + int(known[0])) if known[0] else []
        for begin, end in pairwise(cuts):
            until = first + (int(known[end]) if end < len(known) else len(stamps_ns))
            pieces += self._take(first + known[begin:end], until, stamps[begin:end], jumped=bool(steps[begin]))
        self._last_ns = int(stamps[-1])
        return pieces

    def take_one(self, stamp_ns: int) -> list[Piece]:
        """As `take` of one stamp; at once where it follows the one before and nothing is held back.

        Args:
            stamp_ns: of the next arrival.
        """
        if self.holds or stamp_ns <= 0 or not self._last_ns or abs(stamp_ns - self._last_ns) > STEP_NS:
            return self.take(np.array([stamp_ns], dtype=np.int64))
        row = self._count
        self._count, self._last_ns, self.newest_ns = row + 1, stamp_ns, max(self.newest_ns, stamp_ns)
        return [Piece(row, row + 1, self.epoch, sound=True, known_at=row + 1)]

    def finish(self) -> list[Piece]:
        """No more samples come: what is held back, decided by what there is."""
        held = self._held
        near = not held.behind and held.first_ns - self.newest_ns <= LAST_GAP_NS
        return self._confirm(self._count) if near else self._drop(self._count)

    @property
    def holds(self) -> bool:
        """Samples are held back."""
        return bool(self._held.pieces)

    def _attach(self, begin: int, end: int) -> list[Piece]:
        if self.holds:
            self._held = self._held._replace(pieces=(*self._held.pieces, (begin, end)))
            return []
        return [Piece(begin, end, self.epoch, sound=True, known_at=begin + 1)] if begin < end else []

    def _take(self, rows: Stamps, until: int, stamps_ns: Stamps, *, jumped: bool) -> list[Piece]:
        """Samples of one mind, which end before row `until`."""
        begin, first_ns, newest_ns = int(rows[0]), int(stamps_ns[0]), int(stamps_ns.max())
        dropped = self._returned(first_ns, begin) if jumped else []
        if not self.holds and self.newest_ns and jumped and abs(first_ns - self.newest_ns) > STEP_NS:
            self._held = _Held((), 0, first_ns, first_ns, first_ns < self.newest_ns)
        elif not self.holds:
            self.newest_ns = max(self.newest_ns, newest_ns)
            return [*dropped, Piece(begin, until, self.epoch, sound=True, known_at=begin + 1)]
        held = self._held
        stamped, newest_ns = held.stamped + len(stamps_ns), max(held.newest_ns, newest_ns)
        self._held = held._replace(pieces=(*held.pieces, (begin, until)), stamped=stamped, newest_ns=newest_ns)
        if self._held.stamped <= STRAYS:
            return dropped
        return dropped + self._confirm(int(rows[STRAYS - held.stamped]) + 1)

    def _returned(self, first_ns: int, row: int) -> list[Piece]:
        """What is held back are strays where a stamp does not go on from it, unless it lies on the far side of it."""
        held = self._held
        if not self.holds:
            return []
        goes_on = first_ns >= held.newest_ns - STEP_NS and not (held.behind and first_ns >= self.newest_ns - STEP_NS)
        return [] if goes_on else self._drop(row + 1)

    def _drop(self, known_at: int) -> list[Piece]:
        held, self._held = self._held, _Held()
        return [Piece(*rows, self.epoch, sound=False, known_at=known_at) for rows in held.pieces]

    def _confirm(self, known_at: int) -> list[Piece]:
        held, self._held = self._held, _Held()
        if held.pieces:
            self.epoch += held.behind
            self.newest_ns = held.newest_ns
        return [Piece(*rows, self.epoch, sound=True, known_at=known_at) for rows in held.pieces]
