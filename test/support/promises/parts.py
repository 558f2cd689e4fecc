"""The promises cut into parts, each in a graph of its own, so that several run side by side."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from support.promises import answers, clocks, deaths, fences, links, owning, short, silence, soaks, standing
from support.promises.book import Book

Run = Callable[[Path, np.random.Generator, Book], None]


class Part(NamedTuple):
    """Some of the trials of a promise.

    Attributes:
        promise: as `--only` names it.
        trials: rounds; of fences episodes, of the soak simulated minutes.
        niceness: how far it gives way to the others, which are timed.
        background: asks only for processor time, so it runs beside the others.
    """

    promise: str
    run: Run
    trials: int
    niceness: int = 0
    background: bool = False


ARDUPILOT, PX4 = 'ardupilot', 'px4'
# The long ones first.
LONG: Mapping[str, Part] = {
    'soak': Part('soak', soaks.run, 24 * 60, niceness=5),
    **{
        f'deaths-{autopilot}-{half}': Part('deaths', partial(deaths.run, autopilot=autopilot), 25)
        for autopilot in (ARDUPILOT, PX4) for half in (1, 2)
    },
    **{f'links-{autopilot}': Part('links', partial(links.run, autopilot=autopilot), 50) for autopilot in (ARDUPILOT, PX4)},
    'clocks': Part('clocks', clocks.run, 100),
    'silence': Part('silence', silence.run, 100),
    'answers': Part('answers', answers.run, 10_000, niceness=15, background=True),
    **{f'fences-{half}': Part('fences', fences.run, 5000, niceness=15, background=True) for half in (1, 2)},
    **{
        f'standing-{autopilot}': Part('standing', partial(standing.run, autopilot=autopilot), 100, niceness=15, background=True)
        for autopilot in (ARDUPILOT, PX4)
    },
    **{
        f'owning-{autopilot}': Part('owning', partial(owning.run, autopilot=autopilot), 60, niceness=15, background=True)
        for autopilot in (ARDUPILOT, PX4)
    },
}
SHORT: Mapping[str, Part] = {
    'flight-ardupilot': Part('flight', short.with_ardupilot, 1),
    'flight-px4': Part('flight', short.with_px4, 1),
    'silence': Part('silence', silence.run, 1),
    'answers': Part('answers', answers.run, 30, background=True),
    'fences': Part('fences', fences.run, 20, background=True),
    **{
        f'standing-{autopilot}': Part('standing', partial(standing.run, autopilot=autopilot), 1, background=True)
        for autopilot in (ARDUPILOT, PX4)
    },
    **{
        f'owning-{autopilot}': Part('owning', partial(owning.run, autopilot=autopilot), 1, background=True)
        for autopilot in (ARDUPILOT, PX4)
    },
}
PROMISES = tuple(dict.fromkeys(part.promise for part in (*LONG.values(), *SHORT.values())))


def chosen(parts: Mapping[str, Part], promises: list[str] | None, trials: int) -> dict[str, Part]:
    """The parts of some promises (None: of all), with `trials` of each promise (0: as many as they have)."""
    kept = {name: part for name, part in parts.items() if promises is None or part.promise in promises}
    if not trials:
        return kept
    sums = {part.promise: sum(other.trials for other in kept.values() if other.promise == part.promise) for part in kept.values()}
    return {name: part._replace(trials=max(1, round(trials * part.trials / sums[part.promise]))) for name, part in kept.items()}
