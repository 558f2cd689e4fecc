"""The policy node against a vehicle of plain arithmetic."""

import math
import signal
import time
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from action_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
from std_srvs.srv import Trigger

from advise_msgs.action import Fly
from advise_msgs.msg import FlightStatus, Policy
from advise_ros.config import PolicyConfig
from advise_ros.core.flight.leg_follower import Pose
from advise_ros.core.flight.policy_flight import FlightPlan, PolicyFlight
from advise_ros.core.grid.grid import Action, Grid
from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.ros import qos
from advise_ros.ros.convert import stamp_to_ns
from support.graph import Graph
from support.mock_bridge import MockBridge
from support.policies import best, policy_message, square

# For tests that cut no poses off: on a busy machine one may be late, and what is commanded then is not what is tried.
PATIENT = {'pose_timeout_s': 30.0}


def publish_policy(graph: Graph, grid: Grid, greedy: tuple[int, ...], version: int = 1) -> None:
    graph.publisher('advise/policy', Policy, qos.latched()).publish(policy_message(grid, greedy, version))


def wait_for_status(graph: Graph, words: str) -> FlightStatus:
    return graph.wait_for('policy/status', FlightStatus, lambda s: words in s.message, qos.latched())


def wait_for_refusal(graph: Graph, words: str) -> FlightStatus:
    return graph.wait_for('policy/status', FlightStatus, lambda s: words in s.refusal, qos.latched())


def fly(graph: Graph, **goal: int) -> Fly.Result:
    return graph.result(graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(**goal))).result


def test_a_flight_and_its_commands_can_be_rebuilt_from_the_poses(graph: Graph) -> None:
    grid = square()
    bridge = MockBridge(graph, grid, speedup=20.0)
    statuses = graph.listen('policy/status', FlightStatus, qos.latched(100))
    graph.start('policy', {'speed_m_s': 2.0, **PATIENT})
    publish_policy(graph, grid, best(grid), version=7)
    feedback: list[Fly.Feedback] = []
    handle = graph.send_goal(Fly, 'policy/fly', Fly.Goal(start_cell=0, policy_version=7), feedback.append)
    assert handle.accepted
    ended = graph.result(handle)
    result = ended.result
    assert ended.status == GoalStatus.STATUS_SUCCEEDED
    assert (result.success, result.phase, result.steps) == (True, FlightStatus.SUCCEEDED, 8)
    assert (result.waypoints_reached, result.policy_version, result.flight_id) == (4, 7, 1)
    assert [f.steps for f in feedback] == sorted(f.steps for f in feedback)
    graph.wait_until(lambda: statuses[-1].phase == FlightStatus.SUCCEEDED)
    assert [s.phase for s in statuses if s.flight_id == 1][:1] == [FlightStatus.TO_START]
    assert {s.start_cell for s in statuses if s.flight_id == 1} == {0}

    flight = PolicyFlight(FlightPlan(grid, best(grid), start_cell=0), PolicyConfig(speed_m_s=2.0).seek_settings())
    end_ns = stamp_to_ns(statuses[-1].header.stamp)
    flown = [c for c in bridge.commands if stamp_to_ns(c.header.stamp) <= end_ns]
    assert len(flown) > 40
    for command in flown:
        stamp_ns = stamp_to_ns(command.header.stamp)
        velocity = flight.step(Pose(stamp_ns, bridge.poses[stamp_ns]))
        assert velocity == (command.twist.linear.x, command.twist.linear.y, command.twist.linear.z)
        assert command.header.frame_id == 'map'
    assert flight.phase == FlightStatus.SUCCEEDED
    after = bridge.commands[len(flown):]
    assert all(stamp_to_ns(c.header.stamp) not in bridge.poses and c.twist.linear.x == c.twist.linear.y == 0.0 for c in after)


