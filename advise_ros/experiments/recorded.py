"""Recorded flights in place of a simulated demonstrator: a dataset of `discretise` as a domain, or as a problem."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from advise_ros.core.demonstrations.demonstration import Counts, count
from advise_ros.core.errors import InputError
from advise_ros.core.grid.tables import occurring
from advise_ros.core.planning.process import Mdp, mdp_of
from advise_ros.domains import DOMAINS, find
from advise_ros.domains.domain import Domain
from advise_ros.domains.drone import GAMMA, route
from advise_ros.domains.file import changed_ns
from advise_ros.recording.dataset import DATASET_FILE, Dataset, is_dataset, load_dataset


@dataclass(frozen=True)
class Recorded:
    """The flights of a dataset as a demonstrator.

    Attributes:
        dataset: its directory or its dataset.yaml.
    """

    dataset: str

    def demonstrate(self, rng: np.random.Generator) -> Counts:
        """As many flights as there are, drawn with replacement: what other flights of that person could have been.

        So the intervals of a figure are those of the bootstrap (Efron 1979).
        """
        flights = _read(self.dataset).demonstrations
        return count(_read(self.dataset).grid, [flights[index] for index in rng.integers(len(flights), size=len(flights))])


def is_recorded(name: str) -> bool:
    """Whether the name of a domain is that of a dataset."""
    return name not in DOMAINS and is_dataset(name)


def file_of(dataset: str) -> Path:
    """dataset.yaml, which changes with everything that the dataset holds."""
    return Path(dataset) / DATASET_FILE if Path(dataset).is_dir() else Path(dataset)


def domain_of(name: str) -> Domain:
    """A domain of the paper by name, or a user's from an .npz file or a dataset.

    Raises:
        InputError: there is none, or its files are wrong.
    """
    return recorded_domain(name) if is_recorded(name) else find(name)


def recorded(path: str) -> tuple[Mdp, Counts]:
    """The grid of a dataset as a process, and what all its flights did.

    Raises:
        InputError: it cannot be read.
    """
    dataset = _read(path)
    return mdp_of(dataset.grid, 0.0, GAMMA), count(dataset.grid, dataset.demonstrations)


def recorded_domain(path: str) -> Domain:
    """The route of a dataset's grid, from where its flights began; it has the name of the directory.

    Raises:
        InputError: it cannot be read, or no flight begins where one can act.
    """
    return _domain(path, changed_ns(file_of(path)))


@lru_cache(maxsize=4)
def _domain(path: str, stamp_ns: int) -> Domain:
    dataset = _loaded(path, stamp_ns)
    acting = occurring(dataset.grid)
    starts = [flight.states[0] for flight in dataset.demonstrations if flight.states and acting[flight.states[0]]]
    if not starts:
        raise InputError(f'dataset {path} holds no flight with a move before its end; record some and make it again')
    return route(file_of(path).resolve().parent.name, dataset.grid, starts)


def _read(path: str) -> Dataset:
    return _loaded(path, changed_ns(file_of(path)))


@lru_cache(maxsize=4)
def _loaded(path: str, _: int) -> Dataset:
    return load_dataset(path)
