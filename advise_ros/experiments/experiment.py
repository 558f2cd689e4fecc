"""The experiments by name: which trials they need and what they write."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from advise_ros.core.errors import InputError
from advise_ros.domains.domain import Domain, Measure
from advise_ros.experiments import acquisitions, figures, plots
from advise_ros.experiments.figures import Row5, Row6, Slope, Trials
from advise_ros.experiments.interview import with_errors
from advise_ros.experiments.method import METHODS, Method, Protocol
from advise_ros.experiments.protocols import protocol_for
from advise_ros.experiments.recorded import domain_of
from advise_ros.experiments.runner import Performer, run
from advise_ros.experiments.store import Store

TRIALS = 100
# The paper took 250 for the quality of Sailing's clusters.
QUALITY_TRIALS = {'sailing': 250}
Progress = Callable[[str, int, int], None]
Tell = Callable[[str], None]


class Request(NamedTuple):
    """What a user asked for.

    Attributes:
        domains: names, .npz files, or datasets; None for those of the experiment.
        methods: names.
        trials: None for each experiment's own number.
        seed: of the first trial.
        out: directory.
    """

    domains: tuple[str, ...] | None
    methods: tuple[str, ...]
    trials: int | None
    seed: int
    out: Path

    def in_domains(self, default: Sequence[str]) -> Iterator[tuple[str, Domain, Protocol]]:
        """Each domain asked for, with its protocol."""
        for name in self.domains or default:
            yield name, domain_of(name), protocol_for(name)


class Bench(NamedTuple):
    """Where trials run and are kept."""

    store: Store
    performer: Performer
    progress: Progress

    def run(self, title: str, kind: str, protocol: Protocol, methods: tuple[Method, ...], trials: Trials) -> None:
        """The trials that are not there yet."""
        run(figures.tasks(kind, protocol, methods, trials), self.store, self.performer, partial(self.progress, title))


def fulfil(names: Sequence[str], request: Request, performer: Performer, progress: Progress, tell: Tell) -> list[Path]:
    """Run what is missing and write the figures; returns the files.

    Args:
        names: of EXPERIMENTS.
        request: what is asked for.
        performer: where trials run.
        progress: told title, trials done and trials in all.
        tell: told which domain is left out of which of several experiments, and why.

    Raises:
        InputError: a domain or the cluster is unknown, a domain suits none of the experiments, or the directory cannot
            be written.
    """
    suited = list(_suited(names, request, tell))  # What is wrong is told before hours of trials, not after them.
    with Store(request.out / 'trials.jsonl') as store, plots.in_style():
        bench = Bench(store, performer, progress)
        return [path for name, fitting in suited for path in EXPERIMENTS[name].run(fitting, bench)]


def _suited(names: Sequence[str], request: Request, tell: Tell) -> Iterator[tuple[str, Request]]:
    """Each experiment with the domains that suit it."""
    wanted = list(dict.fromkeys(request.domains or ()))
    domains = {one: domain for one, domain, _ in request._replace(domains=tuple(wanted)).in_domains(())}
    _check_names(domains)
    for name in names:
        unfit = {one: reason for one, domain in domains.items() if (reason := EXPERIMENTS[name].unfit(domain))}
        for reason in unfit.values():
            if len(names) == 1:
                raise InputError(reason)
            tell(reason)
        if not wanted or len(unfit) < len(wanted):
            yield name, request._replace(domains=tuple(one for one in wanted if one not in unfit) or None)


def _check_names(domains: dict[str, Domain]) -> None:
    for one, domain in domains.items():
        if other := next((other for other in domains if other != one and domains[other].name == domain.name), None):
            raise InputError(f"domains {other} and {one} would both be '{domain.name}' in the figures; rename one")


def _anything(_: Domain) -> str:
    return ''


class Experiment(NamedTuple):
    """One subcommand.

    Attributes:
        about: what it shows.
        run: runs the trials that are missing and writes the files.
        in_all: whether `all` has it.
        unfit: why a domain has no place in it, '' where it has.
    """

    about: str
    run: Callable[[Request, Bench], list[Path]]
    in_all: bool = True
    unfit: Callable[[Domain], str] = _anything


PAPERS = ('wumpus', 'sailing', 'traffic', 'drone')


def _figure5(request: Request, bench: Bench) -> list[Path]:
    trials = Trials(request.trials or TRIALS, request.seed)
    methods = tuple(METHODS[name] for name in METHODS if name in request.methods)
    rows: list[Row5] = []
    measures: dict[str, str] = {}
    for _, domain, protocol in request.in_domains(PAPERS):
        bench.run(f'figure 5, {domain.name}', 'curves', protocol, methods, trials)
        measures[domain.name] = domain.measure.value
        rows += figures.figure5_rows(bench.store, domain.name, protocol, methods, trials)
    stem = request.out / 'figure5'
    written = _write(stem, [row._asdict() for row in rows], plots.figure5(rows, measures))
    stem.with_suffix('.md').write_text(figures.table5(rows), encoding='utf-8')
    return [*written, stem.with_suffix('.md')]


def _figure6(request: Request, bench: Bench) -> list[Path]:
    trials = Trials(request.trials or TRIALS, request.seed)
    rows: list[Row6] = []
    slopes: list[Slope] = []
    for _, domain, protocol in request.in_domains(('wumpus', 'sailing', 'drone')):
        bench.run(f'figure 6, {domain.name}', 'curves', protocol, figures.FIGURE6_METHODS, trials)
        points, slope = figures.figure6_rows(bench.store, domain.name, protocol, trials)
        rows += points
        slopes.append(slope)
    content = {'rows': [row._asdict() for row in rows], 'slopes': [slope._asdict() for slope in slopes]}
    return _write(request.out / 'figure6', content, plots.figure6(rows))


def _unfit_for_figure6(domain: Domain) -> str:
    if domain.measure is not Measure.GOAL:
        return f"figure 6 is relative to a share of goals reached; domain '{domain.name}' measures {domain.measure.value}"
    if len(np.unique(domain.habit[domain.acting])) < 2:
        return f"figure 6 displaces states into wrong clusters; in domain '{domain.name}' one action is best in all states"
    if not domain.best_performance:
        return f"figure 6 is relative to a share of goals reached; in domain '{domain.name}' none can be reached"
    return ''


def _clusters(request: Request, bench: Bench) -> list[Path]:
    rows = []
    for name, domain, protocol in request.in_domains(PAPERS):
        trials = Trials(request.trials or QUALITY_TRIALS.get(name, TRIALS), request.seed)
        bench.run(f'clusters, {domain.name}', 'quality', protocol, (figures.CLUSTERED,), trials)
        rows.append(figures.quality_row(bench.store, domain.name, protocol, domain.mdp.n_actions, trials))
    return _write(request.out / 'clusters', [row._asdict() for row in rows], plots.clusters(rows))


def _acquisitions(request: Request, bench: Bench) -> list[Path]:
    trials = Trials(request.trials or TRIALS, request.seed)
    rows: list[acquisitions.Row] = []
    for _, domain, protocol in request.in_domains(PAPERS):
        for rate in acquisitions.ERRORS:
            people, title = with_errors(protocol, rate), f'acquisitions, {domain.name}, {rate:.0%} errors'
            bench.run(title, 'interview', people, acquisitions.VARIANTS, trials)
        rows += acquisitions.rows(bench.store, domain, protocol, trials)
    stem = request.out / 'acquisitions'
    written = _save(stem, [row._asdict() for row in rows])
    stem.with_suffix('.md').write_text(acquisitions.table(rows), encoding='utf-8')
    return [written, stem.with_suffix('.md')]


def _write(stem: Path, content: Any, figure: Figure) -> list[Path]:
    written = _save(stem, content)
    return [written, *plots.save(figure, stem)]


def _save(stem: Path, content: Any) -> Path:
    path = stem.with_suffix('.json')
    try:
        path.write_text(json.dumps(content, indent=1) + '\n', encoding='utf-8')
    except OSError as problem:
        raise InputError(f'{path} cannot be written ({problem.strerror}); name another directory') from problem
    return path


EXPERIMENTS = {
    'figure5': Experiment('performance against the number of questions, method by method', _figure5),
    'figure6': Experiment('performance against the quality of the clusters', _figure6, unfit=_unfit_for_figure6),
    'clusters': Experiment('quality of the clusters that k-means finds', _clusters),
    'acquisitions': Experiment(acquisitions.ABOUT, _acquisitions, in_all=False),
}
