"""Whom the keys of a parameter file mean, and what a node says of keys that mean nobody."""

from __future__ import annotations

from pathlib import Path

import pytest

from advise_ros import config
from advise_ros.core.errors import InputError
from advise_ros.ros.params_files import fits, named_in
from advise_ros.ros.qos_overrides import QosOverrides

SPEED = '{ros__parameters: {speed_m_s: 1.0}}'


@pytest.mark.parametrize(
    ('name', 'key', 'meant'),
    [
        ('/policy', 'policy', True), ('/policy', '/policy', True), ('/drone1/policy', 'policy', False),
        ('/drone1/policy', '/drone1/policy', True), ('/drone1/policy', '/**', True), ('/policy', '/**/policy', True),
        ('/a/b/policy', '/**/policy', True), ('/drone1/policy', '/*/policy', True), ('/policy', '/*/policy', False),
    ],
)
def test_keys_are_read_as_rcl_does(name: str, key: str, meant: bool) -> None:
    assert fits(name, key) == meant


@pytest.mark.parametrize(
    ('text', 'name', 'words'),
    [
        (f'polcy: {SPEED}', '/policy', "'/polcy' is no node, and nothing below it is read; the nearest is '/policy'"),
        (f'drone1: {{pollicy: {SPEED}}}', '/drone1/policy', "the nearest is '/drone1/policy'"),
        (f'policy: {SPEED}', '/drone1/policy', "'/policy' is not /drone1/policy, and nothing below it is read; write "),
        (f'controller_server: {SPEED}', '/policy', "has nothing for /policy; its keys: '/controller_server'"),
        ('speed_m_s: 1.0', '/policy', 'has nothing for /policy; its keys: none'),
        # What is another's is no mistake.
        (f'polcy: {SPEED}', '/guard', ''),
        (f'policy: {SPEED}\npolicy_2: {SPEED}', '/policy', ''),
        (f'policy: {SPEED}', '/guard', ''),
        (f'/**: {SPEED}\ncontroller_server: {SPEED}', '/policy', ''),
        (f'mine: {SPEED}', '/mine', ''),
    ],
)
def test_a_key_that_means_nobody_is_named(tmp_path: Path, text: str, name: str, words: str) -> None:
    file = tmp_path / 'my.yaml'
    file.write_text(text)
    (found,) = named_in(['--ros-args', '--params-file', str(file)])
    remark = found.remark(name, config.NODES)
    assert words in remark
    assert bool(remark) == bool(words)


def test_the_parameter_file_that_ships_means_every_node() -> None:
    (found,) = named_in(['--ros-args', '--params-file', 'config/advise.yaml'])
    for name in config.NODES:
        assert found.remark(f'/drone1/{name}', config.NODES) == ''
        assert found.fitting(f'/drone1/{name}')


@pytest.mark.parametrize(
    ('name', 'value', 'words'),
    [
        ('qos_overrides.pose.subscription.depth', 1, 'is no override of a profile; write qos_overrides./TOPIC'),
        ('qos_overrides./pose.reader.depth', 1, 'is no override of a profile'),
        ('qos_overrides./pose.subscription.durability', 'volatile', "'durability' cannot be overridden; those that can: history"),
        ('qos_overrides./pose.subscription.depth', 'many', "is 'many'; allowed: 1 to 1000000"),
        ('qos_overrides./pose.subscription.depth', 0, 'is 0; allowed: 1'),
        ('qos_overrides./pose.subscription.reliability', 'best', "is 'best'; allowed: 'reliable' | 'best_effort'"),
    ],
)
def test_a_wrong_override_of_a_profile_is_one_sentence(name: str, value: object, words: str) -> None:
    with pytest.raises(InputError) as refused:
        QosOverrides({name: value})
    assert name in str(refused.value)
    assert words in str(refused.value)


def test_an_override_that_fits_no_topic_is_named_with_the_nearest() -> None:
    overrides = QosOverrides({'qos_overrides./pos.subscription.depth': 1})
    assert not overrides.override('/pose', 'subscription')
    assert overrides.unused.endswith("fits no topic that this node opens; did you mean 'qos_overrides./pose.subscription.depth'?")
    assert QosOverrides({'qos_overrides./pose.subscription.depth': 1}).override('/pose', 'subscription')


def test_what_may_be_set_in_flight_is_a_parameter_of_its_node() -> None:
    for node, names in config.LIVE.items():
        assert set(names) <= set(config.defaults(config.NODES[node]))
