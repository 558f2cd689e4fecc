"""Writes config/advise.yaml and docs/parameters.md from the dataclasses of advise_ros/config; --check only compares.

    ./advise python tools/parameters.py
"""

from __future__ import annotations

import json
import sys
import textwrap
from dataclasses import Field, fields
from pathlib import Path
from typing import Any

from advise_ros import config

ROOT = Path(__file__).parent.parent
YAML_HEAD = """\
# Every node's parameters with their defaults: copy, edit and start nodes with it,
#   ros2 run advise_ros policy --ros-args --params-file my.yaml
#   ros2 launch advise_ros advise.launch.py params_file:=my.yaml
# /**/NAME means the node NAME in any namespace. An unknown name or a value out of range stops the node
# with a sentence. The learner as the paper has it: config/paper.yaml.
# Made by tools/parameters.py from advise_ros/config.py; a test compares the two.
"""
PAGE_HEAD = """\
<!-- Made by tools/parameters.py from advise_ros/config.py; a test compares the two. -->
# Parameters

Every parameter of every node. The same defaults stand in [config/advise.yaml](../config/advise.yaml), to copy and edit:

```console
$ ./advise policy --ros-args -p speed_m_s:=0.8                # one parameter
$ ./advise policy --ros-args --params-file my.yaml            # a file of your own
$ ros2 launch advise_ros advise.launch.py params_file:=my.yaml
$ ./advise policy --help                                      # the same list in the terminal
```

- A name that is not known or a value out of range stops the node at its start; the sentence names the allowed range.
  Both ends of a range are allowed.
- The column "set" says from when on `ros2 param set` counts. What is read at configure (nodes with a life cycle) is taken while
  the node is unconfigured (`ros2 lifecycle set /policy deactivate`, then `cleanup`, set it, `configure`, `activate`), what is
  read at the start only then; elsewhere it is refused, with the way to do it. A bag holds every change, and replay makes it
  again.
- `ros2 param describe` shows meaning, range and whether a parameter is read-only, `ros2 param dump` writes a file for
  `--params-file`.
- Profiles: `qos_overrides./TOPIC.publisher.reliability` (or `subscription`; `history`, `depth`) changes that of a topic, named
  as `ros2 topic list` shows it. One that fits nothing the node opens is an error.
- In a file, what stands below a name with a wildcard (`/**`) goes to each node that has such a parameter. A key that is no
  node's name but nearly one, or a file without anything for the node, is warned of.
- "Steady time" runs on when the system's or the simulation's clock is set; all other times are those of the ROS clock.
- Every node also takes `use_sim_time` and `service_introspection`: `off`, `metadata` or `contents` of its service calls are
  published, and so recorded.
- The learner as the paper prints it: [config/paper.yaml](../config/paper.yaml);
  what the difference is worth: [method.md](method.md).

"""
# Suffix of the name -> unit, longest first.
UNITS = {
    '_m_s2': 'm/s²', '_rad_s': 'rad/s', '_m_s': 'm/s', '_1_s': '1/s', '_m': 'm', '_s': 's', '_hz': 'Hz', '_kib': 'KiB',
    '_mib': 'MiB',
}


def parameter_file() -> str:
    """The text of config/advise.yaml."""
    return YAML_HEAD + ''.join(_yaml_of_node(name, owner) for name, owner in config.NODES.items())


def _yaml_of_node(name: str, owner: type[Any]) -> str:
    lines = [f'\n/**/{name}:', '  ros__parameters:']
    for spec in fields(owner):
        lines += textwrap.wrap(
            f'{spec.metadata["doc"]} [{config.range_text(spec)}]', 110, initial_indent='    # ', subsequent_indent='    #   ',
        )
        lines.append(f'    {spec.name}: {_yaml_value(spec)}')
    return '\n'.join(lines) + '\n'


def _yaml_value(spec: Field[Any]) -> str:
    """The default as YAML that reads back with the same type."""
    if isinstance(spec.default, str):
        return f"'{spec.default}'"
    shown = json.dumps(spec.default)
    return shown if 'e' not in shown or isinstance(spec.default, bool) else f'{spec.default:f}'


def parameter_page() -> str:
    """The text of docs/parameters.md."""
    contents = 'Nodes: ' + ', '.join(f'[{name}](#{name})' for name in config.NODES) + '.\n'
    return PAGE_HEAD + contents + ''.join(_table_of_node(name, owner) for name, owner in config.NODES.items())


def _table_of_node(name: str, owner: type[Any]) -> str:
    purpose = owner.__doc__.split('\n')[0].split(': ')[-1].removeprefix(f'/{name}, ')
    head = f'\n## {name}\n\n{purpose[0].upper()}{purpose[1:]}\n\n'
    head += '| parameter | default | allowed | unit | set | meaning |\n| --- | --- | --- | --- | --- | --- |\n'
    return head + ''.join(_row(owner, spec) for spec in fields(owner))


def _row(owner: type[Any], spec: Field[Any]) -> str:
    allowed = config.range_text(spec).replace(' | ', ' or ')
    unit = next((unit for suffix, unit in UNITS.items() if spec.name.endswith(suffix)), '')
    when, meaning = config.counts_from(owner, spec.name), spec.metadata['doc']
    return f'| `{spec.name}` | `{_yaml_value(spec)}` | {allowed} | {unit} | {when} | {meaning} |\n'


def main() -> int:
    files = {ROOT / 'config' / 'advise.yaml': parameter_file(), ROOT / 'docs' / 'parameters.md': parameter_page()}
    if '--check' in sys.argv:
        return int(any(not path.exists() or path.read_text(encoding='utf-8') != text for path, text in files.items()))
    for path, text in files.items():
        path.write_text(text, encoding='utf-8')
    return 0


if __name__ == '__main__':
    sys.exit(main())
