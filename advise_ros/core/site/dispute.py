"""What a question decides: the cells whose keep-out its answer tells, and what either answer says and leads to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.site.layout import Bytes, Layout
from advise_ros.core.site.plan import barred, plan, route

# As many cells as a person grasps at a glance.
MOST_CELLS = 12
# Cells belong to one area where maps mark them together: correlation with the first cell.
TOGETHER = 0.5


class SiteOption(NamedTuple):
    """One of the two answers.

    Attributes:
        preferred, avoided: what it says of all states asked about, ascending actions.
        route: states that would be flown from the start, by what would then be believed.
    """

    preferred: tuple[int, ...]
    avoided: tuple[int, ...]
    route: tuple[int, ...]


class Dispute(NamedTuple):
    """What a question decides.

    Attributes:
        cells: that the answer tells to keep out of or not, ascending; they lie together.
        keep_out, fly_through: the two answers.
    """

    cells: tuple[int, ...]
    keep_out: SiteOption
    fly_through: SiteOption


def dispute_of(layout: Layout, maps: Bytes | Floats, codes: Ints) -> Dispute | None:
    """What the answer to a question decides; None where no cell goes with it.

    Args:
        layout: the site and the route.
        maps: (m, cells) or (m, layers, cells) that are believed possible, as of `SiteBelief`.
        codes: (m,) the answer under each, as 16 * preferred + avoided.
    """
    known, which = np.unique(codes, return_inverse=True)
    marked, said = barred(maps).astype(np.float64), np.eye(len(known))[which.ravel()]
    telling = _telling(marked, said)
    first = int(telling.argmax())
    if telling[first] <= 0.0:
        return None
    cells = _area(layout, first, _together(marked, first))
    inside = marked[:, cells].mean(axis=1) > 0.5
    if inside.all() or not inside.any():
        return None
    kept, through = said[inside].mean(axis=0), said[~inside].mean(axis=0)
    keep, fly = int(kept.argmax()), int(through.argmax())
    if keep == fly:
        keep, fly = int((kept - through).argmax()), int((kept - through).argmin())
    return Dispute(
        tuple(sorted(cells)), _option(layout, maps[inside], int(known[keep])), _option(layout, maps[~inside], int(known[fly])),
    )


def _telling(marked: Floats, said: Floats) -> Floats:
    """(cells,) how much the mark of each cell tells of the answer: how far apart the answers lie with and without it, weighed.

    Args:
        marked: (m, cells) 1 for cells to keep out of.
        said: (m, answers) 1 for the answer under each map.
    """
    maps, with_it = len(marked), marked.sum(axis=0)
    together = marked.T @ said
    share_with = together / np.maximum(with_it, 1.0)[:, None]
    share_without = (said.sum(axis=0) - together) / np.maximum(maps - with_it, 1.0)[:, None]
    apart: Floats = np.abs(share_with - share_without).sum(axis=1) * (with_it / maps) * (1.0 - with_it / maps)
    return apart


def _together(marked: Floats, first: int) -> Floats:
    """(cells,) correlation of each cell's mark with that of the first."""
    off = marked - marked.mean(axis=0)
    spread = np.sqrt((off**2).sum(axis=0))
    shared: Floats = off.T @ off[:, first] / np.maximum(spread * spread[first], np.finfo(float).tiny)
    return shared


def _area(layout: Layout, first: int, together: Floats) -> list[int]:
    """The first cell and those connected with it that go with it, the closest ones first."""
    area = [first]
    while len(area) < MOST_CELLS:
        beside = {int(there) for cell in area for there in layout.beside[cell] if there >= 0} - set(area)
        near = sorted((cell for cell in beside if together[cell] >= TOGETHER), key=lambda cell: (-together[cell], cell))
        if not near:
            break
        area.append(near[0])
    return area


def _option(layout: Layout, maps: Bytes | Floats, code: int) -> SiteOption:
    preferred, avoided = (tuple(action for action in range(4) if mask >> action & 1) for mask in divmod(code, 16))
    way = route(layout, plan(layout, maps.mean(axis=0)).greedy)
    return SiteOption(preferred, avoided, tuple(way))
