"""What a demo run is asked to do, and the files that it takes its parameters from."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from ament_index_python.packages import get_package_share_directory

from advise_ros import config
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.people.known_site import Site, site_of
from advise_ros.recording.gridfile import load_grid
from advise_ros.recording.wishfile import load_wish
from advise_ros.yaml_problem import in_words

# The nodes that the demo starts.
NODES: dict[str, type[Any]] = {
    'simulator': config.SimulatorConfig, 'mavlink_bridge': config.MavlinkBridgeConfig, 'recorder': config.RecorderConfig,
    'logger': config.LoggerConfig, 'advise': config.AdviseConfig, 'policy': config.PolicyConfig,
    'pilot': config.PilotConfig, 'expert': config.ExpertConfig, 'console': config.ConsoleConfig,
}


@dataclass(frozen=True)
class DemoOptions:
    """One run of the demo.

    Attributes:
        expert: 'simulated', or 'human' to wait for a person's answers.
        flights: demonstrations flown in the simulator.
        answers: queries that the expert answers.
        trials: seeds on the grid model behind the success rates; with a person, each with the person's answers.
        speedup: simulated seconds a second.
        grid_file: the site, and the route that is shown and learnt.
        other_grid_file: another route over the same site, flown in the end; None: there is none.
        wish_file: the cells that the simulated people want kept out of; None: there are none.
    """

    expert: str
    seed: int
    flights: int
    answers: int
    trials: int
    speedup: float
    grid_file: Path
    params_file: Path
    out: Path
    other_grid_file: Path | None = None
    wish_file: Path | None = None


@dataclass(frozen=True)
class DemoSites:
    """The routes of a run with what the person knows of the site, the one that is shown and the other one."""

    shown: Site
    other: Site | None


def load_sites(options: DemoOptions) -> DemoSites:
    """Read the grid files and the wish file.

    Raises:
        InputError: one is wrong, or the routes are not over the same site.
    """
    grid = load_grid(options.grid_file)
    cells = load_wish(options.wish_file or '', grid)
    shown = site_of(grid, cells)
    if options.other_grid_file is None:
        return DemoSites(shown, None)
    other = load_grid(options.other_grid_file)
    if _site_of(other) != _site_of(grid):
        raise InputError(
            f'grid file {options.other_grid_file} is of another site than {options.grid_file}; '
            'only its waypoints may differ, name another one by --other-grid'
        )
    load_wish(options.wish_file or '', other)  # Its waypoints may not lie in what is kept out of, either.
    return DemoSites(shown, site_of(other, cells))


def _site_of(grid: Grid) -> tuple[object, ...]:
    """All of a grid but its route."""
    return grid.resolution_m, grid.width, grid.height, grid.origin_enu_m, grid.altitude_m, grid.blocked


def share(name: str) -> Path:
    """A file of the package's config directory."""
    return Path(get_package_share_directory('advise_ros')) / 'config' / name


def node_parameters(params_file: Path, node: str) -> dict[str, Any]:
    """Parameters of one node in a ROS parameter file.

    Raises:
        InputError: the file cannot be read or is no parameter file.
    """
    for name, entry in _tree(params_file).items():
        if str(name).rsplit('/', 1)[-1] == node:
            return {name: value for name, value in entry['ros__parameters'].items() if name != 'use_sim_time'}
    return {}


def _tree(params_file: Path) -> Mapping[Any, Any]:
    try:
        tree = yaml.safe_load(params_file.read_text(encoding='utf-8'))
    except OSError as problem:
        reason = str(problem.strerror)
    except (UnicodeDecodeError, yaml.YAMLError) as problem:
        reason = in_words(problem)
    else:
        if isinstance(tree, Mapping) and all(_has_parameters(entry) for entry in tree.values()):
            return tree
        reason = 'it is not made of nodes with ros__parameters'
    raise InputError(f'parameter file {params_file} cannot be read ({reason}); see config/demo.yaml for one that works')


def _has_parameters(entry: object) -> bool:
    return isinstance(entry, Mapping) and isinstance(entry.get('ros__parameters'), Mapping)


def node_config(params_file: Path, node: str, config_class: type[config.ConfigT]) -> config.ConfigT:
    """The node's config as the node itself would read it.

    Raises:
        InputError: as config.build.
    """
    return config.build(config_class, node_parameters(params_file, node))


def check_parameters(params_file: Path) -> None:
    """Read every node's parameters as the nodes will, before any of them starts.

    Raises:
        InputError: one is unknown or out of range; the message names the node too.
    """
    for node, config_class in NODES.items():
        try:
            node_config(params_file, node, config_class)
        except InputError as problem:
            raise InputError(f'parameter file {params_file}, {node}: {problem}') from None


def free_udp_port() -> int:
    """A UDP port of localhost that nobody uses now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(('127.0.0.1', 0))
        return int(probe.getsockname()[1])
