"""A session of real processes, in a namespace, recorded by the logger, replays byte for byte."""

import json
from pathlib import Path

from rosbags.highlevel import AnyReader

from advise_msgs.msg import FlightStatus, LearnerStatus
from support.drone import NAMESPACE, PATIENCE_S, Drone
from support.flying import until_heard
from support.graph import Graph
from support.parameters import set_parameter


def test_a_flown_session_replays_byte_for_byte(graph: Graph, free_udp_port: int, tmp_path: Path) -> None:
    drone = Drone(graph, free_udp_port, tmp_path)
    until_heard(graph, f'{NAMESPACE}/pose', f'{NAMESPACE}/recorder', f'{NAMESPACE}/logger', timeout_s=PATIENCE_S)
    heard = {'heard_by': 'recorder,logger', 'heard_timeout_s': PATIENCE_S}
    pilot = drone.on_grid('pilot', flights=1, noise_rate=0.2, speed_m_s=2.0, **heard)
    pilot.wait_exit(PATIENCE_S)
    drone.wait('advise/status', LearnerStatus, lambda m: m.phase == LearnerStatus.ASKING)
    drone.on_grid('expert')
    drone.wait('advise/status', LearnerStatus, lambda m: m.phase == LearnerStatus.DONE and m.answers == 1)
    set_parameter(graph, f'{NAMESPACE}/advise', 'budget', 2)
    drone.wait('advise/status', LearnerStatus, lambda m: m.phase == LearnerStatus.DONE and m.answers == 2)
    set_parameter(graph, f'{NAMESPACE}/policy', 'speed_m_s', 1.5)
    drone.fly()
    status = drone.wait('policy/status', FlightStatus, lambda m: m.phase > FlightStatus.FLYING)
    assert drone.logger is not None and drone.logger.terminate() == 0
    report = tmp_path / 'report.json'
    replay = graph.run('replay', str(drone.bag), '--json', str(report), timeout_s=PATIENCE_S)
    assert replay.popen.returncode == 0, replay.describe()
    values = json.loads(report.read_text())
    assert (values['asked'], values['namespace']) == ('bytes', NAMESPACE)
    checked = {stage['name']: stage['checked'] for stage in values['stages']}
    assert checked['demonstrations'] == checked['flight windows'] == 1
    assert checked['policies'] == checked['queries'] == 4, 'one by each of the answers, and one by the larger budget'
    assert checked['commands'] > 10
    assert checked['flight statuses'] >= status.steps
    with AnyReader([drone.bag]) as reader:
        assert {c.topic.removeprefix(NAMESPACE + '/') for c in reader.connections} >= {
            'pose', 'cmd_vel', 'vehicle_status', 'demonstration', 'advise/policy', 'advise/advice_log', 'policy/status',
        }
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
