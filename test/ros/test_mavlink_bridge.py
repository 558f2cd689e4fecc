"""The bridge's process against a scripted autopilot, and against the simulator, on real sockets."""

from __future__ import annotations

import signal
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState
from std_srvs.srv import SetBool, Trigger

from advise_msgs.msg import VehicleStatus
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.messages import dialect
from advise_ros.ros import qos
from support.flying import velocity
from support.graph import Graph
from support.processes import Process
from support.scripted import REFUSAL, RTL, ScriptedCopter, UdpPeer

GRID = str(Path(__file__).parents[2] / 'config' / 'grid_6x6.yaml')


def start(graph: Graph, port: int, **params: object) -> Process:
    url = f'udpin:127.0.0.1:{port}'
    altitude = {'takeoff_altitude_m': 3.0, 'fence': 'auto' if 'grid_file' in params else 'off'}
    return graph.start('mavlink_bridge', params={'url': url, 'heartbeat_timeout_s': 1.0, **altitude, **params})


def wait_status(graph: Graph, predicate: Callable[[VehicleStatus], Any], **kwargs: Any) -> VehicleStatus:
    return graph.wait_for('vehicle_status', VehicleStatus, predicate, qos=qos.latched(), **kwargs)


def said(graph: Graph, words: str) -> None:
    graph.wait_for(
        '/diagnostics', DiagnosticArray, lambda a: any(s.name == '/mavlink_bridge' and words in s.message for s in a.status))


def fly(graph: Graph, peer: UdpPeer) -> Any:
    """Take off by the service and return a publisher of commands."""
    wait_status(graph, lambda s: s.ready)
    reply = graph.call(Trigger, 'mavlink_bridge/takeoff')
    assert reply.success, reply.message
    wait_status(graph, lambda s: s.commandable)
    assert peer.copter.disturbed == 0
    assert not moving(peer)
    return graph.publisher('cmd_vel', TwistStamped, qos.COMMAND)


def moving(peer: UdpPeer) -> list[Any]:
    """The setpoints that are to move it."""
    return [setpoint for setpoint in list(peer.copter.setpoints) if (setpoint.vx, setpoint.vy, setpoint.vz) != (0.0, 0.0, 0.0)]


def on_the_wire(peer: UdpPeer) -> tuple[float, float, float]:
    """The last setpoint's velocity, north-east-down."""
    last = peer.copter.setpoints[-1]
    return last.vx, last.vy, last.vz


def test_takes_off_flies_stops_on_a_stale_command_and_lands(graph: Graph, free_udp_port: int) -> None:
    bridge = start(graph, free_udp_port)
    with UdpPeer(ScriptedCopter(), free_udp_port) as peer:
        commands = fly(graph, peer)
        assert peer.copter.altitude_m >= 2.7
        commands.publish(velocity(1.0, 0.5, -0.25))
        graph.wait_until(lambda: moving(peer), what='a setpoint')
        first = moving(peer)[0]
        assert (first.type_mask, first.coordinate_frame) == (0x05C7, 1)
        assert (first.vx, first.vy, first.vz, first.yaw_rate) == (0.5, 1.0, 0.25, 0.0)
        graph.wait_until(lambda: on_the_wire(peer) == (0.0, 0.0, 0.0), what='zero after the command went stale')
        pose = graph.wait_for('pose', PoseStamped, lambda p: p.pose.position.x > 0.1, qos=qos.SENSOR)
        assert pose.header.frame_id == 'map'
        assert abs(pose.pose.position.x - 2 * pose.pose.position.y) < 0.01
        assert pose.pose.orientation.w == pytest.approx(1.0)  # The scripted nose points east.
        battery = graph.wait_for('battery_state', BatteryState, qos=qos.SENSOR)
        assert (battery.voltage, battery.percentage) == pytest.approx((12.6, 0.8))
        assert graph.call(Trigger, 'mavlink_bridge/land').success
        wait_status(graph, lambda s: not s.armed and not s.in_air, new=True)
    assert bridge.terminate() == 0


