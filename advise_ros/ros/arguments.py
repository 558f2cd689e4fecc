"""ROS arguments of a command line, refused in words where rcl cannot read them."""

from __future__ import annotations

import re
from collections.abc import Sequence

from rclpy.utilities import remove_ros_args

from advise_ros.core.errors import InputError
from advise_ros.ros import environment

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
    environment.check()
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
        remedy = f'{why[:1].lower()}{why[1:]}; name a YAML file of parameters, see config/advise.yaml for one that works'
    else:
        remedy = REMEDIES.get(kind, why)
    return f"ROS argument '{rule}' cannot be read: {remedy}"
