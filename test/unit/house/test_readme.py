"""README says what the code says."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import yaml

from advise_ros.recording.gridfile import load_grid
from support.paths import ROOT

README = (ROOT / 'README.md').read_text(encoding='utf-8')


def test_grid_example_is_a_grid(tmp_path: Path) -> None:
    (example,) = re.findall(r'```yaml\n(grid:.*?)```', README, flags=re.DOTALL)
    path = tmp_path / 'grid.yaml'
    path.write_text(example, encoding='utf-8')
    assert load_grid(path) == load_grid(ROOT / 'config' / 'grid_6x6.yaml')
    assert yaml.safe_load(example)['grid']['waypoints'][-1] == [0, 0]


def test_discretise_examples_run(tmp_path: Path) -> None:
    lines = re.findall(r'^\$ \./(advise discretise .*?)$', README, flags=re.MULTILINE)
    assert len(lines) == 2
    for line in lines:
        command = line.replace('demos.json', str(tmp_path / 'demos.json')).split()
        done = subprocess.run([str(ROOT / command[0]), *command[1:]], cwd=ROOT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert (tmp_path / 'demos.json').stat().st_size > 500
