"""Malformed ROS arguments are told in one sentence, by nodes and commands alike."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from advise_ros import exits
from advise_ros.commands import answer
from advise_ros.config import GuardConfig
from advise_ros.core.errors import InputError
from advise_ros.nodes.guard import Guard
from advise_ros.ros import arguments, run

MALFORMED = [
    (['-p', 'grid_file'], "'-p grid_file' cannot be read: write -p NAME:=VALUE"),
    (['-p'], 'No parameter override rule found; the forms are'),
    (['-r', '__ns:=drone1'], 'a namespace begins with a slash'),
    (['-r', 'pose:=a b'], "'-r pose:=a b' cannot be read: write -r FROM:=TO"),
    (['--params-file', 'nosuch.yaml'], "'--params-file nosuch.yaml' cannot be read: error opening YAML file; name"),
    (['--log-level', 'loud'], 'debug, info, warn'),
    (['--frobnicate'], '--frobnicate'),
]


@pytest.mark.parametrize(('args', 'words'), MALFORMED)
def test_the_argument_and_the_remedy_are_named(args: list[str], words: str) -> None:
    with pytest.raises(InputError) as refused:
        arguments.without_ros(['--ros-args', *args])
    assert words in str(refused.value)
    assert '.c:' not in str(refused.value)


@pytest.mark.parametrize(('variable', 'value', 'words'), [
    ('ROS_DOMAIN_ID', 'abc', "ROS_DOMAIN_ID is 'abc'; it must be a whole number from 0 to 232"),
    ('ROS_DOMAIN_ID', '233', "ROS_DOMAIN_ID is '233'"),
    ('ROS_LOG_DIR', '/proc/logs', "its logs into '/proc/logs': No such file or directory; set ROS_LOG_DIR"),
])  # fmt: skip
def test_an_environment_that_ros_cannot_start_in_is_named(
    monkeypatch: pytest.MonkeyPatch, variable: str, value: str, words: str,
) -> None:
    monkeypatch.setenv(variable, value)
    with pytest.raises(InputError) as refused:
        arguments.without_ros([])
    assert words in str(refused.value)


def test_what_is_not_for_ros_is_left() -> None:
    line = ['--query', '3', '--ros-args', '-r', '__ns:=/drone1', '--', '--skip']
    assert arguments.without_ros(line) == ['--query', '3', '--skip']


@pytest.mark.parametrize('start', [lambda args: run.run_node(Guard, GuardConfig, args), answer.run])
def test_nodes_and_commands_exit_by_the_code_for_wrong_usage(
    start: Callable[[list[str]], int], capfd: pytest.CaptureFixture[str]
) -> None:
    assert start(['--ros-args', '-r', '__ns:=drone1']) == exits.USAGE
    assert 'error: ROS argument' in capfd.readouterr().err
