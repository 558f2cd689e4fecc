"""The recorder as a process: topics, a live link or a log in, demonstrations out."""

import itertools
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from std_srvs.srv import Trigger

from advise_msgs.msg import Demonstration, FlightStatus, LearnerStatus, VehicleStatus
from advise_ros.config import RecorderConfig
from advise_ros.core.demonstrations.demonstration import EndReason
from advise_ros.core.demonstrations.discretise import discretise
from advise_ros.core.demonstrations.samples import NO_COMMANDS, CommandSamples, Recording
from advise_ros.core.grid.grid import Action
from advise_ros.core.units import NS
from advise_ros.mavlink.messages import dialect
from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.ros import convert, qos
from support.flown import GRID, flight, round_trip
from support.graph import Graph
from support.learner import Learner
from support.learning import taken_back
from support.walks import walk

BAGS = Path(__file__).parents[2] / 'bags'
GRID_6X6 = Path(__file__).parents[2] / 'config' / 'grid_6x6.yaml'
SETTINGS = RecorderConfig().discretise_settings()


@pytest.fixture
def grid_file(tmp_path: Path) -> str:
    path = tmp_path / 'grid.yaml'
    path.write_text(yaml.safe_dump({'grid': grid_to_mapping(GRID)}))
    return str(path)


# Best effort: a burst of hundreds would overrun the socket's buffer.
PACE_S = 0.002
ON_THE_GROUND_ENU_M = np.zeros(3)


def until_heard(graph: Graph, send: Callable[[int], None]) -> None:
    """Send positions, stamped 1, 2, 3 ... ns, until the recorder says that some arrive.

    A publisher may be matched before its reader is: what is sent between is lost, by best effort without a trace.
    """
    heard = graph.listen('/diagnostics', DiagnosticArray)
    stamps = itertools.count(1)
    begin = len(heard)

    def arrived() -> bool:
        send(next(stamps))
        said = [s for array in heard[begin:] for s in array.status if s.name.endswith('recorder')]
        return bool(said) and 'waiting for positions' not in said[-1].message

    graph.wait_until(arrived, what='the recorder to hear positions')


class Vehicle:
    """Publishes samples as a bridge and a pilot do."""

    def __init__(self, graph: Graph, prefix: str = '', *, states: bool = True, command_type: type = TwistStamped) -> None:
        self._poses = graph.publisher(prefix + 'pose', PoseStamped, qos.SENSOR_DEEP)
        self._commands = graph.publisher(prefix + 'cmd_vel', command_type, qos.COMMAND_DEEP)
        self._command_type = command_type
        self._states = graph.publisher(prefix + 'vehicle_status', VehicleStatus, qos.latched(50)) if states else None
        until_heard(graph, lambda stamp_ns: self.pose(stamp_ns, ON_THE_GROUND_ENU_M))

    def fly(self, recording: Recording, frame_id: str = 'map') -> None:
        """Everything in the order of its stamps, many times faster than flown."""
        entries = [
            *((stamp, 0, event) for stamp, *event in recording.events),
            *((stamp, 1, position) for stamp, position in zip(*recording.poses, strict=True)),
            *((stamp, 2, velocity) for stamp, velocity in zip(*recording.commands, strict=True)),
        ]
        for stamp_ns, kind, value in sorted(entries, key=lambda entry: entry[:2]):
            (self.state, self.pose, self.command)[kind](int(stamp_ns), value, frame_id)

    def pose(self, stamp_ns: int, position: np.ndarray, frame_id: str = 'map') -> None:
        message = PoseStamped()
        message.header.stamp, message.header.frame_id = convert.stamp_from_ns(stamp_ns), frame_id
        place = message.pose.position
        place.x, place.y, place.z = map(float, position)
        self._poses.publish(message)
        time.sleep(PACE_S)

    def command(self, stamp_ns: int, velocity: np.ndarray, frame_id: str = 'map') -> None:
        message = self._command_type()
        if isinstance(message, TwistStamped):
            message.header.stamp, message.header.frame_id = convert.stamp_from_ns(stamp_ns), frame_id
        linear = message.twist.linear if isinstance(message, TwistStamped) else message.linear
        linear.x, linear.y, linear.z = map(float, velocity)
        self._commands.publish(message)

    def state(self, stamp_ns: int, state: list[bool], _: str = '') -> None:
        if self._states is not None:
            message = VehicleStatus(connected=True, armed=state[0], in_air=state[1])
            message.header.stamp = convert.stamp_from_ns(stamp_ns)
            self._states.publish(message)


