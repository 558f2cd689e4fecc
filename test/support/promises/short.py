"""A little of every promise that needs a flight, in one flight; tests run it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from support.promises import clocks, deaths, links
from support.promises.ledger import Row
from support.promises.rig import Settings, flying

CUT_S, BAD_S = 4.0, 2.0


def run(folder: Path, rng: np.random.Generator, trials: int) -> list[Row]:
    """Nodes taken away, clocks set, the radio cut and bad: `trials` times each."""
    watches = clocks.Clocks(folder)
    try:
        with flying(folder, rng, Settings(env=watches.env)) as rig:
            rows = deaths.take_away(rig, deaths.SHORT, trials)
            rows += clocks.set_them(rig, watches, trials)
            rows += links.cut(rig, trials, CUT_S)
            return rows + links.disturb(rig, list(links.BAD)[-1], trials, BAD_S)
    finally:
        watches.close()