def test_flights_that_cannot_begin_are_refused_in_words(graph: Graph, tmp_path: Path) -> None:
    grid = square()
    path = tmp_path / 'grid.yaml'
    path.write_text(yaml.safe_dump({'grid': grid_to_mapping(grid)}))
    policy = graph.start('policy', {'grid_file': str(path), **PATIENT})

    def refused(words: str, code: int = Fly.Result.NO_POLICY, **goal: int) -> None:
        result = graph.refused_goal(Fly, 'policy/fly', Fly.Goal(**goal))
        assert (result.error_code, words in result.error_msg) == (code, True), result
        assert words in wait_for_refusal(graph, words).refusal
        graph.wait_until(lambda: f'policy/fly is refused: {words}'[:30] in policy.text)

    refused('waiting for a policy')
    other = replace(grid, altitude_m=9.0)
    publish_policy(graph, other, best(other))
    graph.wait_until(lambda: 'its grid is not that of grid_file' in policy.text)
    refused('policy 1 is not flown: its grid is not that of grid_file')
    publish_policy(graph, grid, best(grid)[:5], version=2)
    graph.wait_until(lambda: '5 actions for the 36 states' in policy.text)
    publish_policy(graph, grid, best(grid), version=3)
    refused('no pose arrives', Fly.Result.NO_POSE)
    bridge = MockBridge(graph, grid)
    refused('policy 4 is asked for, 3 is the newest one here', policy_version=4)
    refused('start cell 99 is blocked or outside', Fly.Result.NO_START, start_cell=99)
    bridge.frame_id = 'odom'
    diagnosis = graph.wait_for(
        '/diagnostics', DiagnosticArray, lambda m: any("poses are in frame 'odom'" in s.message for s in m.status),
    )
    assert diagnosis.status[0].name == '/policy'
    bridge.frame_id = 'map'
    bridge.vehicle.position[0] = math.nan
    graph.wait_for('/diagnostics', DiagnosticArray, lambda m: any('a pose is not a number' in s.message for s in m.status))
    bridge.vehicle.position[0], bridge.vehicle.velocity[0] = 0.0, 0.0
    bridge.in_air = False
    bridge.publish_status()
    graph.wait_for('/diagnostics', DiagnosticArray, lambda m: any(s.message == 'ready to fly' for s in m.status), new=True)
    refused('the vehicle takes no commands: take off first', Fly.Result.NO_VEHICLE)
    assert not bridge.commands


def test_holding_by_cancel_stop_and_the_vehicle_itself(graph: Graph) -> None:
    grid = square()
    bridge = MockBridge(graph, grid, speedup=2.0)
    graph.start('policy', PATIENT)

    def take_off_and_fly() -> object:
        bridge.in_air = True
        bridge.publish_status()
        publish_policy(graph, grid, best(grid))
        handle = graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1))
        graph.wait_until(lambda: abs(bridge.vehicle.velocity[0]) + abs(bridge.vehicle.velocity[1]) > 0.5, what='motion')
        return handle

    def holds() -> bool:
        linear = bridge.commands[-1].twist.linear
        return (linear.x, linear.y, linear.z) == (0.0, 0.0, 0.0)

    handle = take_off_and_fly()
    assert graph.refused_goal(Fly, 'policy/fly', Fly.Goal()).error_code == Fly.Result.FLIES_ALREADY
    status = wait_for_refusal(graph, 'a flight is under way')
    assert (status.phase, status.message, status.flight_id) == (FlightStatus.FLYING, '', 1)
    graph.cancel(handle)
    ended = graph.result(handle)
    assert (ended.status, ended.result.phase) == (GoalStatus.STATUS_CANCELED, FlightStatus.CANCELED)
    graph.wait_until(holds)

    handle = take_off_and_fly()
    assert 'is stopped' in graph.call(Trigger, 'policy/stop').message
    ended = graph.result(handle)
    assert (ended.status, ended.result.phase) == (GoalStatus.STATUS_ABORTED, FlightStatus.STOPPED)
    graph.wait_until(holds)
    assert graph.call(Trigger, 'policy/stop').message == 'no flight was under way'

    handle = take_off_and_fly()
    bridge.in_air = False
    bridge.publish_status()
    result = graph.result(handle).result
    assert (result.phase, result.message) == (FlightStatus.STOPPED, 'the vehicle takes no commands any more (it is disarmed)')


