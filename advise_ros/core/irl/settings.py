"""What learning depends on beside the grid and the evidence."""

from __future__ import annotations

from dataclasses import dataclass

from advise_ros.core.irl.program import Terms


@dataclass(frozen=True)
class LearnSettings:
    """Constants and readings of the method; meanings and ranges are those of `config.AdviseConfig`."""

    reading: str = 'replace'
    lambda_t: float = 1000.0
    lambda_a: float = 500.0
    r_max: float = 1.0
    delta: float = 0.1
    margin_cap: float = 0.2
    slack_cost: float = 1000.0
    gamma: float = 0.95
    clustering: str = 'k_means'
    clusters: int = 6
    cluster_features: float = 1.0
    laplace: float = 1.0
    temperature: float = 0.1
    w_p: float = 0.5
    cluster_score: str = 'mean'
    acquisition: str = 'occupancy'
    confirm: bool = True
    enough: float = 0.0
    slip: float = 0.0
    solver: str = 'auto'
    seed: int = 0

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
