"""The autopilot's clock as everybody's: a simulation that is not in real time and publishes no /clock of its own."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from advise_msgs.msg import Demonstration, VehicleStatus
from advise_ros.core.demonstrations.demonstration import EndReason
from advise_ros.ros import qos
from advise_ros.ros.convert import demonstration_from_msg, stamp_to_ns
from support.flying import until_heard
from support.graph import Graph
from support.scripted import ScriptedCopter, UdpPeer

PATIENCE_S = 90.0
SPEED = 5.0


def simulate(graph: Graph, port: int) -> None:
    """A SITL at five times real time: MAVLink and nothing else."""
    graph.start('simulator', {
        'endpoint': f'udpout:127.0.0.1:{port}', 'speedup': SPEED, 'ready_after_s': 1.0, 'publish_clock': False,
    })


def test_a_demonstration_is_recorded_by_the_autopilots_clock(graph: Graph, square_file: str, free_udp_port: int) -> None:
    simulate(graph, free_udp_port)
    graph.start('mavlink_bridge', {
        'url': f'udpin:127.0.0.1:{free_udp_port}', 'grid_file': square_file, 'clock': 'autopilot', 'pose_rate_hz': 10.0,
    })
    everybody = {'use_sim_time': True, 'grid_file': square_file}
    graph.start('recorder', everybody)
    until_heard(graph, '/pose', '/recorder', timeout_s=PATIENCE_S)
    clocks = graph.listen('/clock', Clock, qos.COMMAND_DEEP)
    poses = graph.listen('pose', PoseStamped, qos.SENSOR_DEEP)
    pilot = graph.start('pilot', {**everybody, 'noise_rate': 0.1, 'seed': 1, 'heard_timeout_s': PATIENCE_S})
    heard = graph.wait_for('demonstration', Demonstration, qos=qos.DEMONSTRATIONS, timeout_s=PATIENCE_S)
    recorded = demonstration_from_msg(heard)
    assert recorded.end_reason is EndReason.FINAL_WAYPOINT
    assert pilot.wait_exit(PATIENCE_S) == 0, pilot.text
    assert f'after {len(recorded.states)} moves' in pilot.text
    times = [stamp_to_ns(message.clock) for message in clocks]
    assert times == sorted(set(times))
    assert {stamp_to_ns(pose.header.stamp) for pose in poses[:-1]} <= set(times)


def test_without_a_clock_the_remedy_is_one_that_helps_here(graph: Graph, free_udp_port: int) -> None:
    simulate(graph, free_udp_port)
    graph.start('mavlink_bridge', {'url': f'udpin:127.0.0.1:{free_udp_port}', 'pose_rate_hz': 10.0, 'fence': 'off'})

    def said(words: str) -> None:
        graph.wait_for('/diagnostics', DiagnosticArray, lambda array: any(
            status.name == '/mavlink_bridge' and words in status.message for status in array.status), timeout_s=PATIENCE_S)

    said('start this node with clock:=autopilot and every other one with use_sim_time:=true')
    graph.publisher('/clock', Clock, qos.COMMAND, readers=0)
    said('set use_sim_time:=true for every node, as there is a /clock')


def test_a_take_off_without_the_clock_that_was_asked_for_is_refused(graph: Graph, free_udp_port: int) -> None:
    graph.start('mavlink_bridge', {
        'url': f'udpin:127.0.0.1:{free_udp_port}', 'takeoff_altitude_m': 3.0, 'use_sim_time': True, 'fence': 'off',
    })
    copter = ScriptedCopter()
    with UdpPeer(copter, free_udp_port):
        graph.wait_for('vehicle_status', VehicleStatus, lambda s: s.connected, qos=qos.latched())
        reply = graph.call(Trigger, 'mavlink_bridge/takeoff')
        assert not reply.success
        assert reply.message.startswith('take-off refused: use_sim_time is set, but nothing arrives on /clock; start what')
        assert not copter.armed
