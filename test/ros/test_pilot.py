"""The pilot node against a vehicle of plain arithmetic."""


from geometry_msgs.msg import TwistStamped
from std_msgs.msg import String

from advise_msgs.msg import Demonstration
from advise_ros.config import PilotConfig
from advise_ros.core.grid.cell_tracker import CellTracker
from advise_ros.core.grid.grid import Grid
from advise_ros.core.people.known_site import site_of
from advise_ros.nodes.pilot import flight_choices
from advise_ros.ros import qos
from advise_ros.ros.convert import stamp_to_ns
from support.graph import Graph
from support.mock_bridge import MockBridge
from support.policies import square


def moves(grid: Grid, config: PilotConfig, flight: int) -> list[tuple[int, int]]:
    """States and moves as they would come on the grid model."""
    choices, state, chosen = flight_choices(site_of(grid, ()), config, flight), grid.start_state(), []
    while state != grid.goal_state:
        chosen.append((state, choices.action(state)))
        state = grid.successor(*chosen[-1])
    return chosen


def moving(command: TwistStamped) -> bool:
    return bool(command.twist.linear.x or command.twist.linear.y)


def test_two_demonstrations_are_flown_and_the_pilot_leaves(graph: Graph, square_file: str) -> None:
    grid, config = square(), PilotConfig(noise_rate=0.1, seed=3)
    bridge = MockBridge(graph, grid, in_air=False, speedup=20.0)
    told = graph.listen('pilot/status', String, qos.latched(100))
    # A pose that comes late on a busy machine is not what is tried here: its command would have another stamp.
    patient = {'pose_timeout_s': 30.0, 'speed_m_s': 2.0, 'heard_by': ''}
    pilot = graph.start('pilot', {'grid_file': square_file, 'flights': 2, 'seed': 3, 'noise_rate': 0.1, **patient})
    assert pilot.wait_exit(60.0) == 0, pilot.text
    assert (bridge.takeoffs, bridge.landings) == (2, 2)
    assert not bridge.strange, 'a command while the vehicle took none'
    tracker, states = CellTracker(grid, 0.2), [0]
    for stamp_ns, (east, north, up) in bridge.poses.items():
        if up > 0.5 and not tracker.finished and (state := tracker.update(east, north, stamp_ns)) != states[-1]:
            states.append(state)
    assert states[:-1] == [state for state, _ in moves(grid, config, 1)]
    assert all(stamp_to_ns(c.header.stamp) in bridge.poses for c in bridge.commands)
    assert any('flight 2 of 2: flying, cell [0, 0], next waypoint [2, 0]' in s.data for s in told)


def test_a_flight_that_is_given_up_is_recorded_up_to_there(graph: Graph, square_file: str) -> None:
    grid = square()
    bridge = MockBridge(graph, grid, in_air=False, speedup=10.0)
    plan = {'noise_rate': 0.0, 'mistake_share': 0.0, 'max_moves': 5, 'heard_timeout_s': 60.0}
    pilot = graph.start('pilot', {'grid_file': square_file, **plan})
    graph.wait_for('pilot/status', String, lambda s: 'holding until /recorder receives' in s.data, qos.latched())
    graph.start('recorder', {'grid_file': square_file})
    recorded = graph.wait_for('demonstration', Demonstration, qos=qos.DEMONSTRATIONS)
    assert recorded.end_reason == Demonstration.STOPPED
    assert [grid.cell_of(state) for state in recorded.states] == [0, 1, 2, 5, 8]
    assert recorded.audit.ambiguous_actions == 0, 'the recorder heard each command of a move, late as it came'
    assert pilot.wait_exit() == 0, pilot.text
    assert grid.cell_at(*bridge.vehicle.position[:2]) == 0


def test_a_vehicle_that_refuses_ends_it_with_its_words(graph: Graph, square_file: str) -> None:
    bridge = MockBridge(graph, square(), in_air=False)
    bridge.refusal = 'Arm: Compass not calibrated'
    pilot = graph.start('pilot', {'grid_file': square_file})
    assert pilot.wait_exit() == 1
    assert 'flight 1 of 1 could not be flown: the vehicle refused 3 times to take off: Arm: Compass' in pilot.text
    assert 'Traceback' not in pilot.text
    assert not bridge.commands + bridge.strange


def test_a_vehicle_that_is_taken_away_in_flight_is_not_commanded_any_more(graph: Graph, square_file: str) -> None:
    bridge = MockBridge(graph, square(), speedup=5.0)
    pilot = graph.start('pilot', {'grid_file': square_file, 'handle_vehicle': False, 'heard_timeout_s': 0.5})
    graph.wait_until(lambda: any(moving(command) for command in bridge.commands), what='a move')
    assert '/recorder did not count the commands within 0.5 s' in pilot.text
    bridge.in_air = False
    bridge.publish_status()
    assert pilot.wait_exit() == 1
    assert 'the vehicle takes no commands any more (it is disarmed)' in pilot.text
    assert bridge.takeoffs == bridge.landings == 0


def test_it_says_what_is_missing(graph: Graph, square_file: str) -> None:
    unarmed = graph.start('pilot', {'grid_file': square_file, 'vehicle_timeout_s': 1.0})
    gridless = graph.start('pilot')
    assert unarmed.wait_exit() == 1
    assert 'no vehicle_status came within 1 s; start mavlink_bridge' in unarmed.text
    assert gridless.wait_exit() == 2
    assert "set parameter 'grid_file'" in gridless.text


def test_a_flight_depends_on_the_seed_and_its_number_and_keeps_the_mistakes() -> None:
    grid, config = square(), PilotConfig(seed=5)
    assert moves(grid, config, 1) == moves(grid, config, 1)
    assert moves(grid, config, 1) != moves(grid, config, 2)
    site = site_of(grid, ())
    assert flight_choices(site, config, 1).mistakes == flight_choices(site, config, 2).mistakes
    assert flight_choices(site, config, 1).mistakes != flight_choices(site, PilotConfig(seed=6), 1).mistakes
