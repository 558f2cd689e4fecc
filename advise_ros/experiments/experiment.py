"""The experiments by name: which trials they need and what they write."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from advise_ros.core.errors import InputError
from advise_ros.domains import find
from advise_ros.experiments import plots
from advise_ros.experiments.figures import Row5, Trials, figure5_rows, tasks
from advise_ros.experiments.method import METHODS, Method
from advise_ros.experiments.protocols import protocol_for
from advise_ros.experiments.runner import Performer as Where
from advise_ros.experiments.runner import run
from advise_ros.experiments.store import Store

__all__ = ['EXPERIMENTS', 'Experiment', 'Request', 'Where']

TRIALS = 100


class Request(NamedTuple):
    """What a user asked for.

    Attributes:
        experiment: of EXPERIMENTS.
        domains: names, or .npz files.
        methods: names.
        trials: None for each experiment's own number.
        seed: of the first trial.
        out: directory.
    """

    experiment: str
    domains: tuple[str, ...]
    methods: tuple[str, ...]
    trials: int | None
    seed: int
    out: Path

    def fulfil(self, where: Where, progress: Callable[[str, int, int], None]) -> list[Path]:
        """Run what is missing and write the figures; returns the files.

        Raises:
            InputError: a domain is unknown or the directory cannot be written.
        """
        with Store(self.out / 'trials.jsonl') as store, plots.in_style():
            return EXPERIMENTS[self.experiment].run(self, store, where, progress)

    def chosen_methods(self) -> tuple[Method, ...]:
        """The methods in the figures' order."""
        return tuple(METHODS[name] for name in METHODS if name in self.methods)


class Experiment(NamedTuple):
    """One subcommand."""

    about: str
    run: Callable[[Request, Store, Where, Callable[[str, int, int], None]], list[Path]]


def _figure5(request: Request, store: Store, where: Where, progress: Callable[[str, int, int], None]) -> list[Path]:
    trials, methods = Trials(request.trials or TRIALS, request.seed), request.chosen_methods()
    rows: list[Row5] = []
    measures: dict[str, str] = {}
    for name in request.domains:
        protocol = protocol_for(name)
        run(tasks('curves', protocol, methods, trials), store, where, partial(progress, f'figure 5, {name}'))
        domain = find(name)
        measures[domain.name] = domain.measure.value
        rows += figure5_rows(store, domain.name, protocol, methods, trials)
    return _write(request.out / 'figure5', rows, plots.figure5(rows, measures))


def _write(stem: Path, rows: list[Row5], figure: Figure) -> list[Path]:
    try:
        stem.with_suffix('.json').write_text(json.dumps([row._asdict() for row in rows], indent=1) + '\n', encoding='utf-8')
    except OSError as problem:
        raise InputError(f'{stem}.json cannot be written ({problem.strerror}); name another directory') from problem
    plots.save(figure, stem)
    return [stem.with_suffix(suffix) for suffix in ('.json', '.png', '.svg')]


EXPERIMENTS = {
    'figure5': Experiment('performance against the number of questions, method by method', _figure5),
}
