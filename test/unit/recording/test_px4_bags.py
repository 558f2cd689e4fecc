"""Positions in PX4's own messages: of two versions, in sqlite3 and MCAP, with the definitions that the bags hold."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of
from advise_ros.core.errors import LogError
from advise_ros.recording.bags import read_bag
from support.flown import GRID, flight, round_trip

# Fields of px4_msgs in their order, as docs.px4.io lists them; those behind the position are of no use here.
NEW_ODOMETRY = """uint32 MESSAGE_VERSION = 0
uint64 timestamp
uint64 timestamp_sample
uint8 POSE_FRAME_NED = 1
uint8 POSE_FRAME_FRD = 2
uint8 pose_frame
float32[3] position
float32[4] q
uint8 velocity_frame
float32[3] velocity
"""
OLD_ODOMETRY = """uint64 timestamp
uint8 LOCAL_FRAME_NED=0
uint8 local_frame
float32 x
float32 y
float32 z
float32[4] q
"""
LOCAL_POSITION = """uint64 timestamp
uint64 timestamp_sample
bool xy_valid
bool z_valid
bool v_xy_valid
bool v_z_valid
float32 x
float32 y
float32 z
float32[2] delta_xy
uint8 xy_reset_counter
"""
ODOMETRY, LOCAL = 'px4_msgs/msg/VehicleOdometry', 'px4_msgs/msg/VehicleLocalPosition'
STATUS = 'px4_msgs/msg/VehicleStatus'
FLOWN = flight(GRID, round_trip())
STAMPS_NS = FLOWN.poses.stamps_ns // 1000 * 1000
EAST, NORTH, UP = FLOWN.poses.positions_enu_m.astype(np.float32).astype(np.float64).T


def bag(path: Path, topic: str, kind: str, text: str, fields: Any, plugin: StoragePlugin = StoragePlugin.MCAP) -> Path:
    """One message for each flown position; `fields` gives the values that are not 0, from north, east, down."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, kind))
    shapes = {'position': 3, 'q': 4, 'velocity': 3, 'delta_xy': 2}
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        connection = writer.add_connection(topic, kind, typestore=store)
        for stamp_ns, east, north, up in zip(STAMPS_NS.tolist(), EAST, NORTH, UP, strict=True):
            zeros = {name: np.zeros(shapes[name], np.float32) if name in shapes else 0 for name, _ in store.fielddefs[kind][1]}
            values = {**zeros, 'timestamp': stamp_ns // 1000, **fields(north, east, -up)}
            writer.write(connection, stamp_ns, store.serialize_cdr(store.types[kind](**values), kind))
    return path


def new_odometry(*ned: float, frame: int = 1) -> dict[str, Any]:
    return {'pose_frame': frame, 'position': np.array(ned, np.float32)}


def old_odometry(north: float, east: float, down: float) -> dict[str, Any]:
    return {'x': north, 'y': east, 'z': down}


def local_position(north: float, east: float, down: float) -> dict[str, Any]:
    return {'xy_valid': True, 'z_valid': True, 'x': north, 'y': east, 'z': down}


@pytest.mark.parametrize('plugin', list(StoragePlugin))
@pytest.mark.parametrize(('topic', 'kind', 'text', 'fields'), [
    ('/fmu/out/vehicle_odometry', ODOMETRY, NEW_ODOMETRY, new_odometry),
    ('/drone1/fmu/out/vehicle_odometry', ODOMETRY, OLD_ODOMETRY, old_odometry),
    ('/fmu/out/vehicle_local_position', LOCAL, LOCAL_POSITION, local_position),
])
def test_positions_come_out_east_north_up(
    tmp_path: Path, topic: str, kind: str, text: str, fields: Any, plugin: StoragePlugin,
) -> None:
    found = read_bag(bag(tmp_path / 'bag', topic, kind, text, fields, plugin))
    assert (found.poses.stamps_ns == STAMPS_NS).all()
    assert (found.poses.positions_enu_m == np.stack([EAST, NORTH, UP], axis=1)).all()
    (demonstration,) = demonstrations_of(GRID, found, DiscretiseSettings()).demonstrations
    assert len(demonstration.states) == len(round_trip()) - 1


def test_positions_that_px4_calls_invalid_are_no_numbers(tmp_path: Path) -> None:
    def fields(*ned: float) -> dict[str, Any]:
        return {**local_position(*ned), 'z_valid': -ned[2] > 1.0}

    found = read_bag(bag(tmp_path / 'bag', '/fmu/out/vehicle_local_position', LOCAL, LOCAL_POSITION, fields))
    numbers = np.isfinite(found.poses.positions_enu_m).all(axis=1)
    assert (numbers == (UP > 1.0)).all() and 0 < numbers.sum() < len(UP)


def test_what_cannot_be_used_is_told(tmp_path: Path) -> None:
    topic = '/fmu/out/vehicle_odometry'
    turned = bag(tmp_path / 'turned', topic, ODOMETRY, NEW_ODOMETRY, lambda *ned: new_odometry(*ned, frame=2))
    with pytest.raises(LogError, match="in frame 'PX4 frame 2', not 'map'"):
        read_bag(turned)
    text = 'uint64 timestamp\nuint8 pose_frame\n'
    elsewhere = bag(tmp_path / 'other', topic, ODOMETRY, text, lambda *ned: {})
    with pytest.raises(LogError, match='does not say where px4_msgs/msg/VehicleOdometry has its stamp and position'):
        read_bag(elsewhere)


def undefined(
    path: Path, kind: str, size: int, flags: dict[int, int], status: tuple[int, int], of_version: str = '',
) -> Path:
    """A file without definitions: messages of a size, with bytes at offsets; and one state of a size with its mode at another."""
    with path.open('wb') as stream:
        writer = McapWriter(stream)
        writer.start('ros2')
        positions = writer.register_channel('/fmu/out/vehicle_odometry', 'cdr', writer.register_schema(kind, '', b''))
        states = writer.register_channel(f'/fmu/out/vehicle_status{of_version}', 'cdr', writer.register_schema(STATUS, '', b''))
        state = bytearray(status[0])
        state[:4], state[28], state[status[1]] = b'\0\1\0\0', 2, 14
        writer.add_message(states, 0, bytes(state), 0)
        for stamp_ns, east, north, up in zip(STAMPS_NS.tolist(), EAST, NORTH, UP, strict=True):
            data = bytearray(size)
            struct.pack_into('<4xQ12x3f', data, 0, stamp_ns // 1000, north, east, -up)
            for at, value in {1: 1, **flags}.items():
                data[at] = value
            writer.add_message(positions, stamp_ns, bytes(data), stamp_ns)
        writer.finish()
    return path


@pytest.mark.parametrize(('kind', 'size', 'flags', 'status'), [
    (ODOMETRY, 118, {20: 1}, (84, 45)), (ODOMETRY, 265, {20: 0}, (116, 12)), (LOCAL, 220, {20: 1, 21: 1}, (87, 45)),
])
def test_a_bag_without_definitions_is_read_by_the_known_layouts(
    tmp_path: Path, kind: str, size: int, flags: dict[int, int], status: tuple[int, int],
) -> None:
    """The sizes are those of px4_msgs 1.13 to 1.18."""
    found = read_bag(undefined(tmp_path / 'flight.mcap', kind, size, flags, status))
    assert (found.poses.positions_enu_m == np.stack([EAST, NORTH, UP], axis=1)).all()
    assert (found.events[0].armed, found.events[0].mode) == (True, 'OFFBOARD')
    assert f'does not define {kind}' in ' '.join(found.notes)


@pytest.mark.parametrize('of_version', ['_v1', '_v4'])
def test_a_state_is_known_by_the_name_that_its_version_gives_it(tmp_path: Path, of_version: str) -> None:
    found = read_bag(undefined(tmp_path / 'flight.mcap', ODOMETRY, 118, {20: 1}, (84, 45), of_version))
    assert (found.events[0].armed, found.events[0].mode) == (True, 'OFFBOARD')


NEW_SETPOINT = """uint64 timestamp
float32[3] position
float32[3] velocity
float32[3] acceleration
float32[3] jerk
float32 yaw
float32 yawspeed
"""
OLD_SETPOINT = """uint64 timestamp
float32 x
float32 y
float32 z
float32 yaw
float32 yawspeed
float32 vx
float32 vy
float32 vz
float32[3] acceleration
float32[3] jerk
float32[3] thrust
"""


@pytest.mark.parametrize('defined', [True, False])
@pytest.mark.parametrize(('text', 'velocity_at', 'size'), [(NEW_SETPOINT, 24, 68), (OLD_SETPOINT, 32, 80)])
def test_velocities_of_trajectory_setpoints_are_commands(
    tmp_path: Path, defined: bool, text: str, velocity_at: int, size: int,
) -> None:
    """Every other one asks for a position only: these are left out with a note."""
    path, kind = tmp_path / 'flight.mcap', 'px4_msgs/msg/TrajectorySetpoint'
    with path.open('wb') as stream:
        writer = McapWriter(stream)
        writer.start('ros2')
        schema = writer.register_schema(ODOMETRY, 'ros2msg', NEW_ODOMETRY.encode())
        positions = writer.register_channel('/fmu/out/vehicle_odometry', 'cdr', schema)
        schema = writer.register_schema(kind, 'ros2msg' if defined else '', text.encode() if defined else b'')
        setpoints = writer.register_channel('/fmu/in/trajectory_setpoint', 'cdr', schema)
        for stamp_ns, east, north, up in zip(STAMPS_NS.tolist(), EAST, NORTH, UP, strict=True):
            data = bytearray(60)
            struct.pack_into('<4xQ8xB3x3f', data, 0, stamp_ns // 1000, 1, north, east, -up)
            data[1] = 1
            writer.add_message(positions, stamp_ns, bytes(data), stamp_ns)
        for number, (stamp_ns, velocity) in enumerate(zip(*FLOWN.commands, strict=True)):
            data = bytearray(size)
            struct.pack_into('<4xQ', data, 0, int(stamp_ns) // 1000)
            east, north, _ = velocity if number % 2 == 0 else (np.nan,) * 3
            struct.pack_into('<3f', data, velocity_at, north, east, np.nan)
            data[1] = 1
            writer.add_message(setpoints, int(stamp_ns), bytes(data), int(stamp_ns))
        writer.finish()
    found = read_bag(path)
    expected = FLOWN.commands.velocities_enu_m_s.astype(np.float32)[::2] * [1, 1, 0]
    assert (found.commands.velocities_enu_m_s == expected).all()
    left_out = len(FLOWN.commands.stamps_ns) // 2
    assert f'{left_out} of {len(FLOWN.commands.stamps_ns)} setpoints on /fmu/in/trajectory_setpoint' in ' '.join(found.notes)
    assert ('does not define' in ' '.join(found.notes)) is not defined
