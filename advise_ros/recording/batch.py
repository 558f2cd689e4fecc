"""Demonstrations out of many recordings at once: on all cores of this machine, or on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.flight_windows import flown_altitude_m
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of
from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.errors import InputError, LogError
from advise_ros.core.grid.grid import Grid
from advise_ros.parallel import on_cores
from advise_ros.recording.place import Place
from advise_ros.recording.progress import ProgressCallback
from advise_ros.recording.sources import read_recording
from advise_ros.recording.topics import DEFAULT_TOPICS, BagTopics

REASONS_SHOWN = 2
DEFAULT_SETTINGS = DiscretiseSettings()
CLUSTER_TIMEOUT_S = 15.0


@dataclass(frozen=True)
class ReadTask:
    """What is to be done with each recording.

    Attributes:
        undivided: take it as one flight.
        policy_flights: take flights of a policy, too.
        place: of the grid on the earth, where it is known.
    """

    grid: Grid
    settings: DiscretiseSettings = DiscretiseSettings()
    topics: BagTopics = DEFAULT_TOPICS
    undivided: bool = False
    policy_flights: bool = False
    place: Place | None = None


class RecordingResult(NamedTuple):
    """What one recording gave: demonstrations and remarks, or in one sentence why it gave none."""

    path: str
    demonstrations: tuple[Demonstration, ...]
    remarks: tuple[str, ...]
    failure: str = ''


def read_one(path: str, task: ReadTask, progress: ProgressCallback | None = None) -> RecordingResult:
    """The demonstrations of one recording; nothing that is wrong with it is raised."""
    try:
        return demonstrations_in(path, task, progress)
    except LogError as problem:
        return RecordingResult(path, (), (), str(problem))
    except (MemoryError, OSError, ValueError, LookupError, TypeError) as problem:  # One recording must not end the others.
        return RecordingResult(path, (), (), f'{path} cannot be read ({type(problem).__name__}: {problem}); please report it')


def demonstrations_in(path: str, task: ReadTask, progress: ProgressCallback | None = None) -> RecordingResult:
    """The demonstrations of one recording, or why it has none.

    Raises:
        LogError: it can't be read.
    """
    recording = read_recording(path, task.topics, progress, task.place)
    found = demonstrations_of(
        task.grid, recording, task.settings, undivided=task.undivided, policy_flights=task.policy_flights,
    )
    remarks = (recording.source, *(f'{path}: {note}' for note in (*recording.notes, *found.notes)))
    if found.demonstrations:
        return RecordingResult(path, found.demonstrations, remarks)
    reason = '; '.join(found.notes[:REASONS_SHOWN]) or why_no_flight(task.grid, recording, task.settings)
    further = ''.join(f' ({note})' for note in recording.notes[:REASONS_SHOWN])
    return RecordingResult(path, (), (), f'{recording.source} gives no demonstration on this grid: {reason}{further}')


def why_no_flight(grid: Grid, recording: Recording, settings: DiscretiseSettings = DEFAULT_SETTINGS) -> str:
    """Of a recording in which there is no flight."""
    stamps_ns, positions_enu_m = recording.poses
    numbers = np.isfinite(positions_enu_m).all(axis=1)
    if not numbers.any():
        return 'none of its positions is a number'
    if not (numbers & (stamps_ns != 0)).any():
        return 'none of its positions has a stamp; record them with header.stamp set'
    highest_m = positions_enu_m[numbers & (stamps_ns != 0), 2].max()
    high = highest_m >= flown_altitude_m(grid, settings.altitude_tolerance_m)
    if high and any(event.flies for event in recording.policy):
        return 'a policy flew, and no pilot (--policy-flights takes its flights, too)'
    if high and recording.events:
        return f'positions reach {highest_m:.1f} m, but the state never says that the vehicle is in the air (--status-topic)'
    return f'no flight reaches {grid.altitude_m:g} m, the highest position is {highest_m:.1f} m'


def read_all(paths: Sequence[str], task: ReadTask, *, jobs: int, dask: str, done: Callable[[], None]) -> list[RecordingResult]:
    """All recordings, in the order of their paths; `done` is called as each of them is.

    Args:
        jobs: processes at a time, 0: one a core.
        dask: address of a Dask scheduler ('tcp://host:8786') whose workers see the same paths; '': this machine.

    Raises:
        InputError: there is no scheduler at that address.
    """
    found: list[RecordingResult] = []
    for one in _on_cluster(paths, task, dask) if dask else on_cores(partial(read_one, task=task), paths, jobs):
        found.append(one)
        done()
    return found


def _on_cluster(paths: Sequence[str], task: ReadTask, address: str) -> Iterator[RecordingResult]:
    from distributed import Client  # noqa: PLC0415  slow to load

    try:
        client: Any = Client(address, timeout=CLUSTER_TIMEOUT_S)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TimeoutError) as problem:
        raise InputError(f'no Dask scheduler answers at {address!r} ({problem}); start one, or leave --dask out') from None
    with client:
        futures = client.map(read_one, list(paths), task=task, pure=False)
        for path, future in zip(paths, futures, strict=True):
            try:
                yield future.result()
            except Exception as problem:  # noqa: BLE001  a worker may lack the package, or die
                yield RecordingResult(path, (), (), f'{path}: a worker of {address} failed ({type(problem).__name__}: {problem})')
