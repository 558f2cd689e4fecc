"""How the simulated people err."""

from __future__ import annotations

from dataclasses import dataclass

from advise_ros.core.parameter import parameter


@dataclass(frozen=True)
class PilotSettings:
    """The simulated pilot: parameters of /pilot."""

    noise_rate: float = parameter(0.4, 'share of moves that are not the right one', low=0.0, high=0.95)
    mistake_share: float = parameter(
        0.2, 'share of states in which the same mistake is made again and again', low=0.0, high=1.0,
    )
    max_moves: int = parameter(400, 'moves before a flight is given up', low=1, high=1_000_000)


@dataclass(frozen=True)
class ExpertSettings:
    """The simulated expert: parameters of /expert."""

    expert_id: str = parameter('simulated-expert', 'name in the log of answers')
    error_rate: float = parameter(0.0, 'share of answers that are wrong', low=0.0, high=1.0)
    skip_rate: float = parameter(0.0, 'share of queries that are skipped', low=0.0, high=1.0)
    prefer: str = parameter(
        'majority', 'preferred actions: optimal in most states (plurality), or also those optimal in at least half of them',
        choices=('majority', 'plurality'),
    )
    avoid: str = parameter(
        'never_optimal', 'avoided actions: never optimal in the cluster, or all that are not preferred',
        choices=('never_optimal', 'all_others'),
    )
