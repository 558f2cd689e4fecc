"""Parameters as `ros2 param` describes and sets them, profiles that they override, and files of them."""

from __future__ import annotations

from pathlib import Path

import pytest
from geometry_msgs.msg import PoseStamped, TwistStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.qos import ReliabilityPolicy

from advise_msgs.msg import AdviceQuery, Demonstration, LearnerStatus, Policy
from advise_ros.ros import convert, qos
from support.flying import pose, velocity
from support.graph import Graph
from support.learner import write_grid
from support.parameters import described, parameter, set_parameter, try_parameter
from support.walks import GRID_4X4, walk


def change(graph: Graph, name: str, *labels: str) -> None:
    for label in labels:
        assert graph.call(ChangeState, f'{name}/change_state', ChangeState.Request(transition=Transition(label=label))).success


def refusal(graph: Graph, node: str, name: str, value: object) -> str:
    result = try_parameter(graph, node, name, value)
    assert not result.successful
    return str(result.reason)


def test_a_managed_node_takes_parameters_before_configure_and_says_why_not_after(graph: Graph) -> None:
    graph.start('guard', {'autostart': False, 'fence': 'off', 'max_speed_m_s': 2.0})
    set_parameter(graph, 'guard', 'pose_timeout_s', 0.25)
    assert refusal(graph, 'guard', 'pose_timeout_s', 1000.0) == "parameter 'pose_timeout_s' is 1000.0; allowed: 0.05 to 60"
    assert refusal(graph, 'guard', 'fence', 'on') == "parameter 'fence' is 'on'; allowed: 'auto' | 'off'"
    assert 'must be a float' in refusal(graph, 'guard', 'max_speed_m_s', 'fast')
    assert refusal(graph, 'guard', 'max_sped_m_s', 1.0) == "parameter 'max_sped_m_s' is unknown; did you mean 'max_speed_m_s'?"
    assert 'read at the start: start /guard again with -p autostart:=VALUE' in refusal(graph, 'guard', 'autostart', True)
    set_parameter(graph, 'guard', 'fence', 'auto')
    assert not graph.call(
        ChangeState, 'guard/change_state', ChangeState.Request(transition=Transition(label='configure'))
    ).success, 'a fence is read at configure, and there is no grid'
    set_parameter(graph, 'guard', 'fence', 'off')
    change(graph, 'guard', 'configure', 'activate')

    assert refusal(graph, 'guard', 'pose_timeout_s', 1.0) == (
        "parameter 'pose_timeout_s' is read at configure: ros2 lifecycle set /guard deactivate, then cleanup, set it, then "
        'configure and activate'
    )
    set_parameter(graph, 'guard', 'pose_timeout_s', 0.25)  # As it is: `ros2 param load` of what was dumped.
    assert parameter(graph, 'guard', 'pose_timeout_s') == 0.25
    poses, commands = graph.publisher('pose', PoseStamped, qos.SENSOR), graph.publisher('cmd_vel', TwistStamped, qos.COMMAND)
    flown = graph.listen('guard/cmd_vel', TwistStamped, qos.COMMAND)

    def flies(east_m_s: float) -> bool:
        poses.publish(pose(1.0, 1.0, 5.0))
        commands.publish(velocity(5.0, 0.0))
        return bool(flown) and flown[-1].twist.linear.x == pytest.approx(east_m_s)

    graph.wait_until(lambda: flies(2.0), what='the speed limit')
    set_parameter(graph, 'guard', 'max_speed_m_s', 0.5)
    graph.wait_until(lambda: flies(0.5), what='the lower limit')
    set_parameter(graph, 'guard', 'max_speed_m_s', 3)  # A whole number will do.
    graph.wait_until(lambda: flies(3.0), what='the higher limit')
    assert refusal(graph, 'guard', 'max_speed_m_s', 51.0) == "parameter 'max_speed_m_s' is 51.0; allowed: 0.05 to 50"
    assert flies(3.0)


