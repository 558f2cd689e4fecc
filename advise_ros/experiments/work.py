"""The units that trials are spread over processes by: plain values in, plain values out."""

from __future__ import annotations

from typing import NamedTuple

from threadpoolctl import threadpool_limits

from advise_ros.core.errors import InputError
from advise_ros.experiments.interview import interviews
from advise_ros.experiments.method import Method, OwnProtocol, Protocol
from advise_ros.experiments.protocols import protocol_for
from advise_ros.experiments.store import key_of
from advise_ros.experiments.trial import cluster_quality, curves


class Task(NamedTuple):
    """One trial of some methods.

    Attributes:
        kind: 'curves', 'quality' or 'interview'.
    """

    kind: str
    protocol: Protocol
    methods: tuple[Method, ...]
    seed: int

    def keys(self) -> list[tuple[str, int]]:
        """Where the results of the methods are stored."""
        return [(key_of(self.kind, self.protocol, method), self.seed) for method in self.methods]

    def perform(self) -> list[object]:
        """The result of each method; one thread, so that it is the same wherever it runs.

        Raises:
            InputError: the user's files are not here, or not those that the task was made with.
        """
        _check_files(self.protocol)
        with threadpool_limits(1):
            if self.kind == 'quality':
                return [cluster_quality(self.protocol, method, self.seed) for method in self.methods]
            if self.kind == 'interview':
                return [list(one) for one in interviews(self.protocol, self.methods, self.seed)]  # type: ignore[arg-type]
            found = curves(self.protocol, self.methods, self.seed)
            return [list(found[method.name]) for method in self.methods]


def _check_files(protocol: Protocol) -> None:
    if isinstance(protocol, OwnProtocol) and protocol_for(protocol.domain) != protocol:
        raise InputError(f'{protocol.domain} is not what it was when the experiment began; start it again')