def test_it_holds_while_poses_are_missing_and_goes_on_when_they_return(graph: Graph) -> None:
    grid = square()
    bridge = MockBridge(graph, grid, speedup=2.0, status=False, wall=True)  # Slow enough to be held up on the way.
    policy = graph.start('policy', {'pose_timeout_s': 0.2, 'speed_m_s': 2.0})
    publish_policy(graph, grid, best(grid))
    handle = graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1))  # Without vehicle_status (another bridge), too.
    graph.wait_until(lambda: bridge.commands and abs(bridge.commands[-1].twist.linear.x) > 0.5)
    bridge.sending = False
    assert wait_for_status(graph, 'holding: no pose for 0.2 s').phase == FlightStatus.FLYING
    graph.wait_until(lambda: bridge.commands[-1].twist.linear.x == 0.0)
    bridge.sending = True
    graph.wait_until(lambda: abs(bridge.commands[-1].twist.linear.x) + abs(bridge.commands[-1].twist.linear.y) > 0.5)

    policy.signal(signal.SIGSTOP)  # Held up, with a pose in its queue that is old when it goes on.
    sent = len(bridge.poses)
    graph.wait_until(lambda: len(bridge.poses) > sent)
    bridge.sending = False
    began_s, flown = time.monotonic(), len(bridge.commands)
    graph.wait_until(lambda: time.monotonic() - began_s > 0.5)
    policy.signal(signal.SIGCONT)
    graph.wait_for('policy/status', FlightStatus, lambda s: 'holding: no pose' in s.message, qos.latched(), new=True)
    graph.wait_until(lambda: len(bridge.commands) > flown + 10)
    assert all(c.twist.linear.x == c.twist.linear.y == 0.0 for c in bridge.commands[flown + 1:])
    bridge.sending = True
    assert graph.result(handle).result.success


def test_poses_that_come_late_are_as_good_as_none(graph: Graph) -> None:
    """A link that delays each one by two seconds loses none, and all of them say where the vehicle was."""
    grid = square()
    bridge = MockBridge(graph, grid, speedup=2.0, wall=True)
    policy = graph.start('policy', {'give_up_s': 600.0})
    publish_policy(graph, grid, best(grid))
    graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1))
    graph.wait_until(lambda: bridge.commands and abs(bridge.commands[-1].twist.linear.x) > 0.5)
    bridge.delay_ticks = 200
    assert wait_for_status(graph, 'holding: poses arrive').phase == FlightStatus.FLYING
    graph.wait_until(lambda: bridge.commands[-1].twist.linear.x == bridge.commands[-1].twist.linear.y == 0.0)
    graph.wait_until(lambda: 'holding: poses arrive' in policy.text)
    bridge.delay_ticks = 0
    graph.wait_until(lambda: abs(bridge.commands[-1].twist.linear.x) + abs(bridge.commands[-1].twist.linear.y) > 0.5)


