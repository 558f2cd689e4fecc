"""Which topics of a bag are read, in which frame and on whose clock."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymap3d import enu2geodetic

from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of
from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.errors import LogError
from advise_ros.core.units import NS
from advise_ros.recording.bags import read_bag
from advise_ros.recording.place import Place
from advise_ros.recording.topics import BagTopics
from support.flown import GRID, flight, round_trip
from support.ros_bags import (
    Entry,
    bag,
    command,
    entries_of,
    header,
    make,
    odometry,
    plain_command,
    pose,
    position_target,
    status,
    transform,
)

FLOWN = flight(GRID, round_trip())
POSES = [(int(stamp_ns), position) for stamp_ns, position in zip(*FLOWN.poses, strict=True)]
COMMANDS = [(int(stamp_ns), velocity) for stamp_ns, velocity in zip(*FLOWN.commands, strict=True)]
MAVROS = '/mavros/local_position'


def positions(topic: str, make: Any = pose, **fields: Any) -> list[Entry]:
    return [(topic, make(stamp_ns, position, **fields), stamp_ns) for stamp_ns, position in POSES]


def standing(topic: str, place: Sequence[float] = (2.0, 4.0, 5.0)) -> list[Entry]:
    return [(topic, pose(stamp_ns, place), stamp_ns) for stamp_ns, _ in POSES]


def commanded(topic: str) -> list[Entry]:
    return [(topic, command(stamp_ns, velocity), stamp_ns) for stamp_ns, velocity in COMMANDS]


def chosen(found: Recording) -> tuple[str, ...]:
    """Of positions, commands and state."""
    match = re.search(r'\(positions (\S+), commands (\S+), state (\S+)\)$', found.source)
    assert match is not None, found.source
    return match.groups()


def flown_as_commanded(found: Recording) -> bool:
    (demonstration,) = demonstrations_of(GRID, found, DiscretiseSettings()).demonstrations
    (expected,) = demonstrations_of(GRID, FLOWN, DiscretiseSettings()).demonstrations
    same = demonstration.states == expected.states and demonstration.actions == expected.actions
    return same and demonstration.audit.ambiguous_actions == expected.audit.ambiguous_actions


# -- names -----------------------------------------------------------------------------------------
@pytest.mark.parametrize('prefix', ['', 'drone1/', '/drone1/'])
@pytest.mark.parametrize('end', ['', '/'])
def test_a_topic_is_the_same_with_and_without_slashes_around_it(tmp_path: Path, prefix: str, end: str) -> None:
    entries = [*positions(f'{prefix}pose{end}'), *commanded(f'{prefix}cmd_vel{end}')]
    path = bag(tmp_path / 'bag', entries)
    full = '/' + prefix.strip('/') + '/' * bool(prefix)
    for name in (f'{full}pose', f'{full}pose/', 'pose', 'pose/'):
        found = read_bag(path, BagTopics(pose=(name,)))
        assert chosen(found) == (f'{full}pose', f'{full}cmd_vel', 'none') and flown_as_commanded(found)


# -- chosen by what is on them ---------------------------------------------------------------------
@pytest.mark.parametrize(('entries', 'silent', 'expected'), [
    (positions(f'{MAVROS}/odom', odometry), {f'{MAVROS}/pose': 'geometry_msgs/msg/PoseStamped'}, f'{MAVROS}/odom'),
    (positions('/odom', odometry), {'/pose': 'geometry_msgs/msg/PoseStamped'}, '/odom'),
    ([*positions('/odom', odometry), *standing('/target/pose')], {}, '/odom'),
    ([*positions('/odom', odometry), *standing('/pose')], {}, '/odom'),
    ([*positions(f'{MAVROS}/odom', odometry), *positions('/mavros/vision_pose/pose')], {}, f'{MAVROS}/odom'),
    ([*positions('/mavros/local_position/odom', odometry), *positions('/drone/pose')], {}, f'{MAVROS}/odom'),
    ([*positions('/pose'), *positions('/odom', odometry)], {}, '/pose'),
    ([*positions('/drone1/odom', odometry), *standing('/drone2/odom', (0.0, 0.0, 0.0))], {}, '/drone1/odom'),
    (positions('/vicon/x1/x1', transform, frame_id='map', child='x1'), {}, '/vicon/x1/x1'),
    ([*positions('/estimate'), *standing('/goal_pose')], {}, '/estimate'),
], ids=['silent', 'silent-plain', 'target', 'still', 'vision', 'mavros-first', 'pose-first', 'ground', 'vicon', 'any'])
def test_positions_are_taken_from_what_flies(
    tmp_path: Path, entries: list[Entry], silent: dict[str, str], expected: str,
) -> None:
    found = read_bag(bag(tmp_path / 'bag', entries, silent=silent))
    assert chosen(found)[0] == expected
    assert (found.poses.positions_enu_m == FLOWN.poses.positions_enu_m).all()
    others = {topic for topic, *_ in entries} - {expected, '/goal_pose'}
    assert all(any(topic in note and '--pose-topic' in note for note in found.notes) for topic in others)


def test_of_several_that_fly_one_is_named_by_its_topic_or_by_its_vehicle(tmp_path: Path) -> None:
    other = flight(GRID, round_trip()[:4])
    path = bag(tmp_path / 'bag', [*entries_of(FLOWN, '/a'), *entries_of(other, '/b')])
    with pytest.raises(LogError, match=r'positions on /a/pose, /b/pose; name one .*--vehicle a or b'):
        read_bag(path)
    found = read_bag(path, BagTopics(vehicle='b'))
    assert chosen(found) == ('/b/pose', '/b/cmd_vel', '/b/vehicle_status')
    assert (found.poses.stamps_ns == other.poses.stamps_ns).all()
    with pytest.raises(LogError, match='no positions of vehicle c'):
        read_bag(path, BagTopics(vehicle='c'))


def test_a_silent_topic_that_was_named_is_not_replaced(tmp_path: Path) -> None:
    path = bag(tmp_path / 'bag', positions('/odom', odometry), silent={'/pose': 'geometry_msgs/msg/PoseStamped'})
    with pytest.raises(LogError, match=r'no message on /pose; it has /odom .*, /pose .*silent'):
        read_bag(path, BagTopics(pose=('/pose',)))


@pytest.mark.parametrize(('pose_topic', 'command_topic', 'is_taken'), [
    ('/drone1/pose', '/drone2/cmd_vel', False),
    ('/swarm/drone1/pose', '/swarm/drone2/cmd_vel', False),
    ('/pose', '/drone2/cmd_vel', False),
    ('/pose', '/pilot/cmd_vel', True),
    ('/drone1/pose', '/drone1/teleop/cmd_vel', True),
    ('/drone1/mavros/local_position/pose', '/drone1/mavros/setpoint_velocity/cmd_vel', True),
    ('/vrpn_mocap/drone/pose', '/cmd_vel', True),
])
def test_commands_and_states_are_those_of_the_vehicle(
    tmp_path: Path, pose_topic: str, command_topic: str, is_taken: bool,
) -> None:
    state_topic = command_topic.replace('cmd_vel', 'vehicle_status')
    states = [(state_topic, status(event), event.stamp_ns) for event in FLOWN.events]
    found = read_bag(bag(tmp_path / 'bag', [*positions(pose_topic), *commanded(command_topic), *states]))
    assert chosen(found) == (pose_topic, *((command_topic, state_topic) if is_taken else ('none', 'none')))
    named = f'not used: {len(COMMANDS)} geometry_msgs/msg/TwistStamped on {command_topic} (--command-topic {command_topic})'
    assert (named in found.notes) is not is_taken
    with_it = read_bag(tmp_path / 'bag', BagTopics(command=command_topic, required=('command',)))
    assert flown_as_commanded(with_it)


# -- frames ----------------------------------------------------------------------------------------
@pytest.mark.parametrize(('frame_id', 'option'), [('/map', ''), ('odom', 'odom'), ('drone1/map', '/drone1/map'), ('', 'map')])
def test_a_frame_may_be_said_to_be_the_map(tmp_path: Path, frame_id: str, option: str) -> None:
    path = bag(tmp_path / 'bag', [*positions('/pose', frame_id=frame_id), *commanded('/cmd_vel')])
    if option:
        with pytest.raises(LogError, match=f"in frame '{frame_id}', not 'map' .*--frame"):
            read_bag(path)
    assert flown_as_commanded(read_bag(path, BagTopics(frame=option)))


EAST_M, NORTH_M, YAW_DEG = 3.0, -2.0, 90.0


def in_odom(vectors_enu: np.ndarray, *, velocities: bool = False) -> np.ndarray:
    """In a frame whose origin lies there and whose x axis looks north."""
    east, north, up = (vectors_enu - (0.0 if velocities else np.array([EAST_M, NORTH_M, 0.0]))).T
    return np.column_stack([north, -east, up])


def tf(topic: str, at_ns: int, *transforms: Any) -> Entry:
    return topic, make('tf2_msgs/msg/TFMessage', transforms=list(transforms)), at_ns


def map_to_odom(at_ns: int, topic: str = '/tf_static', parent: str = 'map', child: str = 'odom') -> Entry:
    return tf(topic, at_ns, transform(at_ns, (EAST_M, NORTH_M, 0.0), parent, child, math.radians(YAW_DEG)))


def flown_in_odom(frame_id: str = 'odom') -> list[Entry]:
    places, velocities = in_odom(FLOWN.poses.positions_enu_m), in_odom(FLOWN.commands.velocities_enu_m_s, velocities=True)
    return [
        *(('/odom', odometry(stamp_ns, place, frame_id), stamp_ns) for (stamp_ns, _), place in zip(POSES, places, strict=True)),
        *(('/cmd_vel', command(stamp_ns, v, frame_id), stamp_ns) for (stamp_ns, _), v in zip(COMMANDS, velocities, strict=True)),
    ]


def same_place(found: Recording) -> bool:
    near = np.abs(found.poses.positions_enu_m - FLOWN.poses.positions_enu_m).max() < 1e-9
    return bool(near) and flown_as_commanded(found)


@pytest.mark.parametrize('extra', [
    [map_to_odom(1)],
    [map_to_odom(1, '/tf', '/map', '/odom')],
    [tf('/tf_static', 1, transform(1, (EAST_M, NORTH_M, 0.0), 'map', 'earth', math.radians(YAW_DEG))),
     tf('/tf', 2, transform(2, (0.0, 0.0, 0.0), 'earth', 'odom'))],
    [tf('/tf_static', 1, transform(1, (NORTH_M, -EAST_M, 0.0), 'odom', 'world', 0.0)),
     tf('/tf_static', 1, transform(1, (-2 * NORTH_M, 2 * EAST_M, 0.0), 'world', 'map', -math.radians(YAW_DEG)))],
], ids=['static', 'slashes', 'chain', 'inverse'])
def test_tf_of_the_bag_brings_positions_and_commands_into_the_map(tmp_path: Path, extra: list[Entry]) -> None:
    assert same_place(read_bag(bag(tmp_path / 'bag', [*extra, *flown_in_odom()])))


def test_a_transform_that_is_corrected_holds_from_its_stamp_on(tmp_path: Path) -> None:
    middle = POSES[150][0]
    entries = flown_in_odom()
    wrong = tf('/tf', 1, transform(1, (0.0, 0.0, 0.0), 'map', 'odom', math.radians(YAW_DEG)))
    found = read_bag(bag(tmp_path / 'bag', [wrong, map_to_odom(middle, '/tf'), *entries]))
    off_m = np.linalg.norm(found.poses.positions_enu_m - FLOWN.poses.positions_enu_m, axis=1)
    assert np.allclose(off_m[:150], math.hypot(EAST_M, NORTH_M)) and np.allclose(off_m[150:], 0.0)


def test_where_a_frame_lies_may_be_stated(tmp_path: Path) -> None:
    path = bag(tmp_path / 'bag', flown_in_odom())
    with pytest.raises(LogError, match=r"in frame 'odom', not 'map' .* no tf connects the two; .*--frame odom; .*--frame-at="):
        read_bag(path)
    assert same_place(read_bag(path, BagTopics(frame='odom', frame_at=(EAST_M, NORTH_M, 0.0, YAW_DEG))))


@pytest.mark.parametrize('prefix', ['', 'drone1/'])
def test_without_other_positions_the_vehicles_frame_in_tf_is_where_it_is(tmp_path: Path, prefix: str) -> None:
    places = in_odom(FLOWN.poses.positions_enu_m)
    moving = [
        tf('/tf', stamp_ns, transform(stamp_ns, place, f'{prefix}odom', f'{prefix}base_link'))
        for (stamp_ns, _), place in zip(POSES, places, strict=True)
    ]
    still = [tf('/tf', s + 5, transform(s, (1.0, 1.0, 0.0), 'map', 'drone2/base_link')) for s, _ in POSES]
    commands = commanded(f'/{prefix}cmd_vel')
    path = bag(tmp_path / 'bag', [map_to_odom(1, child=f'{prefix}odom'), *moving, *still, *commands])
    found = read_bag(path)
    assert same_place(found) and chosen(found)[0] == f'/{prefix}base_link'
    assert (read_bag(path, BagTopics(vehicle='drone2')).poses.positions_enu_m == (1.0, 1.0, 0.0)).all()


# -- clocks ----------------------------------------------------------------------------------------
def recorded(
    commands: list[Any], stamps_ns: np.ndarray = FLOWN.poses.stamps_ns, log_ns: np.ndarray = FLOWN.poses.stamps_ns,
) -> list[Entry]:
    """The flight with positions stamped and recorded so, and commands recorded a millisecond after each position."""
    poses = [
        ('/pose', pose(int(stamp_ns), position), int(at_ns))
        for stamp_ns, at_ns, position in zip(stamps_ns, log_ns, FLOWN.poses.positions_enu_m, strict=True)
    ]
    return [*poses, *(('/cmd_vel', message, int(at_ns) + 10**6) for message, at_ns in zip(commands, log_ns, strict=True))]


@pytest.mark.parametrize('begin_s', [20, 10**9])
def test_a_plain_twist_counts_from_when_it_was_recorded(tmp_path: Path, begin_s: int) -> None:
    """Also where the clock of the positions runs at half the speed of the log's."""
    stamps_ns = begin_s * NS + FLOWN.poses.stamps_ns - FLOWN.poses.stamps_ns[0]
    log_ns = 7 * 10**17 + 2 * (stamps_ns - stamps_ns[0])
    found = read_bag(bag(tmp_path / 'bag', recorded([plain_command(v) for _, v in COMMANDS], stamps_ns, log_ns)))
    assert flown_as_commanded(found)
    assert np.abs(found.commands.stamps_ns - stamps_ns).max() <= 10**6
    assert any('have no stamp: they count from when they were recorded' in note for note in found.notes)


