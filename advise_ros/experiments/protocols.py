"""The settings of the published figures, fixed on tuning seeds before the final seeds were run (docs/paper.md)."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

from advise_ros.core.errors import InputError
from advise_ros.core.irl.settings import Terms
from advise_ros.core.people.simulated_demonstrator import Demonstrator
from advise_ros.experiments.method import OwnProtocol, Protocol
from advise_ros.experiments.recorded import Recorded, file_of, is_recorded

# Tuning used seeds below this; the figures use this and those that follow.
FINAL_SEED = 10_000

# Where states are many, single questions have a longer way to go.
LONG = (*range(11), 15, 20, 25, 30)
SPARSE = (0, 2, 4, 6, 8, 10, 20, 30)

PROTOCOLS = {
    protocol.domain: protocol
    for protocol in (
        Protocol('wumpus', Demonstrator(40, 10), clusters=4),
        Protocol('sailing', Demonstrator(100, 8), clusters=6),
        Protocol(
            'traffic', Demonstrator(5000, 8), clusters=12, points=SPARSE, terms=Terms(delta=0.01, margin_cap=0.1),
            solver='piqp',
        ),
        # 0.2 x 0.75 of the deliberate actions and all random ones: 40 % noise.
        Protocol('drone', Demonstrator(1000, 10, mistake_share=0.2, noise_rate=0.3), clusters=8, points=LONG),
    )
}
# For a user's process.
CLUSTERS = 8
DEMONSTRATOR = Demonstrator(300, 10)


def protocol_for(domain: str) -> Protocol:
    """The protocol of a domain of the paper, or the general one for a user's files.

    Raises:
        InputError: there is no such domain, or its file cannot be read.
    """
    if domain in PROTOCOLS:
        return PROTOCOLS[domain]
    if is_recorded(domain):
        return OwnProtocol(domain, Recorded(domain), CLUSTERS, digest=_digest(file_of(domain)))
    return OwnProtocol(domain, DEMONSTRATOR, CLUSTERS, digest=_digest(Path(domain)))


def _digest(file: Path) -> str:
    try:
        return sha256(file.read_bytes()).hexdigest()
    except OSError as problem:
        raise InputError(f'{file} cannot be read: {problem.strerror}') from problem
