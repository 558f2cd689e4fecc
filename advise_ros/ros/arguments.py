"""ROS arguments and environment, refused in words where rcl cannot read them."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

import yaml
from rclpy.utilities import remove_ros_args

from advise_ros.core.errors import InputError
from advise_ros.yaml_problem import in_words

# "Couldn't parse remap rule: '-r __ns:=drone1'. Error: ..., at FILE:LINE" in rcl's words.
RULE = re.compile(r"Couldn't parse (?P<kind>[a-z ]+): '(?P<rule>.*)'\. Error: (?P<why>.*?)(?:\n|, at /|$)", re.DOTALL)
FORMS = '--ros-args -p NAME:=VALUE -r FROM:=TO --params-file FILE'
REMEDIES = {
    'parameter override rule': 'write -p NAME:=VALUE',
    'remap rule': 'write -r FROM:=TO; names have letters, digits, _ and / only',
    'log level': 'write --log-level debug, info, warn, error or fatal',
}


def without_ros(args: Sequence[str]) -> list[str]:
    """What is left of a command line (program name not included) when ROS has taken its arguments.

    Raises:
        InputError: rcl cannot read its share, or cannot start in this environment; names the argument or variable
            and the form that works.
    """
    check_environment()
    try:
        return list(remove_ros_args(['program', *args])[1:])
    except Exception as problem:  # noqa: BLE001  rclpy raises several private types for malformed arguments
        raise InputError(_sentence(str(problem))) from None


def _sentence(problem: str) -> str:
    found = RULE.search(problem)
    if found is None:
        first = problem.splitlines()[0].split(', at /')[0].rstrip('.').removeprefix('Failed to parse ROS arguments: ')
        return f'ROS arguments cannot be read: {first}; the forms are {FORMS}'
    kind, rule, why = found['kind'], found['rule'], found['why']
    if '__ns:=' in rule:
        remedy = 'a namespace begins with a slash and has letters, digits and _ only, as in -r __ns:=/drone1'
    elif kind == 'params file':
        remedy = f'{_why_no_parameters(rule, why)}; name a YAML file of parameters, see config/advise.yaml for one that works'
    else:
        remedy = REMEDIES.get(kind, why)
    return f"ROS argument '{rule}' cannot be read: {remedy}"


def _why_no_parameters(rule: str, why: str) -> str:
    """rcl counts no lines; PyYAML does."""
    try:
        yaml.safe_load(Path(rule.rpartition(' ')[2]).read_text(encoding='utf-8'))
    except (yaml.YAMLError, UnicodeDecodeError) as problem:
        return in_words(problem)
    except OSError:
        pass
    return f'{why[:1].lower()}{why[1:]}'


# Above this DDS runs out of port numbers.
DOMAIN_MAX = 232


def check_environment() -> None:
    """Look at ROS_DOMAIN_ID and at where ROS will write its logs.

    Raises:
        InputError: rcl could not start with them; names the variable, its value and the remedy.
    """
    _check_domain(os.environ.get('ROS_DOMAIN_ID', ''))
    _check_log_directory()


def _check_domain(domain: str) -> None:
    if domain and not (domain.isascii() and domain.isdigit() and int(domain) <= DOMAIN_MAX):
        raise InputError(
            f'ROS_DOMAIN_ID is {domain!r}; it must be a whole number from 0 to {DOMAIN_MAX}, the same for all that are to meet'
        )


def _check_log_directory() -> None:
    """The directory that rcl_logging takes: ROS_LOG_DIR, ROS_HOME/log or ~/.ros/log."""
    remedy = 'set ROS_LOG_DIR to a directory that you may write'
    named, home = os.environ.get('ROS_LOG_DIR'), os.environ.get('ROS_HOME')
    if not (named or home or os.environ.get('HOME')):
        raise InputError(f'ROS has no place for its logs: HOME is not set; {remedy}')
    directory = Path(named or (Path(home) / 'log' if home else '~/.ros/log')).expanduser()
    try:
        directory.mkdir(parents=True, exist_ok=True)
        problem = '' if os.access(directory, os.W_OK) else 'it may not be written'
    except OSError as refused:
        problem = str(refused.strerror)
    if problem:
        raise InputError(f"ROS cannot write its logs into '{directory}': {problem}; {remedy}")
