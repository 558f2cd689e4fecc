"""A policy's goal whose bridge died in flight stays ended, whatever comes back."""


from geometry_msgs.msg import PoseStamped, TwistStamped
from std_srvs.srv import Trigger

from advise_msgs.action import Fly
from advise_msgs.msg import FlightStatus, Policy, VehicleStatus
from advise_ros.ros import qos
from support.graph import Graph
from support.policies import best, policy_message, square
from support.processes import Process

PATIENCE_S = 90.0


def moves(command: TwistStamped) -> bool:
    linear = command.twist.linear
    return any((linear.x, linear.y, linear.z))


def test_a_new_bridge_does_not_make_a_flight_go_on(graph: Graph, square_file: str, free_udp_port: int) -> None:
    grid = square()
    clock = {'use_sim_time': True, 'grid_file': square_file}

    def start_bridge() -> Process:
        return graph.start('mavlink_bridge', {**clock, 'url': f'udpin:127.0.0.1:{free_udp_port}', 'pose_rate_hz': 10.0})

    graph.start('simulator', {'endpoint': f'udpout:127.0.0.1:{free_udp_port}', 'speedup': 4.0, 'ready_after_s': 1.0})
    bridge = start_bridge()
    policy = graph.start('policy', {**clock, 'give_up_s': 1.0})
    graph.publisher('advise/policy', Policy, qos.latched()).publish(policy_message(grid, best(grid)))
    graph.wait_for('vehicle_status', VehicleStatus, lambda s: s.ready, qos.latched(), PATIENCE_S)
    assert graph.call(Trigger, 'mavlink_bridge/takeoff').success
    graph.wait_for('vehicle_status', VehicleStatus, lambda s: s.commandable, qos.latched(), PATIENCE_S, new=True)
    commands = graph.listen('cmd_vel', TwistStamped, qos.COMMAND_DEEP)
    handle = graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1), PATIENCE_S)
    graph.wait_until(lambda: commands and moves(commands[-1]), PATIENCE_S, 'motion')

    bridge.kill()
    ended = graph.result(handle, PATIENCE_S).result
    assert (ended.success, ended.phase) == (False, FlightStatus.STOPPED)
    assert 'does not go on by itself' in ended.message
    assert 'holding: no pose' in policy.text and 'STOPPED' in policy.text

    since = len(commands)
    start_bridge()
    poses = graph.listen('pose', PoseStamped, qos.SENSOR)
    came = len(poses)
    graph.wait_until(lambda: len(poses) > came + 100, PATIENCE_S, 'poses of the new bridge')
    assert not any(moves(command) for command in commands[since:])
