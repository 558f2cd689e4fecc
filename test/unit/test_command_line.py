"""Mistyped executables, options, choices and parameters are met with what was likely meant."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from advise_ros.command_line import CommandParser
from advise_ros.config import RecorderConfig
from advise_ros.ros.run import meant_parameter
from support.paths import ROOT


@pytest.mark.parametrize(('given', 'meant'), [
    (['--gird', 'x'], 'did you mean --grid?'),
    (['--side_map', 'x'], 'did you mean --site-map?'),
    (['--quux'], 'fly --help lists all'),
    (['--vehicle', 'ardupilto'], 'did you mean ardupilot?'),
])
def test_an_option_or_a_choice(given: list[str], meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    parser = CommandParser(prog='fly')
    parser.add_argument('--grid')
    parser.add_argument('--site-map')
    parser.add_argument('--vehicle', choices=('ardupilot', 'px4'))
    with pytest.raises(SystemExit) as ended:
        parser.parse_args(given)
    assert ended.value.code == 2
    assert meant in capsys.readouterr().err


@pytest.mark.parametrize(('given', 'meant'), [
    (['--grid-file', 'x'], 'did you mean --ros-args -p grid_file:=VALUE?'),
    (['-p', 'gird_file:=x'], 'did you mean --ros-args -p grid_file:=VALUE?'),
    (['grid_file=x'], 'did you mean --ros-args -p grid_file:=VALUE?'),
    (['hello'], 'parameters go as --ros-args -p NAME:=VALUE'),
])
def test_a_parameter_without_ros_args(given: list[str], meant: str) -> None:
    assert meant in meant_parameter(given, RecorderConfig)


@pytest.mark.parametrize(('name', 'meant'), [('recoder', 'recorder'), ('Mavlink-Bridge', 'mavlink_bridge'), ('pyton', 'python')])
def test_an_executable(name: str, meant: str) -> None:
    run = subprocess.run([ROOT / 'advise', name], capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert f"'{name}' is unknown; did you mean '{meant}'?" in run.stderr


def test_every_command_has_the_parser_that_says_so() -> None:
    files = [path for path in Path(ROOT, 'advise_ros').rglob('*.py') if path.name != 'command_line.py']
    assert not [path.name for path in files if 'argparse.ArgumentParser(' in path.read_text(encoding='utf-8')]
