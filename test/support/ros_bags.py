"""Bags of messages by other writers, for tests of reading them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from advise_ros.core.demonstrations.samples import Recording, VehicleEvent
from advise_ros.recording.definitions import definition
from advise_ros.recording.writer import BagWriter
from support.paths import ROOT

STORE = get_typestore(Stores.ROS2_JAZZY)
MESSAGES = ROOT / 'msg_defs' / 'msg'
for kind in ('VehicleStatus', 'FlightStatus'):
    STORE.register(get_types_from_msg((MESSAGES / f'{kind}.msg').read_text(), f'advise_msgs/msg/{kind}'))
# Of a package that rosbags does not ship.
GEOGRAPHIC = {
    'GeoPoint': 'float64 latitude\nfloat64 longitude\nfloat64 altitude\n',
    'GeoPose': 'GeoPoint position\ngeometry_msgs/Quaternion orientation\n',
    'GeoPoseStamped': 'std_msgs/Header header\nGeoPose pose\n',
}
for kind, text in GEOGRAPHIC.items():
    STORE.register(get_types_from_msg(text, f'geographic_msgs/msg/{kind}'))
# As mavros_msgs has it.
STORE.register(get_types_from_msg(
    'std_msgs/Header header\nuint8 coordinate_frame\nuint8 FRAME_LOCAL_NED = 1\nuint16 type_mask\ngeometry_msgs/Point position\n'
    'geometry_msgs/Vector3 velocity\ngeometry_msgs/Vector3 acceleration_or_force\nfloat32 yaw\nfloat32 yaw_rate\n',
    'mavros_msgs/msg/PositionTarget',
))
Entry = tuple[str, Any, int]


def make(kind: str, **fields: Any) -> Any:
    """A message; numbers that are not named are 0."""
    return STORE.types[kind](**{name: fields.get(name, 0) for name, _ in STORE.fielddefs[kind][1]})


def header(stamp_ns: int, frame_id: str) -> Any:
    stamp = make('builtin_interfaces/msg/Time', sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return make('std_msgs/msg/Header', stamp=stamp, frame_id=frame_id)


def vector(x: float, y: float, z: float, kind: str = 'Vector3') -> Any:
    return make(f'geometry_msgs/msg/{kind}', x=float(x), y=float(y), z=float(z))


def pose(stamp_ns: int, position: Sequence[float], frame_id: str = 'map') -> Any:
    still = make('geometry_msgs/msg/Quaternion', x=0.0, y=0.0, z=0.0, w=1.0)
    inner = make('geometry_msgs/msg/Pose', position=vector(*position, kind='Point'), orientation=still)
    return make('geometry_msgs/msg/PoseStamped', header=header(stamp_ns, frame_id), pose=inner)


def odometry(stamp_ns: int, position: Sequence[float], frame_id: str = 'map') -> Any:
    twist = make('geometry_msgs/msg/Twist', linear=vector(0, 0, 0), angular=vector(0, 0, 0))
    inner, unknown = pose(stamp_ns, position).pose, np.zeros(36)
    return make(
        'nav_msgs/msg/Odometry', header=header(stamp_ns, frame_id), child_frame_id='base_link',
        pose=make('geometry_msgs/msg/PoseWithCovariance', pose=inner, covariance=unknown),
        twist=make('geometry_msgs/msg/TwistWithCovariance', twist=twist, covariance=unknown),
    )


def command(stamp_ns: int, velocity: Sequence[float], frame_id: str = 'map') -> Any:
    twist = make('geometry_msgs/msg/Twist', linear=vector(*velocity), angular=vector(0, 0, 0))
    return make('geometry_msgs/msg/TwistStamped', header=header(stamp_ns, frame_id), twist=twist)


def plain_command(velocity: Sequence[float]) -> Any:
    return make('geometry_msgs/msg/Twist', linear=vector(*velocity), angular=vector(0, 0, 0))


def position_target(stamp_ns: int, velocity: Sequence[float], frame: int = 1, ignored: int = 7, frame_id: str = 'map') -> Any:
    """MAVROS's setpoint; `ignored`: bits of what to leave out, by default the position."""
    return make(
        'mavros_msgs/msg/PositionTarget', header=header(stamp_ns, frame_id), coordinate_frame=frame, type_mask=ignored,
        position=vector(99.0, 98.0, 97.0, kind='Point'), velocity=vector(*velocity), acceleration_or_force=vector(0, 0, 0),
        yaw=0.0, yaw_rate=0.0,
    )


def transform(stamp_ns: int, position: Sequence[float], frame_id: str, child: str, yaw_rad: float = 0.0) -> Any:
    turned = make('geometry_msgs/msg/Quaternion', x=0.0, y=0.0, z=math.sin(yaw_rad / 2), w=math.cos(yaw_rad / 2))
    inner = make('geometry_msgs/msg/Transform', translation=vector(*position), rotation=turned)
    return make('geometry_msgs/msg/TransformStamped', header=header(stamp_ns, frame_id), child_frame_id=child, transform=inner)


def status(event: VehicleEvent) -> Any:
    return make(
        'advise_msgs/msg/VehicleStatus', header=header(event.stamp_ns, ''), autopilot=event.autopilot, mode=event.mode,
        connected=event.connected, ready=True, armed=event.armed, in_air=event.in_air, commandable=event.in_air,
        waiting_for='', text='', owner=event.owner, failsafe='',
    )


def policy(stamp_ns: int, phase: int) -> Any:
    return make('advise_msgs/msg/FlightStatus', header=header(stamp_ns, ''), phase=phase, message='', refusal='')


def bag(
    path: Path,
    entries: Sequence[Entry],
    plugin: StoragePlugin = StoragePlugin.MCAP,
    silent: Mapping[str, str] | None = None,
    *,
    in_order: bool = True,
    compression: CompressionMode = CompressionMode.NONE,
) -> Path:
    """In the order of the log times, or as given; `silent`: topics without messages, with their types."""
    writer = Writer(path, version=9, storage_plugin=plugin)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for topic, kind in (silent or {}).items():
            writer.add_connection(topic, kind, typestore=STORE)
        for topic, message, stamp_ns in sorted(entries, key=lambda entry: entry[2]) if in_order else entries:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(connections[topic], stamp_ns, STORE.serialize_cdr(message, kind))
    return path


def own_bag(path: Path, entries: Sequence[Entry], chunk_bytes: int = 2000) -> Path:
    """By the writer of our logger, in the order given."""
    writer = BagWriter(path, chunk_bytes=chunk_bytes)
    channels: dict[str, int] = {}
    for topic, message, stamp_ns in entries:
        kind = message.__msgtype__
        if topic not in channels:
            channels[topic] = writer.add_topic(topic, definition(kind))
        writer.write(channels[topic], stamp_ns, stamp_ns, bytes(STORE.serialize_cdr(message, kind)))
    writer.close()
    return path


def entries_of(recording: Recording, prefix: str = '', frame_id: str = 'map') -> list[Entry]:
    return [
        *((f'{prefix}/pose', pose(int(s), p, frame_id), int(s)) for s, p in zip(*recording.poses, strict=True)),
        *((f'{prefix}/cmd_vel', command(int(s), v), int(s)) for s, v in zip(*recording.commands, strict=True)),
        *((f'{prefix}/vehicle_status', status(event), event.stamp_ns) for event in recording.events),
    ]
