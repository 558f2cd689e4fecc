"""What learning depends on beside the grid and the evidence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from advise_ros.core.parameter import parameter


@dataclass(frozen=True)
class LearnSettings:
    """Constants and readings of the method: parameters of /advise."""

    reading: str = parameter(
        'replace', 'what advice does to a*: replace it and drop its demonstration rows, or the literal program',
        choices=('replace', 'literal'),
    )
    lambda_t: float = parameter(1000.0, 'weight of the demonstrations in equation (1)', low=0.0, high=1e9)
    lambda_a: float = parameter(500.0, 'weight of the advice in equation (1)', low=0.0, high=1e9)
    r_max: float = parameter(1.0, 'bound on the absolute value of a reward', low=1e-6, high=1e6)
    delta: float = parameter(0.1, 'margin that advice must have', low=0.0, high=1e6)
    margin_cap: float = parameter(0.2, 'cap on xi and zeta; 0: none', low=0.0, high=1e6)
    slack_cost: float = parameter(1000.0, 'cost of contradictory advice (elastic); 0: strict', low=0.0, high=1e9)
    gamma: float = parameter(0.95, 'discount', low=0.0, high=0.9999)
    clusters: int = parameter(6, 'clusters of states; about 1.5 a waypoint', low=1, high=10_000)
    cluster_features: float = parameter(
        1.0, 'weight of position and waypoint beside the action distribution; 0: none, as in the paper', low=0.0, high=100.0,
    )
    laplace: float = parameter(1.0, 'pseudo-count of each action', low=1e-9, high=1e6)
    temperature: float = parameter(0.1, 'Boltzmann temperature of the policy', low=1e-6, high=1e6)
    w_p: float = parameter(0.5, 'weight of F (demonstrations) against G (policy)', low=0.0, high=1.0)
    # How U_c is made of U_s: the mean over a cluster, as definition 4 has it.
    cluster_score: ClassVar[str] = 'mean'
    acquisition: str = parameter(
        'site', 'what is learnt and asked: site: cells to keep out of that the map does not show, and what saves most steps; '
        'paper: the most frequent actions, and the cluster with the highest U_c; occupancy: as paper, but U_s weighted by '
        'where the policy flies',
        choices=('site', 'paper', 'occupancy'),
    )
    confirm: bool = parameter(
        True, 'ask once more after an answer that hardly any demonstration supports; the most frequent answer holds',
    )
    enough: float = parameter(
        2.5, 'with acquisition site, ask no more when the best question is expected to save fewer steps than this; 0: ask '
        'as long as anything is saved; the others ask about every cluster',
        low=0.0, high=100.0,
    )
    slip: float = parameter(0.0, 'probability that a move goes elsewhere in the transition model', low=0.0, high=0.9)
    solver: str = parameter(
        'auto', 'solver of the program: by size (auto), or one; cvxpy is the readable reference',
        choices=('auto', 'highs', 'piqp', 'clarabel', 'interior', 'interior-cholmod', 'cvxpy'),
    )
    seed: int = parameter(0, 'seed of every random choice', low=0, high=2**31 - 1)

    @property
    def confirms(self) -> bool:
        """Whether a doubtful answer is asked for again; a belief about the site weighs it by itself."""
        return self.confirm and self.slack_cost > 0 and self.acquisition != 'site'

    @property
    def terms(self) -> Terms:
        """The constants of the linear program."""
        return Terms(
            self.reading, self.lambda_t, self.lambda_a, self.r_max, self.delta, self.margin_cap, self.slack_cost
        )


class SummedSettings(LearnSettings):
    """U_c is the sum over a cluster, as algorithm 1 prints it: a row of the sensitivity table, no parameter."""

    cluster_score: ClassVar[str] = 'sum'


class Terms(NamedTuple):
    """The constants of the linear program and its readings, as in `LearnSettings`."""

    reading: str = LearnSettings.reading
    lambda_t: float = LearnSettings.lambda_t
    lambda_a: float = LearnSettings.lambda_a
    r_max: float = LearnSettings.r_max
    delta: float = LearnSettings.delta
    margin_cap: float = LearnSettings.margin_cap
    slack_cost: float = LearnSettings.slack_cost

    @property
    def cap(self) -> float:
        """The bound of xi and zeta, infinite without one."""
        return self.margin_cap if self.margin_cap > 0 else math.inf

    @property
    def strict(self) -> bool:
        """Whether advice must hold, at any price."""
        return self.slack_cost == 0
