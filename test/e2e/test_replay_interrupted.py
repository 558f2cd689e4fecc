"""A session of real processes whose logger came late and whose policy was killed in flight replays."""

import json
from pathlib import Path
from typing import Any

from advise_msgs.action import Fly
from advise_msgs.msg import FlightStatus, LearnerStatus, VehicleStatus
from advise_ros.ros import qos
from support.drone import NAMESPACE, PATIENCE_S, Drone
from support.flying import until_heard
from support.graph import Graph


def accepted_by_the_new_one(graph: Graph) -> Any:
    """The node that was killed is discovered for a while, and a goal may be lost between it and the new one: send it again."""
    for _ in range(8):
        try:
            return graph.accepted_goal(Fly, f'{NAMESPACE}/policy/fly', Fly.Goal(start_cell=4), PATIENCE_S / 8)
        except AssertionError:
            continue
    raise AssertionError('no goal was accepted')


def test_a_late_logger_and_a_policy_that_was_killed_in_flight(graph: Graph, free_udp_port: int, tmp_path: Path) -> None:
    drone = Drone(graph, free_udp_port, tmp_path, logged=False)
    until_heard(graph, f'{NAMESPACE}/pose', f'{NAMESPACE}/recorder', timeout_s=PATIENCE_S)
    pilot = drone.on_grid('pilot', flights=1, noise_rate=0.2, speed_m_s=2.0, heard_timeout_s=PATIENCE_S)
    pilot.wait_exit(PATIENCE_S)
    drone.wait('advise/status', LearnerStatus, lambda m: m.phase == LearnerStatus.ASKING)
    logger = drone.start_logger()
    until_heard(graph, f'{NAMESPACE}/pose', f'{NAMESPACE}/logger', timeout_s=PATIENCE_S)

    drone.take_off()
    topic = f'{NAMESPACE}/policy/status'
    graph.accepted_goal(Fly, f'{NAMESPACE}/policy/fly', Fly.Goal(start_cell=4), PATIENCE_S)
    flying = (FlightStatus.TO_START, FlightStatus.FLYING)
    graph.wait_for(topic, FlightStatus, lambda m: m.phase in flying and m.flight_id == 1, qos.latched(), PATIENCE_S)
    drone.policy.kill()
    drone.on_grid('policy', speed_m_s=1.5)
    graph.wait_for(topic, FlightStatus, lambda m: m.phase == FlightStatus.IDLE, qos.latched(), PATIENCE_S, new=True)
    graph.result(accepted_by_the_new_one(graph), timeout_s=PATIENCE_S)
    drone.call('land')
    drone.wait('vehicle_status', VehicleStatus, lambda m: not m.armed)
    assert logger.terminate() == 0

    report = tmp_path / 'report.json'
    replay = graph.run('replay', str(drone.bag), '--json', str(report), timeout_s=PATIENCE_S)
    assert replay.popen.returncode == 0, replay.describe()
    stages = {stage['name']: stage for stage in json.loads(report.read_text())['stages']}
    assert 'flight-001 was flown before the recording began' in stages['demonstrations']['notes'][0]
    assert 'messages on /drone/pose' in stages['demonstrations']['notes'][0]
    assert any('has no end in the bag' in note for note in stages['commands']['notes'])
    assert stages['policies']['checked'] == stages['queries']['checked'] == 1
    assert stages['commands']['checked'] == stages['commands']['equal'] > 10