def test_a_lost_link_is_reported_and_nothing_old_is_flown_when_it_returns(graph: Graph, free_udp_port: int) -> None:
    start(graph, free_udp_port, max_acceleration_m_s2=10_000.0)
    with UdpPeer(ScriptedCopter(), free_udp_port) as peer:
        commands = fly(graph, peer)
        commands.publish(velocity(1.0, 0.0))
        graph.wait_until(lambda: moving(peer), what='a setpoint')
        peer.muted.set()
        lost = wait_status(graph, lambda s: not s.connected, new=True)
        assert lost.waiting_for == 'heartbeat: the link to the autopilot is lost'
        assert not lost.commandable
        said(graph, 'the link to the autopilot is lost')
        for _ in range(50):  # Each call makes the bridge look at its subscriptions first: none is left in its queue.
            commands.publish(velocity(2.0, 0.0))
            assert not graph.call(Trigger, 'mavlink_bridge/land').success
        peer.copter.setpoints.clear()
        peer.muted.clear()
        wait_status(graph, lambda s: s.commandable, new=True)
        assert not moving(peer)

        def flown_again() -> bool:  # Zero until a fresh pose is there too.
            commands.publish(velocity(0.5, 0.0))
            return any(setpoint.vy for setpoint in peer.copter.setpoints)

        graph.wait_until(flown_again, what='a fresh setpoint')
        assert max(s.vy for s in peer.copter.setpoints) <= 0.5


def test_the_fence_holds_what_is_refused_is_zero_and_its_end_stops_the_vehicle(graph: Graph, free_udp_port: int) -> None:
    bridge = start(graph, free_udp_port, grid_file=GRID, takeoff_altitude_m=0.0, command_timeout_s=60.0, fence='auto')
    heard = graph.listen('/diagnostics', DiagnosticArray)
    copter = ScriptedCopter()
    with UdpPeer(copter, free_udp_port) as peer:
        commands = fly(graph, peer)
        assert copter.altitude_m >= 4.7  # the grid's altitude
        for command, words in (
            (velocity(1.0, 0.0, frame='base_link'), "its frame is 'base_link'; it must be 'map' (ENU)"),
            (velocity(float('nan'), 0.0), 'command refused: it is not finite'),
        ):
            commands.publish(command)
            graph.wait_until(lambda w=words: any(w in s.message for a in list(heard) for s in a.status), what=words)
        assert {(s.vx, s.vy, s.vz) for s in copter.setpoints} == {(0.0, 0.0, 0.0)}
        commands.publish(velocity(-3.0, 0.0))
        graph.wait_until(lambda: copter.position_ned[1] < -1.0, what='a position near the fence at -2 m')
        said(graph, 'fence ahead: east limited')
        assert copter.position_ned[1] > -2.0
        commands.publish(velocity(1.0, 0.0))
        graph.wait_until(lambda: on_the_wire(peer) == (0.0, 1.0, 0.0), what='the setpoint')
        bridge.signal(signal.SIGTERM)
        assert bridge.wait_exit() == 0
        graph.wait_until(lambda: on_the_wire(peer) == (0.0, 0.0, 0.0), what='zero at the end')


def test_an_autopilot_that_is_not_ready_is_told_in_its_words(graph: Graph, free_udp_port: int) -> None:
    start(graph, free_udp_port, ready_timeout_s=1.0)
    assert wait_status(graph, lambda s: True).waiting_for == 'heartbeat: no autopilot has answered'
    assert not graph.call(Trigger, 'mavlink_bridge/takeoff').success
    with UdpPeer(ScriptedCopter(ready=False, refuse={mav.CMD_ARM: REFUSAL}), free_udp_port) as peer:
        wait_status(graph, lambda s: s.waiting_for == 'EKF position, pre-arm check')
        reply = graph.call(SetBool, 'mavlink_bridge/arm', SetBool.Request(data=True))
        assert not reply.success
        assert reply.message == (
            f'arm refused: failed; the autopilot says: {REFUSAL} (still waiting for: EKF position, pre-arm check)')
        assert wait_status(graph, lambda s: s.text).text == REFUSAL
        said(graph, REFUSAL)
        peer.send(dialect.MAVLink_statustext_message(4, b'PreArm: Compass not calibrated'))
        assert 'still waiting for: EKF position' in graph.call(Trigger, 'mavlink_bridge/takeoff').message
        status = wait_status(graph, lambda s: 'given up' in s.waiting_for)
        assert 'the autopilot says: PreArm: Compass not calibrated' in status.waiting_for


