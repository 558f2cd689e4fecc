"""The demo's graph of processes: which executables run, with which parameters."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from rclpy.node import Node

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.demo.options import DemoOptions, free_udp_port
from advise_ros.supervisor import Child, Supervisor

# The bag replays when both heard the same: the demonstrations come from one of them, the samples from the other.
LISTENERS = ('recorder', 'logger')
# A busy machine may take long to match a new sender with its readers.
HEARD_PATIENCE_S = 120.0


class DemoGraph:
    """Starts the processes of one demo run; at real-time speed they live by the wall clock, else by /clock."""

    def __init__(self, options: DemoOptions, grid: Grid, supervisor: Supervisor) -> None:
        self._options = options
        self._grid = grid
        self._supervisor = supervisor
        self._simulated_time = options.speedup != 1.0
        self._files = ('--params-file', str(options.params_file))
        self._site_map = options.out / 'site.yaml'

    def _node(self, name: str, parameters: dict[str, object], *, may_end: bool = False, log: str = '') -> Child:
        return self._supervisor.start_node(
            name, {'use_sim_time': self._simulated_time, **parameters}, *self._files, may_end=may_end, log=log,
        )

    def _on_grid(self, name: str, parameters: Mapping[str, object] = MappingProxyType({}), **kinds: object) -> Child:
        values: dict[str, object] = {'grid_file': self._options.grid_file, **parameters}
        return self._node(name, values, may_end=bool(kinds.get('may_end', False)), log=str(kinds.get('log', '')))

    def start_vehicle(self) -> None:
        """The simulator and its bridge, for the whole run."""
        port = free_udp_port()
        east, north = self._grid.centre_enu_m(self._grid.waypoints[-1])
        self._supervisor.start_node(
            'simulator',
            {
                'endpoint': f'udpout:127.0.0.1:{port}', 'speedup': float(self._options.speedup),
                'start_east_m': float(east), 'start_north_m': float(north), 'seed': self._options.seed,
                'publish_clock': self._simulated_time,
            },
            *self._files,
        )
        self._on_grid('mavlink_bridge', {'url': f'udpin:127.0.0.1:{port}'})

    def start_recording(self, bag: Path) -> tuple[Child, Child]:
        """The logger and the recorder."""
        return self._node('logger', {'bag': bag}), self._on_grid('recorder')

    def start_learning(self, seed: int, demonstrations: Path | None) -> tuple[Child, Child]:
        """The learner and the policy's pilot; `demonstrations` come from a file, None: from the recorder."""
        values: dict[str, object] = {'seed': seed, 'budget': self._options.answers}
        if self._options.other_grid_file is not None:
            values['site_map_out'] = self._site_map
        if demonstrations is not None:
            values['demonstrations_file'] = demonstrations
        return (
            self._on_grid('advise', values, log=f'advise-{seed}'),
            self._on_grid('policy', log=f'policy-{seed}'),
        )

    def start_other_route(self) -> tuple[Child, Child]:
        """A learner and the policy's pilot for the other route: what is known of the site is what the first learner kept."""
        route = {'grid_file': self._options.other_grid_file}
        values = {'seed': self._options.seed, 'budget': 0, 'site_map_file': self._site_map, **route}
        return self._on_grid('advise', values, log='advise-other'), self._on_grid('policy', route, log='policy-other')

    def start_pilot(self) -> Child:
        """The simulated demonstrator; it ends when all flights are flown."""
        heard = {'heard_by': ','.join(LISTENERS), 'heard_timeout_s': HEARD_PATIENCE_S}
        values = {'flights': self._options.flights, 'seed': self._options.seed, **heard, **self._wish()}
        return self._on_grid('pilot', values, may_end=True)

    def start_console(self) -> Child:
        """The page for a person, on any free port; its log tells the address."""
        return self._node('console', {'port': 0, 'grid_file': self._options.grid_file})

    def start_expert(self, seed: int) -> Child:
        return self._on_grid('expert', {'seed': seed, **self._wish()})

    def _wish(self) -> dict[str, object]:
        """What simulated people know beside the map."""
        return {} if self._options.wish_file is None else {'wish_file': self._options.wish_file}


def refuse_a_second_graph(node: Node, namespace: str = '', *, simulated_time: bool = True) -> None:
    """Raise when nodes of ours run in this namespace already: two graphs would answer each other; or two clocks in one domain.

    Args:
        node: whose discovery is asked.
        namespace: of the graph that is to start, '' for the root.
        simulated_time: whether it makes /clock, which all namespaces of a domain share.

    Raises:
        InputError: with the names and the way out.
    """
    there = {name for name, space in node.get_node_names_and_namespaces() if space.rstrip('/') == namespace.rstrip('/')}
    ours = sorted({'advise', 'policy', 'recorder', 'simulator', 'mavlink_bridge'} & there)
    if ours:
        where = f'namespace {namespace.rstrip("/")}' if namespace else 'this ROS domain'
        raise InputError(
            f'nodes named {", ".join(ours)} run in {where} already; stop them, name another --namespace of fly, '
            'or set ROS_DOMAIN_ID to another number'
        )
    if simulated_time and node.count_publishers('/clock'):
        raise InputError(
            'somebody publishes /clock in this ROS domain already, and there can be one clock only; fly at --speedup 1, '
            'or set ROS_DOMAIN_ID to another number'
        )
