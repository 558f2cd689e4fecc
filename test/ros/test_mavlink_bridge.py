"""The bridge's process against a scripted autopilot on a real socket."""

from __future__ import annotations

from geometry_msgs.msg import PoseStamped, TwistStamped
from std_srvs.srv import SetBool, Trigger

from advise_msgs.msg import VehicleStatus
from advise_ros.ros import qos
from support.graph import Graph
from support.scripted import ScriptedCopter, UdpPeer


def start(graph: Graph, port: int, **params: object) -> object:
    url = f'udpin:127.0.0.1:{port}'
    return graph.start('mavlink_bridge', params={'url': url, 'takeoff_altitude_m': 3.0, 'heartbeat_timeout_s': 1.0, **params})


def wait_status(graph: Graph, predicate: object, **kwargs: object) -> VehicleStatus:
    return graph.wait_for('vehicle_status', VehicleStatus, predicate, qos=qos.latched(), **kwargs)


def velocity(east: float, north: float, up: float = 0.0, frame: str = 'map') -> TwistStamped:
    message = TwistStamped()
    message.header.frame_id = frame
    message.twist.linear.x, message.twist.linear.y, message.twist.linear.z = east, north, up
    return message


def test_takes_off_flies_stops_on_a_stale_command_and_lands(graph: Graph, free_udp_port: int) -> None:
    bridge = start(graph, free_udp_port)
    with UdpPeer(ScriptedCopter(), free_udp_port) as peer:
        wait_status(graph, lambda s: s.ready)
        reply = graph.call(Trigger, 'mavlink_bridge/takeoff')
        assert reply.success, reply.message
        wait_status(graph, lambda s: s.commandable)
        assert peer.copter.altitude_m >= 2.7
        assert not peer.copter.setpoints  # None during the take-off, none before the first command.
        graph.publisher('cmd_vel', TwistStamped, qos.COMMAND).publish(velocity(1.0, 0.5))
        graph.wait_until(lambda: any(abs(s.vy - 1.0) < 1e-6 for s in peer.copter.setpoints), what='the setpoint')
        first = peer.copter.setpoints[0]
        assert (first.type_mask, first.coordinate_frame) == (0x05C7, 1)
        assert (first.vx, first.vy, first.vz, first.yaw_rate) == (0.5, 1.0, 0.0, 0.0)
        graph.wait_until(lambda: peer.copter.setpoints[-1].vy == 0.0, what='zero after the command went stale')
        pose = graph.wait_for('pose', PoseStamped, lambda p: p.pose.position.x > 0.1, qos=qos.SENSOR)
        assert pose.header.frame_id == 'map'
        assert abs(pose.pose.position.x - 2 * pose.pose.position.y) < 0.01
        assert graph.call(Trigger, 'mavlink_bridge/land').success
        wait_status(graph, lambda s: not s.armed and not s.in_air, new=True)
    assert bridge.terminate() == 0


def test_arming_before_ready_shows_the_autopilots_text(graph: Graph, free_udp_port: int) -> None:
    start(graph, free_udp_port)
    copter = ScriptedCopter(ready=False, refuse={400: 'Arm: Need Position Estimate'})
    with UdpPeer(copter, free_udp_port):
        wait_status(graph, lambda s: s.connected)
        reply = graph.call(SetBool, 'mavlink_bridge/arm', SetBool.Request(data=True))
        assert not reply.success
        assert 'Arm: Need Position Estimate' in reply.message
        assert 'EKF position, pre-arm check' in reply.message
        status = wait_status(graph, lambda s: s.text)
        assert status.text == 'Arm: Need Position Estimate'