@pytest.mark.parametrize('ahead_s', [-900_000_000, -30, 12, 1_100_000_000])
def test_commands_of_another_clock_count_from_when_they_were_recorded(tmp_path: Path, ahead_s: int) -> None:
    stamps_ns = FLOWN.poses.stamps_ns + 10**18
    commands = [command(int(stamp_ns) + ahead_s * NS, v) for stamp_ns, (_, v) in zip(stamps_ns, COMMANDS, strict=True)]
    path = bag(tmp_path / 'bag', recorded(commands, stamps_ns, FLOWN.poses.stamps_ns + 3 * 10**18))
    found = read_bag(path)
    assert flown_as_commanded(found) and np.abs(found.commands.stamps_ns - stamps_ns).max() <= 10**6
    (note,) = (note for note in found.notes if 'another clock' in note)
    assert f'/cmd_vel are of another clock, {ahead_s - 0.001:.1f} s ahead' in note
    as_stamped = read_bag(path, BagTopics(as_stamped=True))
    assert (as_stamped.commands.stamps_ns == stamps_ns + ahead_s * NS).all() and not as_stamped.notes


def test_positions_that_came_late_by_radio_are_not_of_another_clock(tmp_path: Path) -> None:
    late_ns = FLOWN.poses.stamps_ns + 3 * NS
    entries = [*(('/pose', message, at) for (_, message, _), at in zip(positions('/pose'), late_ns.tolist(), strict=True))]
    found = read_bag(bag(tmp_path / 'bag', [*entries, *commanded('/cmd_vel')]))
    assert (found.commands.stamps_ns == FLOWN.commands.stamps_ns).all() and not found.notes


