"""The settings of the published figures, fixed on tuning seeds before the final seeds were run (docs/paper.md)."""

from __future__ import annotations

from dataclasses import replace

from advise_ros.core.errors import InputError
from advise_ros.core.program import Terms
from advise_ros.domains.people import Demonstrator
from advise_ros.experiments.method import Protocol

# Tuning used seeds below this; the figures use this and those that follow.
FINAL_SEED = 10_000

PROTOCOLS = {
    protocol.domain: protocol
    for protocol in (
        Protocol('wumpus', Demonstrator(200, 10), clusters=6),
        Protocol('sailing', Demonstrator(300, 8), clusters=9),
        Protocol('traffic', Demonstrator(3000, 8), clusters=16, terms=Terms(delta=0.01, margin_cap=0.1)),
        Protocol('drone', Demonstrator(400, 10, noise_rate=0.3), clusters=10),
    )
}
# For a user's process.
GENERAL = Protocol('', Demonstrator(300, 10), clusters=8)


def protocol_for(domain: str) -> Protocol:
    """The protocol of a domain of the paper, or the general one for a file."""
    if domain in PROTOCOLS:
        return PROTOCOLS[domain]
    if not domain.endswith('.npz'):
        raise InputError(f"domain '{domain}' is unknown; choose {', '.join(PROTOCOLS)}, or an .npz file of your own")
    return replace(GENERAL, domain=domain)