def values(array: DiagnosticArray, node: str) -> dict[str, str]:
    return {pair.key: pair.value for status in array.status if status.name.endswith(node) for pair in status.values}


def demonstration(graph: Graph, demonstration_id: str, *, moves: bool = True) -> Demonstration:
    return graph.wait_for(
        'demonstration', Demonstration, lambda d: d.demonstration_id == demonstration_id and bool(d.states) == moves,
        qos=qos.DEMONSTRATIONS,
    )


def test_flights_become_demonstrations_that_equal_the_pure_function(graph: Graph, grid_file: str) -> None:
    graph.start('recorder', params={'grid_file': grid_file})
    vehicle = Vehicle(graph)
    first = flight(GRID, round_trip())
    second = flight(GRID, round_trip()[:4], start_ns=2000 * NS)
    vehicle.fly(first)
    demonstration(graph, 'flight-001')
    vehicle.fly(second)
    demonstration(graph, 'flight-002')
    for number, (recording, reason) in enumerate(((first, EndReason.FINAL_WAYPOINT), (second, EndReason.LANDED)), start=1):
        message = demonstration(graph, f'flight-{number:03}')
        published = convert.demonstration_from_msg(message)
        assert published.end_reason is reason
        pure = discretise(
            GRID, recording._replace(source=published.source), published.window_ns, SETTINGS, published.demonstration_id, reason,
        )
        assert published == pure
        assert convert.demonstration_to_msg(pure) == message
    assert len(demonstration(graph, 'flight-001').states) == len(round_trip()) - 1
    assert [GRID.cell_of(s) for s in demonstration(graph, 'flight-002').states] == round_trip()[:3]


def test_a_flight_that_goes_otherwise_than_commanded_is_warned_of_and_recorded(graph: Graph, grid_file: str) -> None:
    recorder = graph.start('recorder', params={'grid_file': grid_file})
    recording = flight(GRID, round_trip()[:4])
    stamps_ns, velocities = recording.commands
    Vehicle(graph).fly(recording._replace(commands=CommandSamples(stamps_ns, -velocities)))
    assert demonstration(graph, 'flight-001').states
    graph.wait_until(lambda: 'flight-001: 3 moves' in recorder.text, what='the sentence about the flight')
    assert ' while ' in recorder.text and 'Traceback' not in recorder.text


def test_without_vehicle_status_the_altitude_tells(graph: Graph, grid_file: str) -> None:
    graph.start('recorder', params={'grid_file': grid_file}, namespace='/drone1')
    vehicle = Vehicle(graph, '/drone1/', states=False)
    recording = flight(GRID, round_trip()[:3])
    vehicle.fly(recording._replace(commands=NO_COMMANDS))
    found = graph.wait_for('/drone1/demonstration', Demonstration, qos=qos.DEMONSTRATIONS)
    assert list(found.actions) == [Action.EAST, Action.EAST]
    assert found.end_reason == EndReason.LANDED and found.audit.ambiguous_actions == 2
    assert found.source == 'topic /drone1/pose'


def test_flights_of_the_policy_are_left_out(graph: Graph, grid_file: str) -> None:
    graph.start('recorder', params={'grid_file': grid_file})
    vehicle = Vehicle(graph)
    status = graph.publisher('policy/status', FlightStatus, qos.latched())
    status.publish(FlightStatus(phase=FlightStatus.FLYING))
    graph.wait_for('/diagnostics', DiagnosticArray, lambda a: 'recorder' in a.status[0].name)
    vehicle.fly(flight(GRID, round_trip()))
    status.publish(FlightStatus(phase=FlightStatus.SUCCEEDED))
    graph.wait_for('/diagnostics', DiagnosticArray, lambda a: 'recorder' in a.status[0].name, new=True)
    vehicle.fly(flight(GRID, round_trip()[:5], start_ns=5000 * NS))
    assert len(demonstration(graph, 'flight-001').states) == 4


def test_start_stop_and_discard(graph: Graph, grid_file: str) -> None:
    graph.start('recorder', params={'grid_file': grid_file, 'split': 'manual'})
    vehicle = Vehicle(graph)
    refused = graph.call(Trigger, 'recorder/stop')
    assert not refused.success and 'start first' in refused.message
    assert not graph.call(Trigger, 'recorder/discard').success

    assert graph.call(Trigger, 'recorder/start').success
    assert 'already' in graph.call(Trigger, 'recorder/start').message
    vehicle.fly(flight(GRID, round_trip()[:4], landing=False))
    stopped = graph.wait_until(lambda: _stopped(graph))
    assert 'flight-001 with 3 moves' in stopped.message
    assert demonstration(graph, 'flight-001').end_reason == EndReason.STOPPED

    assert graph.call(Trigger, 'recorder/start').success
    assert 'flight-002 is dropped' in graph.call(Trigger, 'recorder/discard').message
    taken = graph.call(Trigger, 'recorder/discard')
    assert taken.success and 'flight-001 is taken back' in taken.message
    assert demonstration(graph, 'flight-001', moves=False).audit.notes
    assert not graph.call(Trigger, 'recorder/discard').success


