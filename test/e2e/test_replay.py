"""A session of real processes, in a namespace, recorded by the logger, replays byte for byte."""

import json
from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader
from std_srvs.srv import Trigger

from advise_msgs.action import Fly
from advise_msgs.msg import FlightStatus, LearnerStatus, VehicleStatus
from advise_ros.ros import qos
from support.flying import until_heard
from support.graph import Graph
from support.processes import Process

NAMESPACE = '/drone'
GRID = """grid:
  {resolution: 2.0, width: 3, height: 2, origin: [-1.0, -1.0], altitude: 3.0, waypoints: [[2, 0], [0, 1], [0, 0]], blocked: []}
"""
PATIENCE_S = 200.0


class Drone:
    """The graph of one drone."""

    def __init__(self, graph: Graph, port: int, directory: Path) -> None:
        self.graph, self.bag = graph, directory / 'bag'
        self._grid = directory / 'grid.yaml'
        self._grid.write_text(GRID)
        self.logger = self.start('logger', bag=str(self.bag))
        for name in ('recorder', 'policy'):
            self.on_grid(name, **({'speed_m_s': 2.0} if name == 'policy' else {}))
        self.on_grid('advise', clusters=3, budget=1)
        self.start('simulator', endpoint=f'udpout:127.0.0.1:{port}', speedup=10.0, ready_after_s=1.0)
        self.on_grid('mavlink_bridge', url=f'udpin:127.0.0.1:{port}', pose_rate_hz=10.0)

    def start(self, name: str, **params: Any) -> Process:
        params = {'use_sim_time': name != 'simulator', **params}
        return self.graph.start(name, params=params, namespace=NAMESPACE)

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

    def fly(self) -> None:
        """Take off, fly the newest policy to its end, whatever that is, and land."""
        self.call('takeoff')
        self.wait('vehicle_status', VehicleStatus, lambda m: m.commandable)
        handle = self.graph.accepted_goal(Fly, f'{NAMESPACE}/policy/fly', Fly.Goal(start_cell=4), PATIENCE_S)
        self.graph.result(handle, timeout_s=PATIENCE_S)
        self.call('land')
        self.wait('vehicle_status', VehicleStatus, lambda m: not m.armed)


def test_a_flown_session_replays_byte_for_byte(graph: Graph, free_udp_port: int, tmp_path: Path) -> None:
    drone = Drone(graph, free_udp_port, tmp_path)
    until_heard(graph, f'{NAMESPACE}/pose', f'{NAMESPACE}/recorder', f'{NAMESPACE}/logger', timeout_s=PATIENCE_S)
    heard = {'heard_by': 'recorder,logger', 'heard_timeout_s': PATIENCE_S}
    pilot = drone.on_grid('pilot', flights=1, noise_rate=0.2, speed_m_s=2.0, **heard)
    pilot.wait_exit(PATIENCE_S)
    drone.wait('advise/status', LearnerStatus, lambda m: m.phase == LearnerStatus.ASKING)
    drone.on_grid('expert')
    drone.wait('advise/status', LearnerStatus, lambda m: m.phase == LearnerStatus.DONE and m.answers == 1)
    drone.fly()
    status = drone.wait('policy/status', FlightStatus, lambda m: m.phase > FlightStatus.FLYING)
    assert drone.logger.terminate() == 0
    report = tmp_path / 'report.json'
    replay = graph.run('replay', str(drone.bag), '--json', str(report), timeout_s=PATIENCE_S)
    assert replay.popen.returncode == 0, replay.describe()
    values = json.loads(report.read_text())
    assert (values['asked'], values['namespace']) == ('bytes', NAMESPACE)
    checked = {stage['name']: stage['checked'] for stage in values['stages']}
    assert checked['demonstrations'] == checked['flight windows'] == 1
    assert checked['policies'] == checked['queries'] == 2
    assert checked['commands'] > 10
    assert checked['flight statuses'] >= status.steps
    with AnyReader([drone.bag]) as reader:
        assert {c.topic.removeprefix(NAMESPACE + '/') for c in reader.connections} >= {
            'pose', 'cmd_vel', 'vehicle_status', 'demonstration', 'advise/policy', 'advise/advice_log', 'policy/status',
        }
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
