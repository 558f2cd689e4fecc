"""policy, guard and mavlink_bridge as managed nodes: what `ros2 lifecycle` asks and sets, by the same services."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
from itertools import dropwhile

import pytest
from action_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from lifecycle_msgs.msg import Transition, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState
from std_srvs.srv import Trigger

from advise_msgs.action import Fly
from advise_msgs.msg import FlightStatus, Policy, VehicleStatus
from advise_ros.ros import qos
from support.flying import pose, velocity
from support.graph import Graph
from support.mock_bridge import MockBridge
from support.policies import best, policy_message, square
from support.scripted import ScriptedCopter, UdpPeer

REST = (0.0, 0.0, 0.0)
STOPPED_WHILE_CONFIGURED = """
import os, sys, time
import rclpy
from std_msgs.msg import String
from advise_ros.config import PolicyConfig
from advise_ros.ros import qos, run
from advise_ros.ros.managed import ManagedNode

class Node(ManagedNode):
    def __init__(self):
        super().__init__('node')
        self.autostart(wanted=True)

    def open_up(self):
        os.kill(os.getpid(), int(sys.argv[1]))
        while rclpy.ok():
            time.sleep(0.01)
        self.listen(String, 'topic', print, qos.COMMAND)

sys.exit(run.run_node(Node, PolicyConfig, []))
"""


def change(graph: Graph, name: str, label: str = '', number: int = 0) -> bool:
    wanted = ChangeState.Request(transition=Transition(id=number, label=label))
    return bool(graph.call(ChangeState, f'{name}/change_state', wanted).success)


def state(graph: Graph, name: str) -> str:
    return str(graph.call(GetState, f'{name}/get_state').current_state.label)


def set_state(graph: Graph, name: str, *labels: str) -> None:
    for label in labels:
        assert change(graph, name, label), label


def said(graph: Graph, name: str, words: str) -> None:
    """By a diagnosis to come: states come back."""
    graph.wait_for(
        '/diagnostics', DiagnosticArray, lambda a: any(s.name == f'/{name}' and words in s.message for s in a.status), new=True)


def vector(command: TwistStamped) -> tuple[float, float, float]:
    linear = command.twist.linear
    return linear.x, linear.y, linear.z


def refused(graph: Graph, words: str) -> None:
    result = graph.refused_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1))
    assert (result.error_code, words in result.error_msg) == (Fly.Result.NOT_ACTIVE, True)
    graph.wait_for('policy/status', FlightStatus, lambda s: words in s.refusal, qos.latched())


def test_the_policy_flies_while_it_is_active_only(graph: Graph) -> None:
    grid = square()
    bridge = MockBridge(graph, grid, speedup=5.0)
    policy = graph.start('policy', {'autostart': False, 'speed_m_s': 2.0})
    events = graph.listen('policy/transition_event', TransitionEvent)
    assert state(graph, 'policy') == 'unconfigured'
    said(graph, 'policy', '/policy is unconfigured: ros2 lifecycle set /policy configure')
    refused(graph, '/policy is unconfigured')
    set_state(graph, 'policy', 'configure')
    graph.publisher('advise/policy', Policy, qos.latched()).publish(policy_message(grid, best(grid)))
    refused(graph, '/policy is inactive: ros2 lifecycle set /policy activate')
    assert not bridge.commands
    set_state(graph, 'policy', 'activate')
    handle = graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1))
    graph.wait_until(lambda: bridge.commands and vector(bridge.commands[-1]) != REST, what='motion')

    set_state(graph, 'policy', 'deactivate')
    graph.wait_until(lambda: all(f'{one}' in policy.text for one in ('inactive -> active', 'active -> inactive')))
    ended = graph.result(handle)
    assert (ended.status, ended.result.phase) == (GoalStatus.STATUS_ABORTED, FlightStatus.STOPPED)
    assert ended.result.message == 'the policy node was deactivated; the vehicle holds'
    graph.wait_until(lambda: vector(bridge.commands[-1]) == REST, what='zero velocity')
    heard = len(bridge.commands)
    said(graph, 'policy', '/policy is inactive')
    assert len(bridge.commands) == heard
    assert not change(graph, 'policy', 'configure'), 'an inactive node is configured already'
    assert not change(graph, 'policy', number=99)
    assert state(graph, 'policy') == 'inactive'

    set_state(graph, 'policy', 'cleanup', 'configure', 'activate')
    handle = graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1))
    graph.wait_until(lambda: vector(bridge.commands[-1]) != REST, what='motion again')
    graph.wait_until(lambda: events and events[-1].goal_state.label == 'active', what='the transitions as events')
    set_state(graph, 'policy', 'shutdown')
    assert graph.result(handle).result.phase == FlightStatus.STOPPED
    graph.wait_until(lambda: vector(bridge.commands[-1]) == REST, what='zero velocity at the end')
    assert policy.wait_exit() == 0


def test_ros2_lifecycle_can_list_what_it_may_ask(graph: Graph) -> None:
    graph.start('guard', {'fence': 'off'})
    assert state(graph, 'guard') == 'active'
    possible = graph.call(GetAvailableTransitions, 'guard/get_available_transitions').available_transitions
    assert {one.transition.label for one in possible} == {'deactivate', 'shutdown'}
    states = graph.call(GetAvailableStates, 'guard/get_available_states').available_states
    assert {'unconfigured', 'inactive', 'active', 'finalized'} <= {one.label for one in states}


def test_an_inactive_guard_passes_zero_velocity_only(graph: Graph) -> None:
    graph.start('guard', {'autostart': False, 'fence': 'off'})
    flown = graph.listen('guard/cmd_vel', TwistStamped, qos.COMMAND)
    said(graph, 'guard', '/guard is unconfigured')
    assert 'stopped' in graph.call(Trigger, 'guard/stop').message
    set_state(graph, 'guard', 'configure')
    poses = graph.publisher('pose', PoseStamped, qos.SENSOR)
    commands = graph.publisher('cmd_vel', TwistStamped, qos.COMMAND)

    def passes(wanted: tuple[float, float, float]) -> None:
        at = len(flown)

        def seen() -> bool:
            poses.publish(pose(1.0, 1.0, 5.0))
            commands.publish(velocity(1.0, 0.0))
            return any(vector(one) == pytest.approx(wanted) for one in flown[at:])

        graph.wait_until(seen, what=f'{wanted} from the guard')

    passes(REST)
    assert {vector(one) for one in flown} == {REST}
    set_state(graph, 'guard', 'activate')
    passes(REST)  # A stop holds on.
    assert {vector(one) for one in flown} == {REST}
    assert graph.call(Trigger, 'guard/release').success
    passes((1.0, 0.0, 0.0))
    set_state(graph, 'guard', 'deactivate')
    passes(REST)
    after_rest = dropwhile(lambda one: vector(one) != REST, reversed(flown))
    assert vector(next(after_rest)) == REST
    set_state(graph, 'guard', 'activate')
    passes((1.0, 0.0, 0.0))


def test_an_inactive_bridge_tells_and_lands_and_nothing_else(graph: Graph, free_udp_port: int) -> None:
    url = f'udpin:127.0.0.1:{free_udp_port}'
    graph.start('mavlink_bridge', {'url': url, 'takeoff_altitude_m': 3.0, 'fence': 'off'})

    def status(words: str = '', *, new: bool = True, **wanted: bool) -> VehicleStatus:
        def fits(message: VehicleStatus) -> bool:
            return words in message.waiting_for and all(getattr(message, name) == value for name, value in wanted.items())

        return graph.wait_for('vehicle_status', VehicleStatus, fits, qos.latched(), new=new)

    with UdpPeer(ScriptedCopter(), free_udp_port) as peer:
        status(ready=True)
        assert graph.call(Trigger, 'mavlink_bridge/takeoff').success
        status(commandable=True)
        commands = graph.publisher('cmd_vel', TwistStamped, qos.COMMAND)

        def flies(east_m_s: float) -> bool:
            commands.publish(velocity(east_m_s, 0.0))
            return bool(peer.copter.setpoints) and peer.copter.setpoints[-1].vy == east_m_s

        graph.wait_until(lambda: flies(0.5), what='motion')
        set_state(graph, 'mavlink_bridge', 'deactivate')
        graph.wait_until(lambda: peer.copter.setpoints[-1].vy == 0.0, what='zero velocity')
        heard = len(peer.copter.setpoints)
        commands.publish(velocity(0.5, 0.0))
        status('/mavlink_bridge is inactive', commandable=False, in_air=True)
        graph.wait_for('pose', PoseStamped, qos=qos.SENSOR, new=True)
        reply = graph.call(Trigger, 'mavlink_bridge/takeoff')
        assert (reply.success, reply.message) == (False, 'take-off refused: /mavlink_bridge is inactive')
        said(graph, 'mavlink_bridge', '/mavlink_bridge is inactive: ros2 lifecycle set /mavlink_bridge activate')
        assert len(peer.copter.setpoints) == heard

        set_state(graph, 'mavlink_bridge', 'activate')
        graph.wait_until(lambda: flies(0.25), what='motion again')
        set_state(graph, 'mavlink_bridge', 'deactivate')
        assert graph.call(Trigger, 'mavlink_bridge/land').success
        status(armed=False, in_air=False)

    set_state(graph, 'mavlink_bridge', 'cleanup')
    status('the bridge was cleaned up', connected=False, new=False)
    assert 'refused: /mavlink_bridge is unconfigured' in graph.call(Trigger, 'mavlink_bridge/land').message
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(('127.0.0.1', free_udp_port))
        assert not change(graph, 'mavlink_bridge', 'configure')
        said(graph, 'mavlink_bridge', f"cannot listen on '{url}'")
        assert state(graph, 'mavlink_bridge') == 'unconfigured'
    set_state(graph, 'mavlink_bridge', 'configure', 'activate')
    with UdpPeer(ScriptedCopter(), free_udp_port):
        status(ready=True)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_stop_in_the_middle_of_a_transition_is_no_failure(ros_env: dict[str, str], number: signal.Signals) -> None:
    command = [sys.executable, '-c', STOPPED_WHILE_CONFIGURED, str(int(number))]
    done = subprocess.run(command, env=ros_env, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (0, '')