def test_a_playback_in_a_loop_recorded_by_simulated_time_is_divided(tmp_path: Path) -> None:
    """Log times begin anew with the stamps; the file is in order of arrival."""
    other = flight(GRID, round_trip()[:4])
    first, second = (sorted(entries_of(one), key=lambda entry: entry[2]) for one in (FLOWN, other))
    both = bag(tmp_path / 'both', [*first, *second, *first], in_order=False)
    found = demonstrations_of(GRID, read_bag(both), DiscretiseSettings())
    (one,), (two,) = (demonstrations_of(GRID, flown, DiscretiseSettings()).demonstrations for flown in (FLOWN, other))
    assert [demonstration.actions for demonstration in found.demonstrations] == [one.actions, two.actions, one.actions]
    assert len(found.notes) == 2 and all('the clock goes back' in note for note in found.notes)


# -- places on the earth ---------------------------------------------------------------------------
HILL = Place(47.397742, 8.545594, heading_deg=30.0)
GROUND_M = 488.0


def fixes(topic: str, place: Place = HILL, *, geographic: bool = False, no_fix: int = 0) -> list[Entry]:
    """As a receiver has them that flies FLOWN on a grid at that place; the first ones without a fix."""
    found: list[Entry] = []
    heading = math.radians(place.heading_deg)
    for number, (stamp_ns, (x, y, z)) in enumerate(POSES):
        east, north = x * math.cos(heading) + y * math.sin(heading), y * math.cos(heading) - x * math.sin(heading)
        latitude, longitude, _ = enu2geodetic(east, north, 0.0, place.latitude_deg, place.longitude_deg, 0.0)
        where = {'latitude': float(latitude), 'longitude': float(longitude), 'altitude': z + GROUND_M}
        head = header(stamp_ns, 'gps_link')
        if geographic:
            still = make('geometry_msgs/msg/Quaternion', x=0.0, y=0.0, z=0.0, w=1.0)
            inner = make('geographic_msgs/msg/GeoPose', position=make('geographic_msgs/msg/GeoPoint', **where), orientation=still)
            message = make('geographic_msgs/msg/GeoPoseStamped', header=head, pose=inner)
        else:
            state = make('sensor_msgs/msg/NavSatStatus', status=-1 if number < no_fix else 2, service=1)
            message = make('sensor_msgs/msg/NavSatFix', header=head, status=state, position_covariance=np.zeros(9), **where)
        found.append((topic, message, stamp_ns))
    return found


