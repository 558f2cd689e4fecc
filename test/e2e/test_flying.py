"""A demonstration and a policy flown through the real bridge in the simulator, and recorded."""


from std_srvs.srv import Trigger

from advise_msgs.action import Fly
from advise_msgs.msg import Demonstration, Policy, VehicleStatus
from advise_ros.core.demonstrations.demonstration import EndReason
from advise_ros.ros import qos
from advise_ros.ros.convert import demonstration_from_msg
from support.flying import until_heard
from support.graph import Graph
from support.policies import best, policy_message, square

PATIENCE_S = 90.0


def test_pilot_and_policy_fly_in_the_simulator(graph: Graph, square_file: str, free_udp_port: int) -> None:
    grid = square()
    clock = {'use_sim_time': True, 'grid_file': square_file}
    graph.start('simulator', {'endpoint': f'udpout:127.0.0.1:{free_udp_port}', 'speedup': 8.0, 'ready_after_s': 1.0})
    graph.start('mavlink_bridge', {**clock, 'url': f'udpin:127.0.0.1:{free_udp_port}', 'pose_rate_hz': 10.0})
    graph.start('recorder', clock)
    graph.start('policy', clock)
    until_heard(graph, '/pose', '/recorder', timeout_s=PATIENCE_S)
    pilot = graph.start('pilot', {**clock, 'noise_rate': 0.1, 'seed': 1, 'heard_timeout_s': PATIENCE_S})

    heard = graph.wait_for('demonstration', Demonstration, qos=qos.DEMONSTRATIONS, timeout_s=PATIENCE_S)
    recorded = demonstration_from_msg(heard)
    assert recorded.end_reason is EndReason.FINAL_WAYPOINT
    ends = (*recorded.states[1:], grid.goal_state)
    for state, action, then in zip(recorded.states, recorded.actions, ends, strict=True):
        assert grid.successor(state, action) == then
    assert recorded.audit.cell_skips == 0
    assert pilot.wait_exit(PATIENCE_S) == 0, pilot.text
    assert f'after {len(recorded.states)} moves' in pilot.text, f'the recorder saw each of its moves, and no other: {recorded}'

    graph.publisher('advise/policy', Policy, qos.latched()).publish(policy_message(grid, best(grid)))
    assert graph.call(Trigger, 'mavlink_bridge/takeoff').success
    graph.wait_for('vehicle_status', VehicleStatus, lambda s: s.commandable, qos.latched(), new=True)
    handle = graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=0))
    result = graph.result(handle, PATIENCE_S).result
    assert (result.success, result.steps) == (True, 8), result.message
