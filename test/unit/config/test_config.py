"""Parameters: what is accepted, and the sentence for what is not."""

from __future__ import annotations

import inspect
import itertools
import math
import runpy
from dataclasses import fields
from typing import Any

import pytest
import yaml

from advise_ros import config
from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.errors import InputError
from advise_ros.core.flight.policy_flight import FlightPlan
from advise_ros.core.flight.velocity_law import SeekSettings
from advise_ros.core.guard import rules as guard
from advise_ros.core.guard.monitor import MonitorSettings
from advise_ros.core.irl.settings import LearnSettings, Terms
from advise_ros.core.people.trial import TrialSettings
from advise_ros.mavlink import companion
from advise_ros.recording import background
from advise_ros.sim import control
from support.paths import ROOT

CONFIGS = [member for name, member in inspect.getmembers(config, inspect.isclass) if name.endswith('Config')]
SPECS = [pytest.param(spec, id=f'{owner.__name__}.{spec.name}') for owner in CONFIGS for spec in fields(owner)]
UNITS = {'m', 's', 'hz', 'ns', 'kib', 'rad', 'deg'}


def test_nothing_given_means_all_defaults() -> None:
    for owner in CONFIGS:
        assert config.build(owner, {}) == owner()
        assert config.defaults(owner) == {spec.name: spec.default for spec in fields(owner)}


@pytest.mark.parametrize('spec', SPECS)
def test_every_default_is_inside_its_own_range(spec: Any) -> None:
    assert config.check(spec, spec.default) == spec.default
    assert spec.metadata['doc']


@pytest.mark.parametrize('spec', SPECS)
def test_ends_of_ranges_are_inside_and_what_lies_past_them_is_not(spec: Any) -> None:
    for end, step in ((spec.metadata['low'], -1), (spec.metadata['high'], 1)):
        if end is not None:
            kind = type(spec.default)
            assert config.check(spec, kind(end)) == end
            with pytest.raises(InputError, match=f"'{spec.name}' is .*allowed: "):
                config.check(spec, kind(end + step * max(1, abs(end))))


@pytest.mark.parametrize('spec', SPECS)
def test_a_value_of_another_type_is_named_with_its_type(spec: Any) -> None:
    wrong = 3 if isinstance(spec.default, str) else 'three'
    with pytest.raises(InputError, match=f"'{spec.name}' is .*{type(wrong).__name__}.*must be a {type(spec.default).__name__}"):
        config.check(spec, wrong)


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_refused(value: float) -> None:
    with pytest.raises(InputError, match='max_speed_m_s'):
        config.build(config.GuardConfig, {'max_speed_m_s': value})


def test_whole_numbers_serve_for_floats_and_booleans_for_neither() -> None:
    speed = config.build(config.GuardConfig, {'max_speed_m_s': 2}).max_speed_m_s
    assert (speed, type(speed)) == (2.0, float)
    for name in ('max_speed_m_s', 'rate_hz'):
        with pytest.raises(InputError, match=f"'{name}' is True .bool."):
            config.build(config.GuardConfig, {name: True})
    with pytest.raises(InputError, match=r"'seed' is 1.0 .float.; it must be a int"):
        config.build(config.AdviseConfig, {'seed': 1.0})


def test_off_may_come_as_the_false_that_yaml_makes_of_it() -> None:
    assert config.build(config.GuardConfig, {'fence': False}).fence == 'off'
    with pytest.raises(InputError, match="parameter 'fence' is True"):
        config.build(config.GuardConfig, {'fence': True})


def test_choices_are_told() -> None:
    with pytest.raises(InputError, match=r"'solver' is 'simplex'; allowed: 'auto' \| 'highs' \| 'piqp'"):
        config.build(config.AdviseConfig, {'solver': 'simplex'})


def test_a_misspelt_name_gets_the_nearest_one() -> None:
    with pytest.raises(InputError, match="'max_sped_m_s' is unknown; did you mean 'max_speed_m_s'"):
        config.build(config.GuardConfig, {'max_sped_m_s': 1.0})


def test_a_name_like_no_other_gets_them_all() -> None:
    with pytest.raises(InputError, match=r"'zzz' is unknown; known: climb_m_s, .*speed_m_s"):
        config.build(config.TeleopConfig, {'zzz': 1.0})


@pytest.mark.parametrize(('used', 'owner', 'renamed'), [
    (DiscretiseSettings, config.RecorderConfig, {}),
    (SeekSettings, config.PolicyConfig, {}),
    (FlightPlan, config.PolicyConfig, {}),
    (LearnSettings, config.AdviseConfig, {}),
    (Terms, config.AdviseConfig, {}),
    (TrialSettings, config.PilotConfig, {'flights': ''}),  # A trial has a number of flights of its own.
    (TrialSettings, config.ExpertConfig, {}),
    (guard.Limits, config.ChecksConfig, {'fence': ''}),  # The fence itself, not how it is chosen.
    (MonitorSettings, config.ChecksConfig, {}),
    (companion.Settings, config.MavlinkBridgeConfig, {}),
    (control.ControlLimits, config.SimulatorConfig, {'speed_m_s': 'max_speed_m_s'}),
    (background.WriteLimits, config.LoggerConfig, {}),
])
def test_what_is_made_without_a_node_has_the_nodes_defaults(used: Any, owner: Any, renamed: dict[str, str]) -> None:
    given = used._field_defaults if hasattr(used, '_field_defaults') else config.defaults(used)
    parameters = config.defaults(owner)
    shared = {name: renamed.get(name, name) for name in given if renamed.get(name, name) in parameters}
    assert shared
    assert {name: given[name] for name in shared} == {name: parameters[there] for name, there in shared.items()}


def test_a_config_cannot_be_changed() -> None:
    for owner in CONFIGS:
        with pytest.raises(AttributeError):
            setattr(owner(), fields(owner)[0].name, 0)


def test_the_file_with_the_papers_settings_says_something_else_than_the_defaults() -> None:
    tree = yaml.safe_load((ROOT / 'config' / 'paper.yaml').read_text(encoding='utf-8'))
    values = tree['/**/advise']['ros__parameters']
    paper, default = config.build(config.AdviseConfig, values), config.AdviseConfig()
    assert {name for name in values if getattr(paper, name) != getattr(default, name)} == {
        'reading', 'margin_cap', 'clusters', 'cluster_features', 'acquisition', 'temperature', 'confirm',
    }
    assert config.build(config.ExpertConfig, tree['/**/expert']['ros__parameters']).prefer == 'plurality'


def test_the_benchmark_of_the_settings_leads_from_the_paper_to_the_defaults() -> None:
    rows = list(runpy.run_path(str(ROOT / 'benchmarks' / 'settings.py'))['rows'](10))
    assert rows[0][1].learn.reading == 'literal' and rows[-1][1].error_rate > 0
    changed = [sum(a != b for a, b in zip(vars(old.learn).values(), vars(new.learn).values(), strict=True))
               for (_, old), (_, new) in itertools.pairwise(rows)]
    assert changed == [2, 1, 1, 1, 1, 1, 0]