def turned_to_east_and_north() -> list[Entry]:
    """Commands as MAVROS sends them: to the true east and north."""
    back = Place(0.0, 0.0, -HILL.heading_deg)
    return [('/cmd_vel', command(stamp, back.turned(np.array([velocity]))[0]), stamp) for stamp, velocity in COMMANDS]


@pytest.mark.parametrize('geographic', [False, True], ids=['NavSatFix', 'GeoPoseStamped'])
def test_places_on_the_earth_are_positions_of_a_grid_that_has_one(tmp_path: Path, geographic: bool) -> None:
    topic = '/ap/geopose/filtered' if geographic else '/mavros/global_position/global'
    path = bag(tmp_path / 'bag', [*fixes(topic, geographic=geographic), *turned_to_east_and_north()])
    found = read_bag(path, place=HILL)
    assert chosen(found)[0] == topic and flown_as_commanded(found)
    assert np.abs(found.poses.positions_enu_m - FLOWN.poses.positions_enu_m).max() < 0.11
    assert f'heights on {topic} count from {GROUND_M + 0.1:.1f} m' in found.notes[0]
    with pytest.raises(LogError, match=rf'positions on {topic} are places on the earth; .*origin_wgs84'):
        read_bag(path)
    with pytest.raises(LogError, match=r'lie \d+ km from origin_wgs84'):
        read_bag(path, place=Place(8.545594, 47.397742))


