"""The graph of one drone: real processes in a namespace and on simulated time."""

from pathlib import Path
from typing import Any

from std_srvs.srv import Trigger

from advise_msgs.action import Fly
from advise_msgs.msg import VehicleStatus
from advise_ros.ros import qos
from support.graph import Graph
from support.processes import Process

NAMESPACE = '/drone'
GRID = """grid:
  {resolution: 2.0, width: 3, height: 2, origin: [-1.0, -1.0], altitude: 3.0, waypoints: [[2, 0], [0, 1], [0, 0]], blocked: []}
"""
PATIENCE_S = 200.0


class Drone:
    """The graph of one drone."""

    def __init__(self, graph: Graph, port: int, directory: Path, *, logged: bool = True) -> None:
        self.graph, self.bag = graph, directory / 'bag'
        self._grid = directory / 'grid.yaml'
        self._grid.write_text(GRID)
        self.logger = self.start_logger() if logged else None
        self.on_grid('recorder')
        self.policy = self.on_grid('policy', speed_m_s=2.0)
        self.on_grid('advise', acquisition='occupancy', clusters=3, budget=1)
        self.start('simulator', endpoint=f'udpout:127.0.0.1:{port}', speedup=10.0, ready_after_s=1.0)
        self.on_grid('mavlink_bridge', url=f'udpin:127.0.0.1:{port}', pose_rate_hz=10.0)

    def start(self, name: str, **params: Any) -> Process:
        params = {'use_sim_time': name != 'simulator', **params}
        return self.graph.start(name, params=params, namespace=NAMESPACE)

    def start_logger(self) -> Process:
        self.logger = self.start('logger', bag=str(self.bag))
        return self.logger

    def on_grid(self, name: str, **params: Any) -> Process:
        return self.start(name, grid_file=str(self._grid), **params)

    def wait(self, topic: str, kind: type, predicate: Any) -> Any:
        """The newest message of a latched topic, once it is as wanted."""
        heard = self.graph.listen(f'{NAMESPACE}/{topic}', kind, qos.latched())
        self.graph.wait_until(lambda: heard and predicate(heard[-1]), PATIENCE_S, f'{topic} to become as wanted')
        return heard[-1]

    def call(self, service: str) -> None:
        response = self.graph.call(Trigger, f'{NAMESPACE}/mavlink_bridge/{service}', timeout_s=PATIENCE_S)
        assert response.success, response.message

    def take_off(self) -> None:
        self.call('takeoff')
        self.wait('vehicle_status', VehicleStatus, lambda m: m.commandable)

    def fly(self) -> None:
        """Take off, fly the newest policy to its end, whatever that is, and land."""
        self.take_off()
        handle = self.graph.accepted_goal(Fly, f'{NAMESPACE}/policy/fly', Fly.Goal(start_cell=4), PATIENCE_S)
        self.graph.result(handle, timeout_s=PATIENCE_S)
        self.call('land')
        self.wait('vehicle_status', VehicleStatus, lambda m: not m.armed)
