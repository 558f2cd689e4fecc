"""Writes the parameter tables of README.md from advise_ros/config.py; --check only compares.

    ./advise python tools/parameter_tables.py
"""

from __future__ import annotations

import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

from advise_ros import config

README = Path(__file__).parent.parent / 'README.md'
START, END = '<!-- parameters: made by tools/parameter_tables.py -->\n', '<!-- /parameters -->'
NODES: tuple[tuple[str, type[Any]], ...] = (
    ('recorder', config.RecorderConfig), ('advise', config.AdviseConfig), ('policy', config.PolicyConfig),
    ('mavlink_bridge', config.MavlinkBridgeConfig), ('guard', config.GuardConfig),
    ('simulator', config.SimulatorConfig), ('pilot', config.PilotConfig), ('teleop', config.TeleopConfig),
    ('expert', config.ExpertConfig), ('logger', config.LoggerConfig), ('console', config.ConsoleConfig),
)


def table(name: str, config_class: type[Any]) -> str:
    """One node's parameters as a folded Markdown table."""
    rows = [
        f'| `{spec.name}` | `{spec.default!r}` | {_cell(config.range_text(spec))} | {_cell(spec.metadata["doc"])} |'
        for spec in fields(config_class)
    ]
    head = f'<details><summary><code>{name}</code></summary>\n\n'
    head += '| parameter | default | allowed | meaning |\n| --- | --- | --- | --- |\n'
    return head + '\n'.join(rows) + '\n\n</details>\n'


def _cell(text: str) -> str:
    return text.replace('|', 'or')


def with_tables(readme: str) -> str:
    """The README's text with the tables of today."""
    before, rest = readme.split(START)
    after = rest.split(END)[1]
    return before + START + '\n'.join(table(*node) for node in NODES) + END + after


def main() -> int:
    text = README.read_text(encoding='utf-8')
    new = with_tables(text)
    if '--check' in sys.argv:
        return int(text != new)
    README.write_text(new, encoding='utf-8')
    return 0


if __name__ == '__main__':
    sys.exit(main())
