"""Runs trials: here, on several cores, or on a Dask cluster; results do not depend on where."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

from advise_ros.core.errors import InputError
from advise_ros.experiments.store import Store
from advise_ros.experiments.work import Task, perform
from advise_ros.parent import die_with_parent

Performer = Callable[[list[Task]], Iterator[tuple[Task, list[Any]]]]


def _paired(task: Task) -> tuple[Task, list[Any]]:
    return task, perform(task)


def here(tasks: list[Task]) -> Iterator[tuple[Task, list[Any]]]:
    """One after the other in this process."""
    return map(_paired, tasks)


class OnCores(NamedTuple):
    """Side by side in processes of this machine."""

    jobs: int

    def __call__(self, tasks: list[Task]) -> Iterator[tuple[Task, list[Any]]]:
        from joblib import Parallel, delayed  # noqa: PLC0415 - needed here only

        tied = {'initializer': die_with_parent, 'initargs': (os.getpid(),)}  # They would work on for half a minute.
        parallel = Parallel(self.jobs, return_as='generator_unordered', batch_size=1, **tied)
        results: Iterator[tuple[Task, list[Any]]] = parallel(delayed(_paired)(task) for task in tasks)
        return results


class OnDask(NamedTuple):
    """On an existing Dask cluster, whose workers have this package.

    Attributes:
        address: of the scheduler, tcp://host:port.
    """

    address: str

    def __call__(self, tasks: list[Task]) -> Iterator[tuple[Task, list[Any]]]:
        import distributed  # noqa: PLC0415 - takes a second

        dask: Any = distributed  # Typed in part only.

        try:
            client = dask.Client(self.address, timeout='10s', set_as_default=False)
        except (OSError, ValueError) as problem:
            raise InputError(f'no Dask scheduler answers at {self.address}; start one or check the address') from problem
        with client:
            futures = client.map(_paired, tasks, pure=False)
            for future in dask.as_completed(futures, loop=client.loop):
                yield self._result(future)

    def _result(self, future: Any) -> tuple[Task, list[Any]]:
        try:
            result: tuple[Task, list[Any]] = future.result()
        except Exception as problem:
            raise InputError(
                f'a worker of {self.address} failed ({type(problem).__name__}: {problem}); '
                'workers need this package, in the same version, and the files of your own domains'
            ) from problem
        return result


def run(tasks: Iterable[Task], store: Store, performer: Performer, progress: Callable[[int, int], None]) -> None:
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


def _missing(task: Task, store: Store) -> Task:
    wanted = [method for method, key in zip(task.methods, task.keys(), strict=True) if key not in store]
    return task._replace(methods=tuple(wanted))
