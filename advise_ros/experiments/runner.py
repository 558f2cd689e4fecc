"""Runs trials: here, on several cores, or on a Dask cluster; results do not depend on where."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from typing import Any, NamedTuple, Protocol

from advise_ros.core.errors import InputError
from advise_ros.experiments.store import Store
from advise_ros.parallel import on_cores

ADDRESS = re.compile(r'(?:(?:tcp|tls|ws|wss|ucx)://)?[^/\s]+:\d{1,5}')
# A scheduler that is there answers at once.
CONNECT_S = 10.0


class Trial(Protocol):
    """One trial of some methods: plain values that any process can perform."""

    @property
    def methods(self) -> tuple[Any, ...]: ...

    def keys(self) -> list[tuple[str, int]]:
        """Where the results of the methods are stored."""

    def perform(self) -> list[Any]:
        """The result of each method, as JSON has it."""

    def _replace(self, *, methods: tuple[Any, ...]) -> Trial: ...


Performer = Callable[[list[Trial]], Iterator[tuple[Trial, list[Any]]]]


def _paired(task: Trial) -> tuple[Trial, list[Any]]:
    return task, task.perform()


def here(tasks: list[Trial]) -> Iterator[tuple[Trial, list[Any]]]:
    """One after the other in this process."""
    return map(_paired, tasks)


class OnCores(NamedTuple):
    """Side by side in processes of this machine."""

    jobs: int

    def __call__(self, tasks: list[Trial]) -> Iterator[tuple[Trial, list[Any]]]:
        return on_cores(_paired, tasks, self.jobs, in_order=False)


class OnDask(NamedTuple):
    """On an existing Dask cluster, whose workers have this package.

    Attributes:
        address: of the scheduler, tcp://host:port.
    """

    address: str

    def __call__(self, tasks: list[Trial]) -> Iterator[tuple[Trial, list[Any]]]:
        import distributed  # noqa: PLC0415 - takes a second

        dask: Any = distributed  # Typed in part only.
        logging.getLogger('distributed.client').setLevel(logging.CRITICAL)  # What goes wrong is told in one sentence.
        with self._client(dask) as client:
            futures = client.map(_paired, tasks, pure=False)
            for future in dask.as_completed(futures, loop=client.loop):
                yield self._result(future)

    def _client(self, dask: Any) -> Any:
        if not ADDRESS.fullmatch(self.address):  # The client would try for half a minute and end in a traceback.
            raise InputError(f"'{self.address}' is no address of a Dask scheduler; give one like tcp://127.0.0.1:8786")
        try:
            return dask.Client(self.address, timeout=f'{CONNECT_S:g}s', set_as_default=False)
        except (OSError, ValueError) as problem:
            raise InputError(f'no Dask scheduler answers at {self.address}; start one or check the address') from problem

    def _result(self, future: Any) -> tuple[Trial, list[Any]]:
        try:
            result: tuple[Trial, list[Any]] = future.result()
        except CancelledError as problem:
            raise InputError(f'the Dask scheduler at {self.address} went away; start it and the same command again') from problem
        except Exception as problem:
            reason = str(problem).splitlines()[0] if str(problem) else 'no reason given'
            raise InputError(
                f'the Dask cluster at {self.address} failed ({type(problem).__name__}: {reason}); scheduler and workers '
                'need this package, in the same version, and the files of your own domains under the same paths'
            ) from problem
        return result


def run(tasks: Iterable[Trial], store: Store, performer: Performer, progress: Callable[[int, int], None]) -> None:
    """Perform what the store does not hold yet.

    Args:
        tasks: trials.
        store: of their results.
        performer: where they run.
        progress: told how many of how many are done.

    Raises:
        InputError: there is no such cluster.
    """
    every = list(tasks)
    missing = [left for task in every if (left := _missing(task, store)).methods]
    done = len(every) - len(missing)
    progress(done, len(every))
    for task, results in performer(missing) if missing else ():
        for key, result in zip(task.keys(), results, strict=True):
            store.add(key, result)
        done += 1
        progress(done, len(every))


def _missing(task: Trial, store: Store) -> Trial:
    wanted = [method for method, key in zip(task.methods, task.keys(), strict=True) if key not in store]
    return task._replace(methods=tuple(wanted))