def test_ros2_param_describe_shows_range_and_what_is_read_only(graph: Graph) -> None:
    graph.start('policy')
    speed, reach, autostart = (described(graph, 'policy', name) for name in ('speed_m_s', 'lead_s', 'autostart'))
    assert (speed.read_only, reach.read_only, autostart.read_only) == (False, False, True)
    assert (speed.floating_point_range[0].from_value, speed.floating_point_range[0].to_value) == (0.05, 20.0)
    assert speed.additional_constraints == 'allowed: 0.05 to 20; from the next flight on'
    assert reach.additional_constraints == 'allowed: 0 to 5; read at configure'
    assert autostart.additional_constraints == 'allowed: true | false; read at the start'


def test_a_learner_asks_anew_when_its_budget_is_set(graph: Graph, tmp_path: Path) -> None:
    graph.start('advise', {'grid_file': write_grid(tmp_path, GRID_4X4), 'acquisition': 'occupancy', 'clusters': 4, 'budget': 0})
    demonstrations = graph.publisher('demonstration', Demonstration, qos.DEMONSTRATIONS)
    demonstrations.publish(convert.demonstration_to_msg(walk(GRID_4X4, 0)))
    status = graph.wait_for('advise/status', LearnerStatus, lambda m: m.phase == m.DONE and m.demonstrations, qos.latched())
    assert status.budget_left == 0
    first = graph.wait_for('advise/policy', Policy, lambda m: True, qos.latched()).version
    set_parameter(graph, 'advise', 'budget', 5)
    query = graph.wait_for('advise/query', AdviceQuery, lambda m: m.query_id > 0, qos.latched())
    assert (query.policy_version > first, query.budget_left) == (True, 5)
    assert 'read at the start: start /advise again' in refusal(graph, 'advise', 'clusters', 5)
    assert described(graph, 'advise', 'clusters').read_only


def test_profiles_are_overridden_by_parameters(graph: Graph) -> None:
    graph.start('guard', {
        'fence': 'off', 'qos_overrides./pose.subscription.reliability': 'reliable',
        'qos_overrides./guard/pose.publisher.depth': 7,
    })
    graph.wait_until(lambda: graph.node.get_subscriptions_info_by_topic('/pose'), what='the subscription')
    (subscription,) = graph.node.get_subscriptions_info_by_topic('/pose')
    assert subscription.qos_profile.reliability == ReliabilityPolicy.RELIABLE
    assert parameter(graph, 'guard', 'qos_overrides./guard/pose.publisher.depth') == 7
    assert parameter(graph, 'guard', 'qos_overrides./pose.subscription.history') == 'keep_last'

    wrong = graph.start('guard', {'fence': 'off', 'qos_overrides./posee.subscription.depth': 7}, namespace='/other')
    assert wrong.wait_exit() == 2
    assert "fits no topic that this node opens; did you mean 'qos_overrides./other/pose.subscription.depth'?" in wrong.text


def test_a_file_says_whose_keys_it_has_wrong_and_its_general_keys_suit_every_node(graph: Graph, tmp_path: Path) -> None:
    file = tmp_path / 'my.yaml'
    file.write_text(
        '/**: {ros__parameters: {grid_file: none.yaml, fence: "off", pose_frame: odom}}\n'
        'gaurd: {ros__parameters: {max_speed_m_s: 1.0}}\n'
    )
    guard = graph.start('guard', args=['--ros-args', '--params-file', str(file), '-p', "grid_file:=''", '--'])
    graph.wait_until(lambda: "'/gaurd' is no node, and nothing below it is read; the nearest is '/guard'" in guard.text)
    assert parameter(graph, 'guard', 'pose_frame') == 'odom'
    graph.start('simulator', {'ready_after_s': 1.0}, args=['--ros-args', '--params-file', str(file), '--'])
    assert parameter(graph, 'simulator', 'ready_after_s') == 1.0
