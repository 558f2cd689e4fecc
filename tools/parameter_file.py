"""Writes config/advise.yaml from advise_ros/config.py; --check only compares.

    ./advise python tools/parameter_file.py
"""

from __future__ import annotations

import json
import sys
import textwrap
from dataclasses import Field, fields
from pathlib import Path
from typing import Any

from parameter_tables import NODES

from advise_ros import config

FILE = Path(__file__).parent.parent / 'config' / 'advise.yaml'
HEAD = """\
# Every node's parameters with their defaults: copy, edit and start nodes with it,
#   ros2 run advise_ros policy --ros-args --params-file my.yaml
#   ros2 launch advise_ros advise.launch.py params_file:=my.yaml
# /**/NAME means the node NAME in any namespace. An unknown name or a value out of range stops the node
# with a sentence. The learner as the paper has it: config/paper.yaml.
# Made by tools/parameter_file.py from advise_ros/config.py; a test compares the two.
"""


def text() -> str:
    return HEAD + ''.join(_node(name, config_class) for name, config_class in NODES)


def _node(name: str, config_class: type[Any]) -> str:
    lines = [f'\n/**/{name}:', '  ros__parameters:']
    for spec in fields(config_class):
        lines += textwrap.wrap(
            f'{spec.metadata["doc"]} [{config.range_text(spec)}]', 110, initial_indent='    # ', subsequent_indent='    #   ',
        )
        lines.append(f'    {spec.name}: {_value(spec)}')
    return '\n'.join(lines) + '\n'


def _value(spec: Field[Any]) -> str:
    """The default as YAML that reads back with the same type."""
    if isinstance(spec.default, str):
        return f"'{spec.default}'"
    shown = json.dumps(spec.default)
    return shown if 'e' not in shown or isinstance(spec.default, bool) else f'{spec.default:f}'


def main() -> int:
    if '--check' in sys.argv:
        return int(not FILE.exists() or FILE.read_text(encoding='utf-8') != text())
    FILE.write_text(text(), encoding='utf-8')
    return 0


if __name__ == '__main__':
    sys.exit(main())