def test_what_is_discarded_goes_out_of_the_policy_too(graph: Graph, grid_file: str) -> None:
    graph.start('recorder', params={'grid_file': grid_file, 'split': 'manual'})
    learner = Learner(graph, grid_file, clusters=4)
    learner.publish(convert.demonstration_to_msg(walk(GRID, 7)))
    before = learner.policy(1, 0)
    vehicle = Vehicle(graph)
    assert graph.call(Trigger, 'recorder/start').success
    vehicle.fly(flight(GRID, round_trip()[:4], landing=False))
    graph.wait_until(lambda: _stopped(graph))
    with_it = learner.policy(2, 0)
    assert with_it.digest != before.digest
    graph.wait_until(lambda: learner.statuses[-1].demonstrations == 2)
    assert graph.call(Trigger, 'recorder/discard').success
    without = learner.policy(3, 0)  # It counts messages, so that replay knows which ones came before it.
    assert (without.digest, without.reward, without.version) == (before.digest, before.reward, with_it.version + 1)
    graph.wait_until(lambda: learner.statuses[-1].demonstrations == 1)


def test_a_learner_whose_only_demonstration_is_discarded_waits_for_another(graph: Graph, grid_file: str) -> None:
    learner = Learner(graph, grid_file, clusters=4)
    only = walk(GRID, 7)
    learner.publish(convert.demonstration_to_msg(only))
    assert learner.policy(1, 0).version == 1
    for _ in range(2):  # A publisher that comes back repeats it.
        learner.publish(convert.demonstration_to_msg(taken_back(only)))
    told = learner.status(LearnerStatus.WAITING_FOR_DEMONSTRATIONS, 'Policy 1 rests on some that were taken back')
    assert (told.demonstrations, told.policy_version) == (0, 1)
    learner.publish(convert.demonstration_to_msg(walk(GRID, 8)))
    assert learner.policy(3, 0).version == 2


def test_a_recorder_that_is_started_again_repeats_no_id(graph: Graph, grid_file: str) -> None:
    """Its own latched messages went with it; the learner remembers what it heard."""
    learner = Learner(graph, grid_file, clusters=4)
    first = graph.start('recorder', params={'grid_file': grid_file})
    Vehicle(graph).fly(flight(GRID, round_trip()))
    demonstration(graph, 'flight-001')
    graph.wait_until(lambda: learner.statuses and learner.statuses[-1].demonstration_ids == ['flight-001'])
    assert first.terminate() == 0
    graph.start('recorder', params={'grid_file': grid_file})
    graph.wait_for('/diagnostics', DiagnosticArray, lambda a: fresh_and_next(a, 'flight-002'))
    Vehicle(graph).fly(flight(GRID, round_trip(), start_ns=3000 * NS))
    assert demonstration(graph, 'flight-002').window_start.sec >= 3000
    graph.wait_until(lambda: learner.statuses[-1].demonstration_ids == ['flight-001', 'flight-002'])


def fresh_and_next(array: DiagnosticArray, demonstration_id: str) -> bool:
    """Whether a recorder that has published nothing yet says this of its next demonstration."""
    said = values(array, 'recorder')
    return said.get('demonstrations') == '0' and said['next'] == demonstration_id


def _stopped(graph: Graph) -> Trigger.Response | None:
    """Poses are best effort and beside the service: wait until enough of them have arrived."""
    reply = graph.call(Trigger, 'recorder/stop')
    if '3 moves' in reply.message:
        return reply
    graph.call(Trigger, 'recorder/start')
    return None


def test_wrong_frames_and_nan_are_refused_in_words(graph: Graph, grid_file: str) -> None:
    process = graph.start('recorder', params={'grid_file': grid_file})
    vehicle = Vehicle(graph)
    vehicle.fly(flight(GRID, round_trip()), frame_id='odom')
    wrong = graph.wait_for(
        '/diagnostics', DiagnosticArray, lambda a: "positions in frame 'odom'" in a.status[0].message,
    )
    assert int(next(v.value for v in wrong.status[0].values if v.key.startswith('positions in'))) > 0
    recording = flight(GRID, round_trip(), start_ns=3000 * NS)
    recording.poses.positions_enu_m[60] = np.nan
    vehicle.fly(recording)
    found = demonstration(graph, 'flight-001')
    assert any('1 positions are not numbers' in note for note in found.audit.notes)
    graph.wait_until(lambda: 'positions that are not numbers are not used' in process.text)
    assert process.text.count("positions in frame 'odom' are refused") == 1


