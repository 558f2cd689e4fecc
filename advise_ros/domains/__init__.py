"""The domains of the paper's evaluation (section 4), and the simulated people who demonstrate and advise in them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from advise_ros.core.errors import InputError
from advise_ros.domains.domain import Domain
from advise_ros.domains.drone import drone
from advise_ros.domains.sailing import sailing
from advise_ros.domains.traffic import traffic
from advise_ros.domains.wumpus import wumpus

DOMAINS: dict[str, Callable[[], Domain]] = {'wumpus': wumpus, 'sailing': sailing, 'traffic': traffic, 'drone': drone}


def find(name: str) -> Domain:
    """A domain of the paper by name, or a user's from an .npz file.

    Raises:
        InputError: there is no such domain or file, or the file holds none.
    """
    if name in DOMAINS:
        return DOMAINS[name]()
    if Path(name).suffix == '.npz':
        from advise_ros.domains.file import load_domain  # noqa: PLC0415 - for users of it only

        return load_domain(name)
    raise InputError(f"domain '{name}' is unknown; choose {', '.join(DOMAINS)}, an .npz file of your own, or a dataset")