def test_a_receiver_without_a_fix_is_nowhere(tmp_path: Path) -> None:
    path = bag(tmp_path / 'some', [*fixes('/fix', no_fix=5), *turned_to_east_and_north()])
    assert np.isnan(read_bag(path, place=HILL).poses.positions_enu_m[:5]).all()
    path = bag(tmp_path / 'none', fixes('/fix', no_fix=len(POSES)))
    with pytest.raises(LogError, match='topic /fix: none of its positions has a fix'):
        read_bag(path, place=HILL)


def test_positions_in_metres_go_before_places_on_the_earth_and_those_are_not_named_as_unused(tmp_path: Path) -> None:
    path = bag(tmp_path / 'bag', [*fixes('/mavros/global_position/global'), *positions(f'{MAVROS}/pose')])
    found = read_bag(path, place=HILL)
    assert chosen(found)[0] == f'{MAVROS}/pose' and not found.notes
    assert chosen(read_bag(path, BagTopics(pose=('global_position/global',)), place=HILL))[0] == '/mavros/global_position/global'


# -- setpoints -------------------------------------------------------------------------------------
def setpoints(topic: str = '/mavros/setpoint_raw/local', **fields: Any) -> list[Entry]:
    return [(topic, position_target(stamp_ns, velocity, **fields), stamp_ns) for stamp_ns, velocity in COMMANDS]


