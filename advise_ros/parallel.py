"""Independent work side by side in processes of this machine, which end with this one."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from advise_ros.parent import die_with_parent

Item, Value = TypeVar('Item'), TypeVar('Value')


def on_cores(
    function: Callable[[Item], Value], items: Sequence[Item], jobs: int = 0, *, in_order: bool = True,
) -> Iterator[Value]:
    """The values of a function, each as soon as it is there.

    Args:
        function: what is computed, and all that it is given, can be pickled.
        items: one call each.
        jobs: processes at a time; 0: one a core. With one there is no other process.
        in_order: in the order of the items, else in the order in which they are done.
    """
    from joblib import Parallel, cpu_count, delayed  # type: ignore[import-untyped]  # noqa: PLC0415 - slow to load

    workers = min(jobs or cpu_count(), len(items))
    if workers <= 1:
        yield from map(function, items)
        return
    # joblib keeps its workers for half a minute; killed, this process would leave them behind.
    parallel = Parallel(
        workers, return_as='generator' if in_order else 'generator_unordered', batch_size=1,
        initializer=die_with_parent, initargs=(os.getpid(),),
    )
    yield from parallel(delayed(function)(item) for item in items)
