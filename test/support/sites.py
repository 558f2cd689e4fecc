"""A site with an area to keep out of that its map does not say, flown by a clumsy person: something to ask about."""

from __future__ import annotations

import numpy as np

from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.session import Session
from advise_ros.experiments.sites import Site, flights_of, pilot_of, random_site

FLIGHTS = 5


def flown_site(seed: int = 0) -> tuple[Site, tuple[Demonstration, ...]]:
    """A 6 x 6 site and its flights."""
    site = random_site('6x6-4', np.random.default_rng([seed, 0]))
    return site, flights_of(site, pilot_of(site, 'errs', 0.4, 0.2, np.random.default_rng([seed, 1])), FLIGHTS)


def asking(seed: int = 0, enough: float = LearnSettings.enough) -> tuple[Site, Session]:
    """A session on it that has learnt from the flights; its question, if it has one, is open.

    Args:
        seed: of the site, the flights and the learner.
        enough: what saves less steps is not asked.
    """
    site, flights = flown_site(seed)
    session = Session(site.grid, LearnSettings(acquisition='site', seed=seed, enough=enough))
    for flight in flights:
        session.add(flight)
    session.learn()
    return site, session
