"""Node parameters as the settings of the core."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

from advise_ros.config import AdviseConfig
from advise_ros.core.learning.learner import LearnSettings

# The learner as printed (Odom & Natarajan 2016); config/paper.yaml says what each is.
PAPER: dict[str, Any] = {
    'reading': 'literal', 'lambda_t': 1000.0, 'lambda_a': 500.0, 'margin_cap': 0.0, 'slack_cost': 1000.0,
    'clustering': 'k_means', 'clusters': 10, 'cluster_features': 0.0, 'cluster_score': 'mean', 'acquisition': 'paper',
    'confirm': False, 'enough': 0.0, 'temperature': 1.0, 'w_p': 0.5,
}


def learn_settings(config: AdviseConfig) -> LearnSettings:
    """The learner's share of /advise's parameters; the names are the same."""
    settings = LearnSettings(**{spec.name: getattr(config, spec.name) for spec in fields(LearnSettings)})
    return replace(settings, **PAPER) if config.method == 'paper' else settings
