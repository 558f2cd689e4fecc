"""What was learnt of a site, for another route over it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from advise_ros.core.numerics import Floats
from advise_ros.core.site.belief import CELL_PRICE, SiteBelief
from advise_ros.core.site.layout import Layout

# A cell is never believed for certain: the site may have changed, or the model of the pilot was wrong.
LEAST_DOUBT = 0.02


def for_route(belief: SiteBelief, layout: Layout) -> SiteBelief:
    """The same maps for another route over the site, before anything is said or flown on it.

    A cell that the new route visits as a waypoint or begins in is one that the person does not keep out of.

    Args:
        belief: what was learnt of the site.
        layout: the new route over the same cells.
    """
    return replace(
        belief, maps=belief.maps * (1 - layout.open_cells), doubting=belief.doubting * (1 - layout.open_cells), answers=(),
        pilots=(),
    )


def as_prior(keep_out: Floats) -> Floats:
    """(cells,) log odds against each cell, for learning from new flights; cells of which nothing is known have CELL_PRICE.

    Args:
        keep_out: (cells,) probabilities that were kept; NaN where nothing is known.
    """
    share = np.clip(keep_out, LEAST_DOUBT, 1.0 - LEAST_DOUBT)
    return np.where(np.isnan(keep_out), CELL_PRICE, np.log1p(-share) - np.log(share))
