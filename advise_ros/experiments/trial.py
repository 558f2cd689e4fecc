"""One trial: demonstrations of one person, then questions one after the other by each method."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple
from zlib import crc32

import numpy as np

from advise_ros.core.advice.advice import Preference
from advise_ros.core.demonstrations.action_counts import Counts
from advise_ros.core.numerics import Ints
from advise_ros.domains.domain import Domain
from advise_ros.domains.people import advise, demonstrate
from advise_ros.experiments.clusterings import Clustering, quality
from advise_ros.experiments.learner import Asking, Fitted, fit, preference
from advise_ros.experiments.method import Method, Protocol
from advise_ros.experiments.recorded import Recorded, domain_of

# What is kept of a value: what machines and numbers of threads differ in is far below.
DECIMALS = 6


class Shown(NamedTuple):
    """What the demonstrator of a trial did."""

    domain: Domain
    protocol: Protocol
    seed: int
    counts: Counts

    def generator(self, purpose: str) -> np.random.Generator:
        """Random numbers for one purpose, the same whatever else is drawn in the trial."""
        return np.random.default_rng([self.seed, crc32(purpose.encode())])

    def clusters(self, method: Method) -> Ints:
        """(n,) labels of a method's clusters."""
        return self._clustering.labels(method)

    def partitions(self, method: Method) -> list[Ints]:
        """The labels (n,) of a method's clusters, and of finer ones."""
        return self._clustering.partitions(method)

    @property
    def _clustering(self) -> Clustering:
        return Clustering(self.domain, self.protocol, self.counts, self.seed, self.generator('displaced'))


def show(protocol: Protocol, seed: int) -> Shown:
    """The demonstrations of a trial."""
    domain, rng = domain_of(protocol.domain), np.random.default_rng([seed, crc32(b'demonstrator')])
    person = protocol.demonstrator
    counts = person.demonstrate(rng) if isinstance(person, Recorded) else demonstrate(domain, person, rng)
    return Shown(domain, protocol, seed, counts)


def curves(protocol: Protocol, methods: tuple[Method, ...], seed: int) -> dict[str, tuple[float, ...]]:
    """Performance at the protocol's points by each method, by its name, all on the same demonstrations."""
    shown = show(protocol, seed)
    first = fit(shown.domain, protocol, shown.counts, {})
    return {method.name: _curve(shown, method, first) for method in methods}


def cluster_quality(protocol: Protocol, method: Method, seed: int) -> float:
    """Quality of a method's clusters, 0 to 1; nothing is learnt for it."""
    shown = show(protocol, seed)
    return round(quality(shown.domain, shown.clusters(method)), DECIMALS)


def _curve(shown: Shown, method: Method, first: Fitted) -> tuple[float, ...]:
    """It stays where it is when nothing is left to ask."""
    values, fitted = {0: first.performance}, first
    if method.acquisition:
        for asked, fitted in _improve(shown, method, first):
            values[asked] = fitted.performance
    last = fitted.performance
    return tuple(round(values.get(asked, last), DECIMALS) for asked in shown.protocol.points)


def _improve(shown: Shown, method: Method, fitted: Fitted) -> Iterator[tuple[int, Fitted]]:
    """How many questions were asked, and what is learnt then; at the protocol's points at least, and at the end."""
    protocol, labels = _read(shown.protocol, method), shown.clusters(method)
    asking = Asking(shown.domain, protocol, method, labels, shown.counts, shown.generator(method.acquisition))
    answers = _answers(shown, asking, labels)
    budget = min(protocol.budget, labels.max() + 1, *([] if method.budget is None else [method.budget]))
    advice: dict[int, Preference] = {}
    for asked in range(1, budget + 1):
        advice |= answers(fitted)
        if not asking.blind or asked in protocol.points or asked == budget:
            fitted = fit(shown.domain, protocol, shown.counts, advice, fitted.solution)
            yield asked, fitted


def _answers(shown: Shown, asking: Asking, labels: Ints) -> Callable[[Fitted], dict[int, Preference]]:
    """Asks the next question under a policy and returns what the answer says about its states."""
    expert, asked = shown.generator('expert'), np.zeros(labels.max() + 1, dtype=np.bool_)

    def ask(fitted: Fitted) -> dict[int, Preference]:
        chosen = asking.choose(fitted, asked)
        if chosen is None:
            return {}
        asked[chosen] = True
        states = np.flatnonzero(labels == chosen)
        answer = advise(shown.protocol.expert, shown.domain.optimal[states], expert)
        return {} if answer is None else dict.fromkeys(states.tolist(), preference(answer))

    return ask


def _read(protocol: Protocol, method: Method) -> Protocol:
    """The protocol in the method's reading."""
    return protocol if method.reading is None else replace(protocol, terms=protocol.terms._replace(reading=method.reading))