def test_garbage_reaches_no_pose_and_a_mode_of_somebody_elses_ends_the_commanding(graph: Graph, free_udp_port: int) -> None:
    start(graph, free_udp_port)
    with UdpPeer(ScriptedCopter(), free_udp_port) as peer:
        poses = graph.listen('pose', PoseStamped, qos.SENSOR_DEEP)
        commands = fly(graph, peer)
        for _ in range(20):
            peer.send(dialect.MAVLink_local_position_ned_message(10**6, float('nan'), 0.0, 0.0, 0.0, 0.0, 0.0))
            peer.send_bytes(b'\xfd\xff\x00\x00 garbage')
        enough = len(poses) + 10
        graph.wait_until(lambda: len(poses) > enough, what='poses')
        assert all(abs(p.pose.position.x) < 1.0 for p in poses)
        stamps = [p.header.stamp.sec * 10**9 + p.header.stamp.nanosec for p in poses]
        assert all(b > a for a, b in pairwise(stamps))
        peer.copter.mode = RTL
        status = wait_status(graph, lambda s: s.mode == 'RTL')
        assert not status.commandable
        assert 'RTL was set by someone else' in status.waiting_for
        peer.copter.setpoints.clear()
        commands.publish(velocity(1.0, 0.0))
        wait_status(graph, lambda s: s.mode == 'RTL', new=True)  # A second later:
        assert not peer.copter.setpoints
        assert peer.copter.mode == RTL


def test_a_bridge_that_starts_anew_commands_only_after_take_over(graph: Graph, free_udp_port: int) -> None:
    bridge = start(graph, free_udp_port)
    with UdpPeer(ScriptedCopter(), free_udp_port) as peer:
        fly(graph, peer)
        bridge.signal(signal.SIGKILL)
        bridge.wait_exit()
        start(graph, free_udp_port)
        status = wait_status(graph, lambda s: s.owner == 'others' and s.in_air, new=True)
        assert not status.commandable
        assert 'somebody else flies it, or a bridge before this one' in status.waiting_for
        peer.copter.setpoints.clear()
        commands = graph.publisher('cmd_vel', TwistStamped, qos.COMMAND)
        commands.publish(velocity(1.0, 0.0))
        refused = graph.call(Trigger, 'mavlink_bridge/takeoff')
        assert not refused.success and 'mavlink_bridge/take_over takes it over' in refused.message
        assert not peer.copter.setpoints
        assert graph.call(Trigger, 'mavlink_bridge/take_over').success
        wait_status(graph, lambda s: s.commandable and s.owner == 'ours', new=True)


def test_simulated_time_without_a_clock_is_waited_for_in_words(graph: Graph, free_udp_port: int) -> None:
    start(graph, free_udp_port, use_sim_time=True)
    clock = graph.publisher('/clock', Clock, qos.COMMAND)
    with UdpPeer(ScriptedCopter(), free_udp_port):
        status = wait_status(graph, lambda s: s.connected)
        assert status.waiting_for == 'a clock: use_sim_time is set, but nothing arrives on /clock'
        poses = graph.listen('pose', PoseStamped, qos.SENSOR_DEEP)

        def stamped() -> bool:
            clock.publish(Clock(clock=Time(sec=70)))
            return bool(poses)

        graph.wait_until(stamped, what='a pose')
        assert 69 <= poses[0].header.stamp.sec <= 71
        wait_status(graph, lambda s: s.ready and s.waiting_for == '')


def test_a_port_in_use_ends_it_and_a_take_off_without_an_altitude_is_refused(graph: Graph, free_udp_port: int) -> None:
    start(graph, free_udp_port, takeoff_altitude_m=0.0)
    reply = graph.call(Trigger, 'mavlink_bridge/takeoff')
    assert not reply.success
    assert "set the parameter 'takeoff_altitude_m' or 'grid_file'" in reply.message
    url = f'udpin:127.0.0.1:{free_udp_port}'
    second = graph.run('mavlink_bridge', params={'url': url, 'fence': 'off'})
    assert second.popen.returncode == 2
    said = f"error: parameter 'url': cannot listen on '{url}': address already in use; "
    assert said + 'stop the other program or take another port' in second.err


