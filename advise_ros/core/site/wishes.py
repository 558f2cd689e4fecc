"""Kinds of wishes: what a cell can be to a person, and whether it is that on the whole route or on the way to one waypoint.

A map gives each cell a level: plain, to be kept out of, dear (a few steps more) or a corridor (cheaper than others). A kind
of wishes says which levels occur. `own` kinds have one map for all waypoints and one more for each of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.site.layout import Bytes, Layout
from advise_ros.core.site.plan import PARTS, PRICE

FREE, KEEP_OUT, DEAR, CORRIDOR = range(4)
# What a step along a corridor saves.
CORRIDOR_SAVES = 0.5
# What a dear or a corridor cell, and what one on the way to one waypoint only, is less likely than one to keep out of [nat].
GRADED_ODDS, OWN_ODDS = 0.3, 0.4


class CompiledWishes(NamedTuple):
    """A kind of wishes under one model of the pilot, in the form that compiled loops read.

    Attributes:
        own: 1: a map for all waypoints and one more for each; 0: the first alone.
        price: (levels,) of entering a cell.
        barred: (levels,) 1 for what is to be kept out of.
        odds: (levels,) log odds against a level beyond those against any mark.
        own_odds: log odds against a mark on the way to one waypoint only, beyond that.
    """

    own: int
    price: Ints
    barred: Bytes
    odds: Floats
    own_odds: float


@dataclass(frozen=True)
class Wishes:
    """A kind of wishes.

    Attributes:
        name: of the kind.
        graded: whether cells can be dear or corridors.
        own: whether areas can hold on the way to one waypoint only; not together with `graded`.
        dear: steps that a dear cell costs more than another.
    """

    name: str
    graded: bool = False
    own: bool = False
    dear: int = 3

    @property
    def parts(self) -> int:
        """Prices are whole numbers of so many parts of a step: corridors cost half of one."""
        return PARTS if self.graded else 1

    def n_places(self, layout: Layout) -> int:
        """Entries of a map: its cells, with `own` those of all its maps, the one for all waypoints first."""
        return layout.n_cells * (1 + layout.n_layers if self.own else 1)

    def prices(self, entry_price: int) -> Ints:
        """(levels,) of entering a cell, where one to keep out of costs `entry_price` steps."""
        steps = [1, entry_price, 1 + self.dear, 1 - CORRIDOR_SAVES]
        return np.array([round(self.parts * price) for price in steps[: 4 if self.graded else 2]], dtype=np.int64)

    def compiled(self, entry_price: int) -> CompiledWishes:
        """For compiled loops, where a cell to keep out of costs `entry_price` steps."""
        price = self.prices(entry_price)
        levels = np.arange(len(price))
        odds = np.where(levels > KEEP_OUT, GRADED_ODDS, 0.0)
        return CompiledWishes(int(self.own), price, (levels == KEEP_OUT).astype(np.uint8), odds, OWN_ODDS)

    @property
    def level_weights(self) -> Floats:
        """(levels,) what entering a cell costs beyond a step, in what entering a cell to keep out of does."""
        return np.array([0.0, 1.0, self.dear / PRICE, -CORRIDOR_SAVES / PRICE][: 4 if self.graded else 2])

    def levels(self, layout: Layout, maps: Bytes) -> Bytes:
        """(..., areas, cells) levels that hold on the way to each waypoint, one area if they are the same for all.

        Args:
            layout: the site and the route.
            maps: (..., places).
        """
        every = maps.reshape(*maps.shape[:-1], maps.shape[-1] // layout.n_cells, layout.n_cells)
        return np.where(every[..., 1:, :] > 0, every[..., 1:, :], every[..., :1, :]) if self.own else every

    def weights(self, layout: Layout, maps: Bytes) -> Floats:
        """(..., areas, cells) what entering costs beyond a step, in what entering a cell to keep out of does.

        Args:
            layout: the site and the route.
            maps: (..., places).
        """
        return self.level_weights[self.levels(layout, maps)]


ALIKE = Wishes('keep-out')
GRADED = Wishes('graded', graded=True)
ONE_WAYPOINT = Wishes('one-waypoint', own=True)
