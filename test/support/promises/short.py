"""A little of every promise that needs a flight, in one flight with each autopilot; tests run it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from support.promises import clocks, deaths, links
from support.promises.book import Book
from support.promises.deaths import Loss
from support.promises.rig import Settings, flying

CUT_S, BAD_S, LATE_S = 4.0, 2.0, 6.0


def with_ardupilot(folder: Path, rng: np.random.Generator, book: Book) -> None:
    """Two nodes killed, the clocks set, a bad radio and a late one, each once a round."""
    watches = clocks.Clocks(folder)
    try:
        with flying(folder, rng, Settings(env=watches.env)) as rig:
            for _ in book.rounds():
                deaths.take_away(rig, book, Loss('recorder', 'killed'), Loss('policy', 'killed'))
                clocks.set_them(rig, book, watches)
                links.disturb(rig, book, list(links.BAD)[-1], BAD_S)
                links.delay(rig, book, next(iter(links.LATE)), LATE_S)
    finally:
        watches.close()


def with_px4(folder: Path, rng: np.random.Generator, book: Book) -> None:
    """Two nodes stopped, and the radio cut, each once a round."""
    with flying(folder, rng, Settings('px4')) as rig:
        for _ in book.rounds():
            deaths.take_away(rig, book, Loss('logger', 'stopped'), Loss('mavlink_bridge', 'stopped'))
            links.cut(rig, book, CUT_S)