@pytest.mark.parametrize('frame_id', ['map', '', 'base_link_frd'])
def test_velocities_of_mavros_raw_setpoints_are_commands(tmp_path: Path, frame_id: str) -> None:
    found = read_bag(bag(tmp_path / 'raw', positions(f'{MAVROS}/pose') + setpoints(frame_id=frame_id)))
    assert chosen(found)[1] == '/mavros/setpoint_raw/local'
    assert flown_as_commanded(found)
    assert not found.notes


@pytest.mark.parametrize(('fields', 'note'), [
    ({'ignored': 0b111000}, f'{len(COMMANDS)} of {len(COMMANDS)} setpoints on /mavros/setpoint_raw/local ask for no velocity'),
    ({'frame': 8}, f"{len(COMMANDS)} commands in frame 'MAV_FRAME 8' are not in 'map' and were not used"),
])
def test_raw_setpoints_of_another_kind_are_left_out_with_a_note(tmp_path: Path, fields: dict[str, Any], note: str) -> None:
    found = read_bag(bag(tmp_path / 'raw', positions(f'{MAVROS}/pose') + setpoints(**fields)))
    assert not len(found.commands.stamps_ns)
    assert any(one.startswith(note) for one in found.notes), found.notes


def test_velocity_commands_go_before_raw_setpoints(tmp_path: Path) -> None:
    velocity = '/mavros/setpoint_velocity/cmd_vel'
    found = read_bag(bag(tmp_path / 'both', positions(f'{MAVROS}/pose') + setpoints(ignored=0b111000) + commanded(velocity)))
    assert chosen(found)[1] == velocity
    assert flown_as_commanded(found)