def test_odometry_may_take_the_place_of_poses(graph: Graph, grid_file: str) -> None:
    graph.start('recorder', params={'grid_file': grid_file, 'pose_source': 'odom'})
    publisher = graph.publisher('odom', Odometry, qos.SENSOR_DEEP)

    def send(stamp_ns: int, position: np.ndarray = ON_THE_GROUND_ENU_M) -> None:
        message = Odometry()
        message.header.stamp, message.header.frame_id = convert.stamp_from_ns(stamp_ns), 'map'
        place = message.pose.pose.position
        place.x, place.y, place.z = position.tolist()
        publisher.publish(message)
        time.sleep(PACE_S)

    until_heard(graph, send)
    for stamp_ns, position in zip(*flight(GRID, round_trip()).poses, strict=True):
        send(int(stamp_ns), position)
    assert demonstration(graph, 'flight-001').end_reason == EndReason.FINAL_WAYPOINT


def test_a_log_is_published_and_latched(graph: Graph) -> None:
    log = BAGS / 'arducopter_flight1.tlog'
    graph.start('recorder', params={'grid_file': str(GRID_6X6), 'source': 'tlog', 'tlog_file': str(log)})
    found = demonstration(graph, 'flight-001')
    assert len(found.states) == 22 and found.end_reason == EndReason.FINAL_WAYPOINT and found.source == str(log)
    assert 'published already' in graph.call(Trigger, 'recorder/start').message


def test_a_log_without_a_flight_on_this_grid_says_why(graph: Graph, grid_file: str) -> None:
    high = Path(grid_file).with_name('high.yaml')
    high.write_text(Path(grid_file).read_text().replace('altitude: 5.0', 'altitude: 50.0'))
    log = BAGS / 'arducopter_flight1.tlog'
    graph.start('recorder', params={'grid_file': str(high), 'source': 'tlog', 'tlog_file': str(log)})
    said = 'gives no demonstration on this grid: no flight reaches 50 m, the highest position is'
    graph.wait_for(
        '/diagnostics', DiagnosticArray, lambda array: any(said in status.message for status in array.status),
    )


def test_plain_twists_and_positions_in_a_frame_of_another_name_are_taken(graph: Graph, grid_file: str) -> None:
    graph.start('recorder', params={'grid_file': grid_file, 'command_type': 'Twist', 'frame': 'odom'})
    vehicle, flown = Vehicle(graph, command_type=Twist), flight(GRID, round_trip())
    vehicle.fly(flown, frame_id='/odom')
    found = demonstration(graph, 'flight-001')
    assert len(found.states) == len(round_trip()) - 1
    assert not any('no commands' in note for note in found.audit.notes)


def test_a_live_link_is_listened_to(graph: Graph, grid_file: str, free_udp_port: int) -> None:
    graph.start(
        'recorder', params={'grid_file': grid_file, 'source': 'mavlink', 'mavlink_url': f'udpin:127.0.0.1:{free_udp_port}'},
    )
    graph.wait_for('/diagnostics', DiagnosticArray, lambda a: 'an autopilot' in a.status[0].message)
    codec = dialect.MAVLink(None, 1, 1)
    recording = flight(GRID, round_trip())
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.connect(('127.0.0.1', free_udp_port))
        for message in _autopilot(recording):
            link.send(message.pack(codec))
            time.sleep(PACE_S / 2)
        found = demonstration(graph, 'flight-001')
    assert found.end_reason == EndReason.FINAL_WAYPOINT and len(found.states) == len(round_trip()) - 1


def _autopilot(recording: Recording) -> Iterator[object]:
    yield dialect.MAVLink_heartbeat_message(2, 3, dialect.MAV_MODE_FLAG_SAFETY_ARMED, 4, 4, 3)
    yield dialect.MAVLink_extended_sys_state_message(0, 2)
    for boot_ms, (east, north, up) in enumerate(recording.poses.positions_enu_m, start=1):  # A hundred times faster.
        yield dialect.MAVLink_local_position_ned_message(boot_ms, north, east, -up, 0.0, 0.0, 0.0)
