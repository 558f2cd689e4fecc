"""Node parameters as the settings of the core."""

from __future__ import annotations

from dataclasses import fields

from advise_ros.config import AdviseConfig
from advise_ros.core.irl.settings import LearnSettings


def learn_settings(config: AdviseConfig) -> LearnSettings:
    """The learner's share of /advise's parameters; the names are the same."""
    return LearnSettings(**{spec.name: getattr(config, spec.name) for spec in fields(LearnSettings)})