def test_a_flight_that_lost_its_bridge_never_goes_on_by_itself(graph: Graph) -> None:
    grid = square()
    bridge = MockBridge(graph, grid, speedup=2.0, wall=True)
    policy = graph.start('policy', {'pose_timeout_s': 0.2, 'give_up_s': 0.5, 'speed_m_s': 2.0})
    publish_policy(graph, grid, best(grid))
    handle = graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1))
    graph.wait_until(lambda: bridge.commands and abs(bridge.commands[-1].twist.linear.x) > 0.5)
    bridge.sending = False
    ended = graph.result(handle)
    assert (ended.status, ended.result.phase) == (GoalStatus.STATUS_ABORTED, FlightStatus.STOPPED)
    assert 'the flight is given up and does not go on by itself' in ended.result.message
    assert policy.text.count('holding: no pose for 0.2 s') == policy.text.count('STOPPED, no pose for') == 1
    bridge.sending = True
    graph.wait_for('/diagnostics', DiagnosticArray, lambda m: any(s.message == 'ready to fly' for s in m.status), new=True)
    began = len(bridge.poses)
    graph.wait_until(lambda: len(bridge.poses) > began + 100)
    assert bridge.commands[-1].twist.linear.x == bridge.commands[-1].twist.linear.y == 0.0
    assert graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1)).accepted, 'a new goal flies'


@pytest.mark.parametrize(('changes', 'words'), [
    ({'connected': False}, 'the link to it is lost'),
    ({'armed': False}, 'it is disarmed'),
    ({'mode': 'LOITER', 'waiting_for': 'GUIDED (it is LOITER)'}, 'GUIDED (it is LOITER)'),
])
def test_why_the_vehicle_takes_no_commands_any_more(graph: Graph, changes: dict[str, object], words: str) -> None:
    grid = square()
    bridge = MockBridge(graph, grid, speedup=2.0)
    graph.start('policy', PATIENT)
    publish_policy(graph, grid, best(grid))
    handle = graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1))
    bridge.publish_status(**{'commandable': False, **changes})
    result = graph.result(handle).result
    assert result.message == result.error_msg == f'the vehicle takes no commands any more ({words})'
    assert result.error_code == Fly.Result.STOPPED
    bridge.publish_status()
    graph.wait_for('policy/status', FlightStatus, lambda s: s.phase == FlightStatus.STOPPED, qos.latched())
    assert not [c for c in bridge.commands[-1:] if c.twist.linear.x or c.twist.linear.y], 'it returns, and nothing moves'


def test_without_a_clock_it_says_so_and_refuses(graph: Graph) -> None:
    grid = square()
    bridge = MockBridge(graph, grid)
    policy = graph.start('policy', {'use_sim_time': True})
    publish_policy(graph, grid, best(grid))
    assert graph.refused_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1)).error_code == Fly.Result.NO_CLOCK
    said = 'use_sim_time is set and nothing arrives on /clock; leave use_sim_time out, or start what publishes /clock'
    assert said in wait_for_refusal(graph, said).refusal
    graph.wait_for('/diagnostics', DiagnosticArray, lambda m: any(said in s.message for s in m.status))
    assert not bridge.commands
    assert f'policy/fly is refused: there is no time: {said}' in policy.text


def test_a_failing_policy_ends_by_itself_and_the_next_one_flies(graph: Graph) -> None:
    grid = square()
    MockBridge(graph, grid, speedup=20.0)
    graph.start('policy', {'speed_m_s': 2.0, **PATIENT})
    state = grid.state(0, 1)
    publish_policy(graph, grid, (*best(grid)[:state], int(Action.SOUTH), *best(grid)[state + 1:]))
    result = fly(graph, start_cell=-1)
    assert (result.success, result.phase, result.steps) == (False, FlightStatus.BUDGET_SPENT, 1)
    assert 'stays in cell [1, 0] for ever' in result.message
    publish_policy(graph, grid, best(grid), version=2)
    result = fly(graph, start_cell=0, policy_version=2)
    assert (result.success, result.flight_id, result.policy_version) == (True, 2, 2)


def test_a_wrong_parameter_ends_it_in_one_sentence(graph: Graph) -> None:
    policy = graph.start('policy', {'speed_m_s': 900.0})
    assert policy.wait_exit() == 2
    assert "parameter 'speed_m_s' is 900.0; allowed: 0.05 to 20" in policy.text
    assert 'Traceback' not in policy.text
