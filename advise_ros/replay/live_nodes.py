"""The processes of the nodes that live through a session again."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from advise_ros.config import AdviseConfig, PolicyConfig, RecorderConfig
from advise_ros.core.grid.grid import Grid
from advise_ros.core.site.prior import NOTHING, UNKNOWN
from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.recording.sitefile import save_site
from advise_ros.replay.session import RecordedSession
from advise_ros.ros import convert
from advise_ros.supervisor import Supervisor

NODES: Mapping[str, type[Any]] = {'recorder': RecorderConfig, 'advise': AdviseConfig, 'policy': PolicyConfig}
# What would reach back into the recorded session's own files, or hang on how long the clock stands (see Live).
# The recorded grid has its obstacles among the blocked cells.
OTHERWISE = {
    'session_file': '', 'demonstrations_file': '', 'site_map_file': '', 'site_map_out': '', 'obstacle_map_file': '',
    'obstacle_map_topic': '', 'give_up_s': 3600.0,
}


class LiveNodes:
    """Recorder, learner and policy with the parameters that the bag holds of them; those of which it holds some."""

    def __init__(self, session: RecordedSession) -> None:
        self._session = session
        self._folder = tempfile.TemporaryDirectory(prefix='advise_live_')
        self._supervisor = Supervisor(Path(self._folder.name))

    @property
    def names(self) -> frozenset[str]:
        """Of those that were started."""
        return frozenset(self._supervisor.pids())

    def start(self) -> None:
        """Raises LogError where the recorded parameters are not those of this version."""
        on_grid = (*self._session.on('demonstration'), *self._session.on('advise/policy'))
        grid = convert.grid_from_msg(on_grid[0].value.grid)
        for name, config_class in NODES.items():
            if f'{self._session.namespace}/{name}' in self._session.parameters:
                self._start_node(name, config_class, grid)

    def _start_node(self, name: str, config_class: type[Any], grid: Grid) -> None:
        folder = Path(self._folder.name)
        (folder / 'grid.yaml').write_text(yaml.safe_dump({'grid': grid_to_mapping(grid)}), encoding='utf-8')
        config = self._session.config(config_class, name)
        values = {spec.name: OTHERWISE.get(spec.name, getattr(config, spec.name)) for spec in fields(config)}
        values |= {'grid_file': str(folder / 'grid.yaml'), 'use_sim_time': True, **self._site(name, grid)}
        file = folder / f'{name}.yaml'
        file.write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}), encoding='utf-8')
        self._supervisor.start_node(name, {}, '--params-file', str(file), '-r', f'__ns:={self._session.namespace or "/"}')

    def _site(self, name: str, grid: Grid) -> dict[str, str]:
        """What the learner was given of the site, as a file."""
        policies = self._session.on('advise/policy')
        prior = self._session.site_prior(grid, policies[-1].message.publish_time_ns) if policies else NOTHING
        if name != 'advise' or not prior:
            return {}
        percent = np.array(prior.before or [UNKNOWN] * grid.n_cells)
        file = Path(self._folder.name) / 'site.yaml'
        save_site(file, grid, np.where(percent == UNKNOWN, np.nan, percent / 100.0), prior)
        return {'site_map_file': str(file)}

    def check(self) -> None:
        """Look after the nodes.

        Raises:
            ChildDiedError: one has ended; its last words are in the message.
        """
        self._supervisor.check()

    def stop(self) -> None:
        """End them and forget their files."""
        self._supervisor.stop_all()
        self._folder.cleanup()
