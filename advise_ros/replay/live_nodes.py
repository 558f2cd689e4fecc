"""The processes of the nodes that live through a session again."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import yaml
from ament_index_python.packages import get_package_prefix

from advise_ros.config import AdviseConfig, PolicyConfig, RecorderConfig
from advise_ros.core.errors import AdviseError
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.replay.session import RecordedSession
from advise_ros.ros import convert

NODES: Mapping[str, type[Any]] = {'recorder': RecorderConfig, 'advise': AdviseConfig, 'policy': PolicyConfig}
# What would reach back into the recorded session's own files, or hang on how long the clock stands (see Live).
OTHERWISE = {'session_file': '', 'demonstrations_file': '', 'give_up_s': 3600.0}
EXIT_PATIENCE_S = 20.0
LAST_LINES = 5


class LiveNodes:
    """Recorder, learner and policy with the parameters that the bag holds of them; those of which it holds some."""

    def __init__(self, session: RecordedSession) -> None:
        self._session = session
        self._folder = tempfile.TemporaryDirectory(prefix='advise_live_')
        self._nodes: dict[str, subprocess.Popen[bytes]] = {}

    @property
    def names(self) -> frozenset[str]:
        """Of those that were started."""
        return frozenset(self._nodes)

    def start(self) -> None:
        """Raises LogError where the recorded parameters are not those of this version."""
        grid = convert.grid_from_msg(self._session.on('demonstration')[0].value.grid)
        for name, config_class in NODES.items():
            if f'{self._session.namespace}/{name}' in self._session.parameters:
                self._start_node(name, config_class, grid)

    def _start_node(self, name: str, config_class: type[Any], grid: Grid) -> None:
        folder = Path(self._folder.name)
        (folder / 'grid.yaml').write_text(yaml.safe_dump({'grid': grid_to_mapping(grid)}), encoding='utf-8')
        config = self._session.config(config_class, name)
        values = {spec.name: OTHERWISE.get(spec.name, getattr(config, spec.name)) for spec in fields(config)}
        values |= {'grid_file': str(folder / 'grid.yaml'), 'use_sim_time': True}
        file = folder / f'{name}.yaml'
        file.write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}), encoding='utf-8')
        arguments = ['--ros-args', '--params-file', str(file), '-r', f'__ns:={self._session.namespace or "/"}']
        executable = Path(get_package_prefix('advise_ros')) / 'lib' / 'advise_ros' / name
        with (folder / f'{name}.log').open('wb') as log:
            self._nodes[name] = subprocess.Popen(
                [str(executable), *arguments], stdout=log, stderr=log, stdin=subprocess.DEVNULL, start_new_session=True,
            )

    def check(self) -> None:
        """Raises AdviseError, with its last words, when a node has ended."""
        for name, process in self._nodes.items():
            if process.poll() is not None:
                lines = (Path(self._folder.name) / f'{name}.log').read_text(errors='replace').splitlines()[-LAST_LINES:]
                raise AdviseError(f'{name} ended during the replay (exit code {process.returncode}): {" | ".join(lines)}')

    def stop(self) -> None:
        """End them and forget their files."""
        for process in self._nodes.values():
            process.terminate()
        for process in self._nodes.values():
            try:
                process.wait(EXIT_PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()
        self._folder.cleanup()
