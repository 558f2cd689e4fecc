"""The policy node against a vehicle of plain arithmetic."""

from action_msgs.msg import GoalStatus

from advise_msgs.action import Fly
from advise_msgs.msg import FlightStatus, Policy
from advise_ros.ros import qos
from support.graph import Graph
from support.mock_bridge import MockBridge
from support.policies import best, policy_message, square


def publish_policy(graph: Graph, message: Policy) -> None:
    publisher = graph.publisher('advise/policy', Policy, qos.latched())
    publisher.publish(message)


def test_a_policy_flies_to_the_final_waypoint(graph: Graph) -> None:
    grid = square()
    bridge = MockBridge(graph, grid)
    graph.start('policy')
    publish_policy(graph, policy_message(grid, best(grid), version=7))
    feedback: list[Fly.Feedback] = []
    handle = graph.send_goal(Fly, 'policy/fly', Fly.Goal(start_cell=0), feedback.append)
    assert handle.accepted
    ended = graph.result(handle)
    result = ended.result
    assert ended.status == GoalStatus.STATUS_SUCCEEDED and result.success and result.phase == FlightStatus.SUCCEEDED
    assert (result.steps, result.waypoints_reached, result.policy_version) == (8, 4, 7)
    print('seconds', result.seconds, len(bridge.commands))
    assert [f.steps for f in feedback if f.steps] == sorted(f.steps for f in feedback if f.steps)