def test_flies_the_simulator_over_tcp_at_ten_times_real_time(graph: Graph, free_tcp_port: int) -> None:
    endpoint = f'tcpin:127.0.0.1:{free_tcp_port}'
    graph.start('simulator', params={'endpoint': endpoint, 'speedup': 10.0, 'ready_after_s': 2.0})
    graph.start('mavlink_bridge', params={
        'url': f'tcp:127.0.0.1:{free_tcp_port}', 'grid_file': GRID, 'pose_rate_hz': 10.0, 'use_sim_time': True,
    })
    wait_status(graph, lambda s: s.connected and 'a clock' not in s.waiting_for)
    assert graph.call(Trigger, 'mavlink_bridge/takeoff').success
    wait_status(graph, lambda s: s.commandable)
    commands = graph.publisher('cmd_vel', TwistStamped, qos.COMMAND)

    def moved() -> Any:
        commands.publish(velocity(1.0, 0.0))
        return [p for p in graph.listen('pose', PoseStamped, qos.SENSOR_DEEP) if p.pose.position.x > 2.0]

    at = graph.wait_until(moved, what='a flight of 2 m east')[0].pose.position
    assert abs(at.y) < 0.3 and abs(at.z - 5.0) < 0.5
    assert graph.call(Trigger, 'mavlink_bridge/land').success
    wait_status(graph, lambda s: not s.armed, new=True)
    poses = graph.listen('pose', PoseStamped, qos.SENSOR_DEEP)
    # The simulator's own ticks, which its stamps miss by 2 ms at most.
    assert all(-p.header.stamp.nanosec % 25_000_000 <= 2_000_000 for p in poses)


def test_who_takes_off_outside_the_fence_is_brought_inside_without_a_command(graph: Graph, free_udp_port: int) -> None:
    graph.start('simulator', params={
        'endpoint': f'udpout:127.0.0.1:{free_udp_port}', 'ready_after_s': 1.0, 'publish_clock': False,
        'start_east_m': 14.0, 'start_north_m': 5.0,
    })
    graph.start('mavlink_bridge', params={
        'url': f'udpin:127.0.0.1:{free_udp_port}', 'grid_file': GRID,
    })
    poses = graph.listen('pose', PoseStamped, qos.SENSOR_DEEP)
    wait_status(graph, lambda s: s.ready)
    assert graph.call(Trigger, 'mavlink_bridge/takeoff').success
    said(graph, 'm in plan): it is brought back inside')
    graph.wait_until(lambda: poses[-1].pose.position.x < 11.7, what='a vehicle inside the fence')

    def stands() -> bool:
        return abs(poses[-1].pose.position.x - poses[-40].pose.position.x) < 0.05

    graph.wait_until(stands, what='a vehicle that stands')
    assert 10.5 < poses[-1].pose.position.x < 11.8
    assert abs(poses[-1].pose.position.y - 5.0) < 0.3


def test_flies_a_simulated_px4_over_a_signed_link_and_is_stopped_and_taken(
    graph: Graph, free_udp_port: int, tmp_path: Path,
) -> None:
    key = tmp_path / 'key'
    key.write_text('5a' * 32)
    key.chmod(0o600)
    # Slower than real time: on a busy machine the stream may pause for longer than PX4 allows.
    graph.start('simulator', params={
        'endpoint': f'udpout:127.0.0.1:{free_udp_port}', 'autopilot': 'px4', 'ready_after_s': 1.0, 'signing_key_file': str(key),
        'publish_clock': False, 'speedup': 0.5,
    })
    start(graph, free_udp_port, signing_key_file=str(key), takeoff_altitude_m=1.0, heartbeat_timeout_s=6.0)
    wait_status(graph, lambda s: s.ready and s.autopilot == 'px4')
    reply = graph.call(Trigger, 'mavlink_bridge/takeoff')
    assert reply.success, reply.message
    wait_status(graph, lambda s: s.commandable)
    commands = graph.publisher('cmd_vel', TwistStamped, qos.COMMAND)
    poses = graph.listen('pose', PoseStamped, qos.SENSOR_DEEP)

    def moved() -> Any:
        commands.publish(velocity(1.0, 0.0))
        return poses and poses[-1].pose.position.x > 1.0

    graph.wait_until(moved, what='a flight of 1 m east')
    assert graph.call(Trigger, 'mavlink_bridge/stop').success
    commands.publish(velocity(1.0, 0.0))
    said(graph, 'stopped until released: somebody asked for it')
    assert graph.call(Trigger, 'mavlink_bridge/release').success
    with UdpPeer(ScriptedCopter(), free_udp_port):  # A stranger with the same ids and no key.
        wait_status(graph, lambda s: s.autopilot == 'px4' and s.commandable, new=True)
        assert graph.call(Trigger, 'mavlink_bridge/land').success
        wait_status(graph, lambda s: not s.armed, new=True)
